"""A player without hardware teaches a swipe with the mouse, over a real link to a virtual orb."""

import random
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from controller.cli import install
from controller.shared.protocol.messages import Telemetry
from controller.shared.protocol.teaching import (
    DONE,
    GestureInfo,
    Learn,
    SetCommand,
    SetStrength,
    Undo,
    UserInfo,
    Vocabulary,
)
from host.app.lessons import Lessons, Trial
from host.connection.receiver import Connected, Delivered, Lost, Receiver, Stale
from host.connection.virtual_orb import VirtualOrbProcess
from host.ui.pointer_input import PointerInput
from tests.support import user_bundles

PATIENCE_S = 120.0
AFTER_S = 1.0  # between two swipes
RATE_HZ = 10.0
SWIPE = Learn("swipe", "hold", "none", False, "")


class Player:
    """A host with a mouse, without a window."""

    def __init__(self) -> None:
        self.orb = VirtualOrbProcess(3, ("--rate", f"{RATE_HZ:g}"))
        self.receiver = Receiver(self.orb.open, token=self.orb.token)
        self.lessons, self.pointer = Lessons(self.receiver.send, first=100), PointerInput()
        self.trial = Trial("swipe")
        self.interrupted: list[Lost | Stale] = []
        self.labels: tuple[str, ...] = ()
        self.infos: dict[str, GestureInfo] = {}
        self.ready = False
        self.rng = random.Random(1)
        self.receiver.connect()

    def turn(self) -> None:
        now_s = time.monotonic()
        contacts = self.pointer.update(now_s)
        if contacts:
            self.receiver.send(contacts)
        self.receiver.wait(0.01)
        for item in self.receiver.poll():
            if isinstance(item, Connected):
                self.lessons.connected()
                self.infos.clear()
                self.labels = item.welcome.labels
            elif isinstance(item, Lost | Stale):
                self.interrupted.append(item)
            elif isinstance(item, Delivered):
                self.lessons.take(item.message)
                self.trial.take(item.message, now_s)
                if isinstance(item.message, Vocabulary):
                    self.labels = item.message.labels
                if isinstance(item.message, GestureInfo):
                    self.infos[item.message.label] = item.message
                if isinstance(item.message, Telemetry):
                    self.ready = item.message.ready
                    assert len(item.message.probabilities) == len(self.labels)

    def wait(self, condition: Callable[[], object]) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            self.turn()
            assert time.monotonic() < end_s, "it did not come true"

    def rest(self, seconds: float) -> None:
        end_s = time.monotonic() + seconds
        self.wait(lambda: time.monotonic() >= end_s)

    def swipe(self) -> None:
        """Drag one finger from left to right in about 0.6 s."""
        y, seconds = 2.0 + self.rng.uniform(-0.3, 0.3), 0.6 * self.rng.uniform(0.9, 1.1)
        start_s = time.monotonic()
        self.pointer.press(0.2, y, start_s)
        self.trial.touch(True, start_s)
        while (passed_s := time.monotonic() - start_s) < seconds:
            self.pointer.move(0.2 + 3.6 * passed_s / seconds, y)
            self.turn()
        self.pointer.release()
        self.trial.touch(False, time.monotonic())

    def example(self) -> None:
        number = self.lessons.begin_example("swipe")
        self.turn()
        self.swipe()
        self.lessons.end_example()
        self.wait(lambda: number in self.lessons.examples)
        assert self.lessons.examples[number].felt
        self.rest(0.3)

    def outcome(self) -> int:
        self.wait(lambda: not self.lessons.busy)
        assert self.lessons.status is not None
        return self.lessons.status.state


@pytest.fixture
def player(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Player]:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    player = Player()
    player.wait(lambda: player.ready and len(player.infos) == 4)
    try:
        yield player
    finally:
        player.receiver.close()
        player.orb.close()


@pytest.mark.slow
def test_a_swipe_is_taught_understood_and_undone(player: Player) -> None:
    for _ in range(5):
        player.example()
    player.lessons.change(SWIPE)
    assert player.outcome() == DONE
    assert player.labels[-1] == "swipe"
    player.trial = Trial("swipe")
    for _ in range(5):
        player.swipe()
        player.rest(AFTER_S)
    assert len(player.trial.heard) == 5
    assert player.trial.count("swipe")[0] >= 4
    player.lessons.change(Undo())
    assert player.outcome() == DONE
    assert "swipe" not in player.labels
    assert player.interrupted == []


@pytest.mark.slow
def test_a_killed_orb_has_all_examples_and_the_old_bundle_or_the_new_one(player: Player) -> None:
    for _ in range(2):
        player.example()
    player.lessons.change(SWIPE)
    player.turn()
    assert player.orb.process is not None
    player.orb.process.kill()
    player.wait(lambda: player.interrupted)
    player.wait(lambda: player.lessons.vocabulary is None)
    player.wait(lambda: len(player.lessons.of("swipe")) == 2)  # it has started again
    player.lessons.change(SWIPE)
    assert player.outcome() == DONE
    player.orb.process.kill()
    player.wait(lambda: player.lessons.vocabulary is None)
    player.wait(lambda: "swipe" in player.infos)
    assert player.infos["swipe"].examples == 2


@pytest.mark.slow
def test_a_users_command_is_set_and_undone_without_losing_the_link(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    file = user_bundles.write(tmp_path / "family.orb")
    assert install.main([str(file)]) == 0
    player = Player()
    try:
        player.wait(lambda: player.ready and set(player.lessons.users) == {"ann", "bob"})
        assert player.lessons.users["bob"] == UserInfo("bob", ("pinch",), ("hold",))
        player.lessons.change(SetCommand("press", "", "ann"))
        assert player.outcome() == DONE
        assert player.lessons.users["ann"] == UserInfo("ann", ("press",), ("none",))
        player.lessons.change(SetCommand("", "", "bob"))
        assert player.outcome() == DONE
        assert player.lessons.users["bob"] == UserInfo("bob", (), ())
        player.lessons.change(Undo())
        assert player.outcome() == DONE
        assert player.lessons.users["bob"] == UserInfo("bob", ("pinch",), ("hold",))
        player.lessons.change(SetStrength(0.4, "ann"))
        assert player.outcome() == DONE
        assert player.interrupted == []
        assert player.orb.process is not None
        player.orb.process.kill()
        player.wait(lambda: player.lessons.vocabulary is None)
        player.wait(lambda: "ann" in player.lessons.strengths)  # it has started again
        assert [player.lessons.strength(one) for one in ("", "ann", "bob")] == [
            1.0,
            pytest.approx(0.4),
            1.0,
        ]
    finally:
        player.receiver.close()
        player.orb.close()
