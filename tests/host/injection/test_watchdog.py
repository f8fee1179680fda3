"""The watchdog: by itself on a clock of our own, and as a process that is killed, or left alone."""

import queue
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.shared.keymap.key_state import Stroke
from host.injection import watchdog
from host.injection.backends import Backend, BackendError
from host.injection.injector import MUTE_MS, Injector, PrintingSender
from host.injection.watchdog import HANG_MS, Watchdog
from tests.support import SUPPORT
from tests.support.waiting import stop_child, until

PAPER = (sys.executable, str(SUPPORT / "recording_watchdog.py"))


class Recorder(Backend):
    """A keyboard that remembers what was done to it."""

    def __init__(self) -> None:
        self.done: list[str] = []
        self.down: set[str] = set()
        self.broken = ""

    def set(self, key: str, *, down: bool) -> None:
        if key == self.broken and not down:
            raise OSError("as a test")
        (self.down.add if down else self.down.discard)(key)
        self.done.append(f"{'+' if down else '-'}{key}")

    def close(self) -> None:
        self.done.append("closed")


def guard(keys: str = "a b") -> tuple[Watchdog, Recorder]:
    board = Recorder()
    return Watchdog(board, keys.split(), 0), board


def test_guard_does_what_it_is_told() -> None:
    watch, board = guard()
    for line in ("d 10 a", "d 20 b", "u 30 a"):
        assert watch.line(line, 30) == ""
    assert board.done == ["+a", "+b", "-a"]
    assert watch.line("b 40", 40) == "b 40"


def test_guard_presses_nothing_that_it_was_not_given() -> None:
    watch, board = guard()
    for line in ("d 10 meta", "d 10", "d 10 a b", "d x a", "press a", "", "d -1 a", "\0" * 50):
        watch.line(line, 10)
    assert board.done == []


def test_guard_lifts_everything_when_its_sender_hangs() -> None:
    watch, board = guard()
    watch.line("d 0 a", 0)
    watch.line("d 5 b", 5)
    assert watch.wait_s(5) == HANG_MS / 1000
    assert watch.tick(304) == ""
    assert watch.tick(305) == "released the program hung for 300 ms"
    assert board.done == ["+a", "+b", "-b", "-a"]
    watch, board = guard()
    watch.line("d 0 a", 0)
    assert watch.line("a stranger's line", 300) == "released the program hung for 300 ms"


def test_guard_presses_nothing_more_until_the_sender_knows() -> None:
    watch, board = guard()
    watch.line("d 0 a", 0)
    watch.tick(300)
    watch.line("d 400 b", 400)
    assert board.down == set()
    watch.line("c 500", 500)
    watch.line("d 510 b", 510)
    assert board.down == {"b"}


def test_signs_of_life_keep_a_key_down() -> None:
    watch, board = guard()
    watch.line("d 0 a", 0)
    for time_ms in range(100, 5000, 100):
        assert watch.line(f"b {time_ms}", time_ms) == f"b {time_ms}"
    assert board.down == {"a"}


def test_press_that_waited_in_the_pipe_is_too_late() -> None:
    watch, board = guard()
    watch.line("d 100 a", 400)
    assert board.done == []


def test_guard_waits_for_nobody_while_nothing_is_down() -> None:
    watch, _ = guard()
    assert watch.tick(10_000) == ""
    assert watch.wait_s(10_000) == 60.0
    assert watch.wait_s(10_000) > 1.0


def test_key_that_cannot_be_lifted_does_not_keep_the_others_down() -> None:
    watch, board = guard()
    watch.line("d 0 a", 0)
    watch.line("d 0 b", 0)
    board.broken = "b"
    with pytest.raises(OSError, match="as a test"):
        watch.release()
    assert board.down == {"b"} == set(watch.down)
    assert board.done[-1] == "-a"
    board.broken = ""
    watch.release()
    assert board.down == set()


@given(
    st.lists(
        st.tuples(
            st.sampled_from(("d", "u", "b", "c", "noise")),
            st.sampled_from(("a", "b", "meta")),
            st.integers(0, 400),
            st.integers(0, 400),
        )
    )
)
def test_nothing_sent_outlives_the_last_word(lines: list[tuple[str, str, int, int]]) -> None:
    watch, board = guard()
    now_ms = heard_ms = 0
    for what, key, passed_ms, late_ms in lines:
        now_ms += passed_ms
        watch.tick(now_ms)
        assert not board.down or now_ms - heard_ms < HANG_MS
        sent_ms = max(now_ms - late_ms, 0)
        watch.line(f"{what} {sent_ms} {key}", now_ms)
        heard_ms = max(heard_ms, sent_ms) if what != "noise" else heard_ms
        assert board.down <= {"a", "b"}
        assert board.down == set(watch.down)
    watch.tick(now_ms + HANG_MS)
    assert not board.down


