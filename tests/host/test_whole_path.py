"""The whole path in real time: a real controller process, a link, a game; then SIGKILL."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from controller.shared.protocol.messages import Command, Contact, Contacts
from host.app.application import OrbApp
from host.connection.receiver import Connected, Delivered, Received, Receiver
from host.connection.transport import open_transport
from tests.support.serial_cable import Cable
from tetris.engine.game import Phase
from tetris.window.app import Start

PATIENCE_S = 20.0  # networks are loaded and proved before the first frame
NOTICE_S = 2.0  # a dead orb is noticed within this time
CONTROLLER = (sys.executable, "-m", "controller", "--sensor", "virtual", "--seed", "5", "--link")


class Table:
    """A player at a game, whose orb is a real process at the other end of a link."""

    def __init__(self, url: str) -> None:
        self.target = OrbApp(Start("zen", 1), sound=False)
        self.receiver = Receiver(lambda: open_transport(url))
        self.receiver.start()
        self.heard: list[Received] = []

    def play(self, condition: Callable[[], bool], patience_s: float = PATIENCE_S) -> float:
        """Play on until the condition holds; return how long it took."""
        began = time.monotonic()
        while not condition():
            assert time.monotonic() < began + patience_s, f"not within {patience_s} s"
            self.receiver.wait(0.02)
            news = self.receiver.poll()
            self.heard += news
            self.target.tick(time.monotonic(), news)
        return time.monotonic() - began

    def commands(self) -> list[str]:
        messages = [item.message for item in self.heard if isinstance(item, Delivered)]
        return [message.name for message in messages if isinstance(message, Command)]

    def press_left(self) -> None:
        """Touch the left of the dome until the command comes, then lift."""
        self.receiver.send(Contacts((Contact(0, 0.8, 2.8, 9.0, 7.0),)))
        before = len(self.commands())
        self.play(lambda: len(self.commands()) > before)
        self.receiver.send(Contacts(()))


def started(url: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*CONTROLLER, url], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )


@pytest.fixture(params=["tcp", "pty"])
def ends(request: pytest.FixtureRequest, free_port: int) -> Iterator[tuple[str, str]]:
    """The device's and the host's end of a link."""
    if request.param == "tcp":
        yield f"listen://127.0.0.1:{free_port}", f"socket://127.0.0.1:{free_port}"
        return
    cable = Cable()
    yield cable.ends[0], cable.ends[1]
    cable.close()


def test_an_orb_killed_in_a_game_is_noticed_and_played_on_when_back(ends: tuple[str, str]) -> None:
    with ExitStack() as stack:
        orb = stack.enter_context(started(ends[0]))
        stack.callback(orb.kill)
        table = Table(ends[1])
        stack.callback(table.receiver.close)
        game, view = table.target.game.game, table.target.orb
        assert game is not None
        table.play(lambda: view.ready)
        table.press_left()
        assert table.commands() == ["left"]
        assert game.phase is Phase.RUNNING

        orb.send_signal(signal.SIGKILL)
        table.play(lambda: game.phase is Phase.PAUSED, NOTICE_S)
        orb.wait()

        again = stack.enter_context(started(ends[0]))
        stack.callback(again.kill)
        table.play(lambda: game.phase is Phase.RUNNING)
        assert sum(isinstance(item, Connected) for item in table.heard) == 2
        table.play(lambda: view.ready)
        assert table.commands() == ["left"]  # nothing repeated, nothing invented
        table.press_left()
        assert table.commands() == ["left", "left"]
