"""The keyboard of a real terminal, which is a pty here."""

import os
import select
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing

import pytest

if sys.platform == "win32":
    pytest.skip("Windows has no ptys", allow_module_level=True)

import pty
import termios

from controller.keymap.terminal import keyboard
from controller.keymap.terminal_decoder import DISABLE, ENABLE, QUERY

SPEAKS_KITTY = b"\x1b[?0u"
ANSWERED = b"\x1b[?62c"
PATIENCE_S = 20.0  # an upper bound; everything here takes milliseconds

# Makes a terminal at the standard input the controlling one, as it is for a login.
OURS = """
import fcntl, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
"""

# Prints a line when it is ready, one for every stroke, and one when it ends.
PROGRAM = """
import signal, sys, time
from controller.keymap.terminal import keyboard

ends = []
signal.signal(signal.SIGINT, lambda *_: ends.append("SIGINT"))
signal.signal(signal.SIGTERM, lambda *_: ends.append("SIGTERM"))
with keyboard() as keys:
    print("ready" if keys else "no keyboard", flush=True)
    while keys and not ends:
        for ago_s, told in keys.poll():
            name = getattr(told, "key", "") or told.name
            if name == "9":
                raise ValueError("as a test")
            print(name, getattr(getattr(told, "action", None), "name", ""), flush=True)
        time.sleep(0.005)
print("ended by", *ends, flush=True)
"""

# What a shell does for a program: it runs in the foreground, stops, and is brought back by "fg".
SHELL = f"""
import os, signal, sys

signal.signal(signal.SIGTTOU, signal.SIG_IGN)
if not (pid := os.fork()):
    os.setpgid(0, 0)
    os.tcsetpgrp(0, os.getpid())
    signal.signal(signal.SIGTTOU, signal.SIG_DFL)
    os.execv(sys.executable, [sys.executable, "-c", {PROGRAM!r}])
os.waitpid(pid, os.WUNTRACED)
os.tcsetpgrp(0, os.getpid())
print("stopped", flush=True)
assert sys.stdin.readline() == "fg\\n"
os.tcsetpgrp(0, pid)
os.killpg(pid, signal.SIGCONT)
os.waitpid(pid, 0)
"""


class Terminal:
    """A person at a terminal in which the program runs, results piped elsewhere."""

    def __init__(self, program: str = PROGRAM, term: str = "xterm") -> None:
        self.seen = b""  # of what was written to it, and not looked for yet
        self.screen, slave = pty.openpty()
        self.before = termios.tcgetattr(self.screen)
        self.child = subprocess.Popen(
            [sys.executable, "-c", OURS + program],
            stdin=slave,
            stdout=subprocess.PIPE,
            stderr=slave,
            bufsize=0,
            env={**os.environ, "TERM": term},
            start_new_session=True,
        )
        assert self.child.stdout is not None
        self.results = self.child.stdout.fileno()
        self.pid = self.child.pid
        self._slave = slave  # kept open, so that the screen outlives the program

    def line(self) -> str:
        """Wait for the program's next line."""
        line = b""
        while not line.endswith(b"\n"):
            line += self._read(self.results, 1)
        return line.decode().strip()

    def sees(self, wanted: bytes) -> None:
        """Wait until the program has written something to the terminal."""
        while wanted not in self.seen:
            self.seen += self._read(self.screen)
        self.seen = self.seen.partition(wanted)[2]

    def types(self, data: bytes) -> None:
        os.write(self.screen, data)

    def wait(self) -> None:
        """Wait until the program has ended."""
        self.child.wait(PATIENCE_S)

    def attributes(self) -> list[object]:
        return termios.tcgetattr(self.screen)

    def close(self) -> None:
        self.child.kill()
        self.child.communicate()
        os.close(self.screen)
        os.close(self._slave)

    def _read(self, handle: int, size: int = 1024) -> bytes:
        ready, _, _ = select.select([handle], [], [], PATIENCE_S)
        assert ready, "nothing came"
        data = os.read(handle, size)
        assert data, "it ended"
        return data


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    with closing(Terminal()) as made:
        yield made


@pytest.fixture
def kitty(terminal: Terminal) -> Terminal:
    """A terminal that speaks kitty's protocol."""
    assert terminal.line() == "ready"
    terminal.sees(QUERY)
    terminal.types(SPEAKS_KITTY + ANSWERED)
    terminal.sees(ENABLE)
    return terminal


