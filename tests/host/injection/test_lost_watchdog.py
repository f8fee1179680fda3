"""A watchdog that is stopped, killed or ended while a key may be down: the key goes up.

The back ends are recorded on paper. On X11, Windows and macOS keys outlive the process that pressed
them, so the sender has a second handle; all three take the same path.
"""

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from controller.shared.keymap.key_state import Stroke
from host.injection import injector as injector_module
from host.injection.backends import Backend, BackendError
from host.injection.injector import Injector
from tests.support import SUPPORT
from tests.support.pytest_types import Patch
from tests.support.waiting import stop_child, until

if sys.platform == "win32":
    pytest.skip("Windows has no SIGSTOP", allow_module_level=True)

PAPER = (sys.executable, str(SUPPORT / "recording_watchdog.py"))
DOWN, UP = Stroke("left", True), Stroke("left", False)


class Board(Backend):
    """A keyboard on paper, written by the watchdog and by the sender's second handle."""

    def __init__(self, paper: Path) -> None:
        self.paper = paper
        self.broken = False  # whether releases through the second handle fail
        self.opened = 0  # second handles

    @property
    def down(self) -> set[str]:
        marks = [line for line in self.paper.read_text().split() if line[0] in "+-"]
        last = {mark[1:]: mark[0] for mark in marks}
        return {key for key, mark in last.items() if mark == "+"}

    def set(self, key: str, *, down: bool) -> None:
        assert not down, "the second handle presses nothing"
        if self.broken:
            raise BackendError("as a test")
        with self.paper.open("a") as file:
            print(f"-{key}", file=file)


@pytest.fixture
def board(tmp_path: Path, monkeypatch: Patch) -> Board:
    made = Board(tmp_path / "paper")

    def open_backend(name: str, kind: str) -> tuple[str, Backend]:
        made.opened += 1
        return name, made

    monkeypatch.setattr(injector_module, "open_backend", open_backend)
    return made


@pytest.fixture(params=["x11", "windows", "macos"])
def injector(request: pytest.FixtureRequest, board: Board) -> Iterator[Injector]:
    command = (*PAPER, str(board.paper), request.param)
    made = Injector("auto", "keyboard", ["left", "shift"], command=command)
    assert made.start() == request.param
    yield made
    made.close()


def press(injector: Injector, board: Board) -> int:
    """Press a key, for certain; return the watchdog's process id."""
    injector.send([DOWN])
    until(lambda: board.down == {"left"})
    assert injector.process is not None
    return injector.process.pid


def test_key_goes_up_that_a_hung_watchdog_never_released(injector: Injector, board: Board) -> None:
    stop_child(press(injector, board))
    injector.send([UP])
    assert until(injector.check) == "with every key up: the watchdog has hung"
    assert board.down == set()


@pytest.mark.parametrize("ended_by", ["SIGKILL", "SIGTERM", "SIGHUP", "SIGINT"])
def test_key_goes_up_as_the_watchdog_ends(ended_by: str, injector: Injector, board: Board) -> None:
    os.kill(press(injector, board), getattr(signal, ended_by))
    assert until(injector.check) == "with every key up: the watchdog has died"
    assert board.down == set()
    injector.send([DOWN])
    assert injector.check() == ""
    assert board.down == set()


@pytest.mark.parametrize("released", [False, True])
@pytest.mark.parametrize("struck_by", ["SIGSTOP", "SIGKILL"])
def test_key_goes_up_when_the_program_ends_before_it_has_noticed(
    struck_by: str, released: bool, injector: Injector, board: Board
) -> None:
    pid = press(injector, board)
    stop_child(pid)
    injector.send([UP] if released else [])
    os.kill(pid, getattr(signal, struck_by))
    injector.close()
    assert board.down == set()


def test_key_goes_up_whose_press_may_not_have_been_made(injector: Injector, board: Board) -> None:
    assert injector.process is not None
    stop_child(injector.process.pid)
    injector.send([Stroke("shift", True), DOWN])
    os.kill(injector.process.pid, signal.SIGKILL)
    until(injector.check)
    assert board.paper.read_text().split() == ["-left", "-shift"]


def test_key_is_not_released_again_once_acknowledged(injector: Injector, board: Board) -> None:
    pid = press(injector, board)
    injector.send([UP, Stroke("shift", True)])
    until(lambda: injector.check() or list(injector._down) == ["shift"])
    os.kill(pid, signal.SIGKILL)
    until(injector.check)
    assert board.paper.read_text().split() == ["+left", "-left", "+shift", "-shift"]


def test_answer_to_an_earlier_heartbeat_acknowledges_nothing(tmp_path: Path) -> None:
    now = [0]
    command = (*PAPER, str(tmp_path / "paper"))
    injector = Injector("auto", "keyboard", ["left"], command=command, clock=lambda: now[0])
    injector.start()
    now[0] = 50
    assert injector.check() == ""  # a heartbeat of the same millisecond as the strokes
    injector.send([DOWN, UP, DOWN, UP])
    until(lambda: injector.check() or injector._pending_ms is None)
    assert "left" in injector._down
    now[0] = 100
    until(lambda: injector.check() or not injector._down)
    injector.close()


def test_stuck_key_is_named_and_tried_by_a_new_handle(injector: Injector, board: Board) -> None:
    board.broken = True
    os.kill(press(injector, board), signal.SIGKILL)
    assert until(injector.check) == (
        "with left perhaps down, press it once on your own keyboard: the watchdog has died"
    )
    assert board.down == {"left"}
    assert board.opened >= 2
    board.broken = False
    until(lambda: injector.check() or not board.down)


def test_no_watchdog_starts_while_a_key_may_be_down(injector: Injector, board: Board) -> None:
    board.broken = True
    os.kill(press(injector, board), signal.SIGKILL)
    until(injector.check)
    with pytest.raises(BackendError, match="left may still be down; press it once on your own"):
        injector.start()
    board.broken = False
    injector.start()
    assert board.down == set()


def test_program_that_ends_with_a_key_down_says_so(injector: Injector, board: Board) -> None:
    board.broken = True
    os.kill(press(injector, board), signal.SIGKILL)
    injector.close()
    assert injector._trouble.startswith("with left perhaps down")


def test_release_cut_short_is_redone(injector: Injector, board: Board, monkeypatch: Patch) -> None:
    def interrupted() -> None:
        raise SystemExit

    os.kill(press(injector, board), signal.SIGKILL)
    with monkeypatch.context() as patch:
        patch.setattr(injector, "_release_spare", interrupted)
        with pytest.raises(SystemExit):
            until(injector.check)
    assert board.down == {"left"}
    injector.send([UP])
    injector.close()
    assert board.down == set()


def test_full_pipe_of_a_hung_watchdog_does_not_block(injector: Injector, board: Board) -> None:
    assert injector.process is not None
    stop_child(injector.process.pid)
    injector.send([DOWN, UP] * 5000)
    assert injector.check() == "with every key up: the watchdog has hung"


def test_watchdog_that_wakes_in_time_makes_no_late_press(injector: Injector, board: Board) -> None:
    now = [time.monotonic_ns() // 1_000_000]
    injector._clock = lambda: now[0]
    assert injector.process is not None
    stop_child(injector.process.pid)
    now[0] -= 300
    injector.send([DOWN])  # as old as if it had waited in the pipe
    now[0] += 300
    os.kill(injector.process.pid, signal.SIGCONT)
    injector.check()
    until(lambda: injector.check() or injector._pending_ms is None)
    assert board.paper.read_text() == ""
