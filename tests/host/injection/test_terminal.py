"""Hot keys of a real terminal, which is a pty here."""

import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from host.injection.terminal import keyboard, typed

if sys.platform == "win32":
    pytest.skip("Windows has no ptys", allow_module_level=True)

import pty
import termios

PATIENCE_S = 20.0  # an upper bound; everything here takes milliseconds

# Makes a terminal at the standard input the controlling one, as it is for a login.
PROGRAM = """
import fcntl, signal, sys, termios, time
from host.injection.terminal import keyboard

fcntl.ioctl(0, termios.TIOCSCTTY, 0)
ends = []
signal.signal(signal.SIGINT, lambda *_: ends.append("SIGINT"))
signal.signal(signal.SIGTERM, lambda *_: ends.append("SIGTERM"))
with keyboard() as keys:
    keys()
    print("ready", flush=True)
    while not ends:
        for name in keys():
            if name == "9":
                raise ValueError("as a test")
            print(name, flush=True)
        time.sleep(0.005)
print("ended by", *ends, flush=True)
"""


@pytest.mark.parametrize(
    ("data", "names", "rest"),
    [
        (b"a9", ["a", "9"], b""),
        (b"\x1b[20~\x1b[17;2~", ["f9", "f6"], b""),
        (b"\x1b[A\x1bOPx", ["x"], b""),  # arrows and F1 have no meaning here
        (b"q\x1b[2", ["q"], b"\x1b[2"),
        (b"\x1b", [], b"\x1b"),
        (b"\xc3\xa9 \x7fZ", [], b""),
    ],
)
def test_bytes_are_names_of_keys(data: bytes, names: list[str], rest: bytes) -> None:
    assert typed(data) == (names, rest)


@pytest.mark.parametrize("by", ["Ctrl-C", "SIGTERM", "an exception"])
def test_keys_come_at_once_and_the_terminal_is_left_as_it_was_found(by: str) -> None:
    screen, slave = pty.openpty()
    before = termios.tcgetattr(screen)
    command = [sys.executable, "-c", PROGRAM]
    with subprocess.Popen(
        command, stdin=slave, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        bufsize=0, start_new_session=True,
    ) as child:  # fmt: skip
        assert child.stdout is not None

        def line() -> str:
            assert child.stdout is not None
            assert select.select([child.stdout], [], [], PATIENCE_S)[0], "nothing came"
            return child.stdout.readline().decode().strip()

        assert line() == "ready"
        local = termios.tcgetattr(screen)[3]
        assert not local & (termios.ECHO | termios.ICANON)
        assert local & termios.ISIG
        os.write(screen, b"\x1b[2")
        os.write(screen, b"0~1")
        assert [line(), line()] == ["f9", "1"]
        if by == "SIGTERM":
            child.send_signal(signal.SIGTERM)
        else:
            os.write(screen, b"\x03" if by == "Ctrl-C" else b"9")
        ended = {"Ctrl-C": "ended by SIGINT", "SIGTERM": "ended by SIGTERM"}.get(by, "")
        assert line() == ended
        child.wait(PATIENCE_S)
    assert termios.tcgetattr(screen) == before
    os.close(screen)
    os.close(slave)


def test_where_there_is_no_terminal_there_are_no_keys() -> None:
    with Path(os.devnull).open() as stream, keyboard(stream) as keys:
        assert keys() == []


def test_a_terminal_of_another_program_is_left_alone() -> None:
    master, slave = pty.openpty()  # nobody's controlling terminal
    before = termios.tcgetattr(slave)
    with open(slave, closefd=False) as stream, keyboard(stream) as keys:
        os.write(master, b"1\n")
        assert keys() == []
        assert termios.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)