@pytest.fixture
def plain(terminal: Terminal) -> Terminal:
    """A terminal that sends characters only."""
    assert terminal.line() == "ready"
    terminal.sees(QUERY)
    terminal.types(ANSWERED)
    return terminal


def test_keys_come_at_once_and_are_not_shown(plain: Terminal) -> None:
    plain.types(b"1 ")
    assert [plain.line(), plain.line()] == ["1 TYPED", "TYPED"]  # the second one is the space
    local = plain.attributes()[3]
    assert isinstance(local, int)
    assert not local & (termios.ECHO | termios.ICANON)
    assert local & termios.ISIG


@pytest.mark.parametrize("by", ["Ctrl-C", "SIGTERM", "an exception"])
def test_the_terminal_is_left_as_it_was_found(plain: Terminal, by: str) -> None:
    match by:
        case "Ctrl-C":
            plain.types(b"\x03")
            assert plain.line() == "ended by SIGINT"
        case "SIGTERM":
            os.kill(plain.pid, signal.SIGTERM)
            assert plain.line() == "ended by SIGTERM"
        case "an exception":
            plain.types(b"9")
    plain.wait()
    assert plain.attributes() == plain.before


def test_a_terminal_that_can_tell_releases_is_asked_to(kitty: Terminal) -> None:
    kitty.types(b"\x1b[49;1:1u\x1b[49;1:3u")
    assert [kitty.line(), kitty.line()] == ["1 PRESSED", "1 RELEASED"]
    os.kill(kitty.pid, signal.SIGTERM)
    kitty.sees(DISABLE)
    kitty.wait()
    assert kitty.attributes() == kitty.before


def test_a_terminal_that_never_answers_delays_only_the_end(terminal: Terminal) -> None:
    assert terminal.line() == "ready"
    terminal.types(b"1")
    assert terminal.line() == "1 TYPED"
    os.kill(terminal.pid, signal.SIGTERM)
    assert terminal.line() == "ended by SIGTERM"
    terminal.wait()


def test_an_answer_that_comes_late_does_not_stand_at_the_prompt(terminal: Terminal) -> None:
    assert terminal.line() == "ready"
    terminal.sees(QUERY)
    os.kill(terminal.pid, signal.SIGTERM)
    terminal.types(SPEAKS_KITTY + ANSWERED)
    terminal.sees(DISABLE)
    terminal.wait()
    assert terminal.attributes() == terminal.before


@pytest.mark.parametrize("answers", [SPEAKS_KITTY + ANSWERED, ANSWERED])
def test_ctrl_z_gives_the_terminal_back_until_the_program_goes_on(answers: bytes) -> None:
    with closing(Terminal(SHELL)) as terminal:
        assert terminal.line() == "ready"
        terminal.sees(QUERY)
        terminal.types(answers)
        kitty = answers.startswith(SPEAKS_KITTY)
        if kitty:
            terminal.sees(ENABLE)
        terminal.types(b"\x1b[122;5u" if kitty else b"\x1a")
        if kitty:
            terminal.sees(DISABLE)
        assert terminal.line() == "stopped"
        assert terminal.attributes() == terminal.before
        terminal.types(b"fg\n")
        terminal.sees(QUERY)
        terminal.types(answers + b"2")
        while (line := terminal.line()) == "AWAY":  # keys that were held are let go of
            pass
        assert line == "2 TYPED"
        terminal.types(b"\x03")
        assert terminal.line() == "ended by SIGINT"
        terminal.wait()
        assert terminal.attributes() == terminal.before


def test_a_dumb_terminal_is_asked_nothing() -> None:
    with closing(Terminal(term="dumb")) as terminal:
        assert terminal.line() == "ready"
        assert not select.select([terminal.screen], [], [], 0.0)[0]
        os.kill(terminal.pid, signal.SIGTERM)
        assert terminal.line() == "ended by SIGTERM"
        terminal.wait()


def test_where_there_is_no_terminal_there_are_no_keys() -> None:
    command = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=60)
    assert done.stdout.startswith(b"no keyboard")


def test_a_terminal_of_somebody_else_is_left_alone() -> None:
    master, slave = pty.openpty()  # nobody's controlling terminal
    before = termios.tcgetattr(slave)
    with open(slave, closefd=False) as stream, keyboard(stream) as keys:
        assert keys is None
        assert termios.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)