# --- as a process ---------------------------------------------------------------------------------


@pytest.fixture
def paper(tmp_path: Path) -> Path:
    return tmp_path / "paper"


@pytest.fixture
def injector(paper: Path) -> Iterator[Injector]:
    made = Injector("auto", "keyboard", ["a", "b"], command=(*PAPER, str(paper)))
    yield made
    made.close()


def test_strokes_come_in_order_and_the_end_lifts_them(injector: Injector, paper: Path) -> None:
    assert injector.start() == "uinput"
    injector.send([Stroke("a", True), Stroke("b", True), Stroke("a", False)])
    injector.close()
    assert paper.read_text().split() == ["+a", "+b", "-a", "-b", "closed"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGSTOP")
def test_watchdog_that_does_not_answer_is_ended(paper: Path) -> None:
    now = [0]
    command = (*PAPER, str(paper))
    injector = Injector("auto", "keyboard", ["a"], command=command, clock=lambda: now[0])
    injector.start()
    process = injector.process
    assert process is not None
    stop_child(process.pid)
    for now[0] in range(0, 50 + MUTE_MS, 10):
        assert injector.check() == ""
    now[0] = 50 + MUTE_MS
    assert injector.check() == "with every key up: the watchdog has hung"
    assert process.poll() is not None


def test_watchdog_has_not_hung_because_its_sender_stood_still(paper: Path) -> None:
    now = [50]
    command = (*PAPER, str(paper))
    injector = Injector("auto", "keyboard", ["a"], command=command, clock=lambda: now[0])
    injector.start()
    now[0] += 50
    injector._answers = queue.SimpleQueue()  # the answer has not been read yet
    assert injector.check() == ""
    now[0] += 10_000
    assert injector.check() == ""
    injector.close()


def test_program_that_starts_no_watchdog_is_told_why() -> None:
    command = (sys.executable, "-c", "print('failed there is no keyboard')")
    with pytest.raises(BackendError, match=r"^there is no keyboard$"):
        Injector("auto", "keyboard", ["a"], command=command).start()
    command = (sys.executable, "-c", "")
    with pytest.raises(BackendError, match="does not start"):
        Injector("auto", "keyboard", ["a"], command=command).start()


def test_a_sender_that_prints_is_named_once() -> None:
    printed: list[str] = []
    sender = PrintingSender(printed.append)
    assert [sender.start(), sender.start()] == ["print", ""]
    sender.send([Stroke("a", True), Stroke("a", False)])
    assert printed == ["press a", "release a"]


SENDER = """
import sys, time
from host.injection.injector import Injector
from controller.shared.keymap.key_state import Stroke
injector = Injector("auto", "keyboard", ["a"], command=sys.argv[1:])
injector.start()
injector.send([Stroke("a", True)])
print("down", flush=True)
while not injector.check():
    time.sleep(0.01)
"""


def test_killed_sender_leaves_no_key_down(paper: Path) -> None:
    sender = subprocess.Popen(
        [sys.executable, "-c", SENDER, *PAPER, str(paper)], stdout=subprocess.PIPE
    )
    assert sender.stdout is not None
    assert sender.stdout.readline().strip() == b"down"
    until(lambda: paper.read_text() == "+a\n")
    sender.kill()
    sender.communicate()
    until(lambda: paper.read_text().split() == ["+a", "-a", "closed"])


@pytest.mark.parametrize(
    ("where", "error", "status", "said"),
    [
        ("open_backend", BackendError("no keyboard here"), 1, "failed no keyboard here\n"),
        ("serve", OSError("a key is stuck"), 1, "ready paper\nfailed a key is stuck\n"),
        ("serve", BrokenPipeError(), 0, "ready paper\n"),
        ("serve", None, 0, "ready paper\n"),  # its input has ended
    ],
)
def test_the_program_says_how_it_began_and_why_it_ends(
    where: str, error: Exception | None, status: int, said: str,
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    def fail(*_: object) -> None:
        if error is not None:
            raise error

    monkeypatch.setattr(watchdog, "open_backend", lambda *_: ("paper", Recorder()))
    monkeypatch.setattr(watchdog, where, fail)
    assert watchdog.main(["a"]) == status
    assert capfd.readouterr().out == said
    assert watchdog.now_ms() == pytest.approx(time.monotonic() * 1000, abs=1000)
