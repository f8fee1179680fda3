"""`host --target keyboard` as a process, told what to do by an orb and by its terminal."""

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import SUPPORT

DEVICE = SUPPORT / "fake_device.py"
KEYBOARD = ("--target", "keyboard", "--headless")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGTERM to catch")
def test_the_back_end_print_prints_what_would_be_pressed_until_it_is_ended(
    tmp_path: Path,
) -> None:
    keys = tmp_path / "keys.toml"
    keys.write_text('[profile.a]\nmenu = {arm = true}\ndown = {key = "ctrl+down", mode = "hold"}\n')
    with contextlib.ExitStack() as stack:
        orb = stack.enter_context(started(str(DEVICE), "listen://127.0.0.1:0", "--scripted"))
        assert orb.stdin is not None
        assert orb.stdout is not None
        url = json.loads(orb.stdout.readline())["listening"]
        options = [*KEYBOARD, "--backend=print", "--mapping", str(keys), "--link", url]
        host = stack.enter_context(started("-m", "host", *options))
        assert host.stdout is not None
        orb.stdin.write("hold down\ntap menu\nhold down\n")
        assert [host.stdout.readline() for _ in range(2)] == ["press ctrl\n", "press down\n"]
        host.send_signal(signal.SIGTERM)
        assert host.stdout.read() == "release down\nrelease ctrl\n"
        assert host.wait() == 128 + signal.SIGTERM


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no ptys")
def test_key_of_the_terminal_arms_it_and_the_terminal_is_left_as_it_was(tmp_path: Path) -> None:
    import pty
    import termios

    screen, terminal = pty.openpty()
    before = termios.tcgetattr(terminal)
    program = (
        "import fcntl, runpy, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
        "runpy.run_module('host', run_name='__main__', alter_sys=True)"
    )
    with contextlib.ExitStack() as stack:
        orb = stack.enter_context(started(str(DEVICE), "listen://127.0.0.1:0", "--scripted"))
        assert orb.stdout is not None
        url = json.loads(orb.stdout.readline())["listening"]
        host = subprocess.Popen(
            [sys.executable, "-c", program, *KEYBOARD, "--backend=print", "--link", url],
            stdin=terminal,
            stderr=terminal,
            start_new_session=True,
        )
        seen = b""
        for words, answer in ((b"disarmed; f9 here", b"\x1b[20~"), (b"armed by hand", b"")):
            while words not in seen:
                seen += os.read(screen, 1024)
            os.write(screen, answer)
        while b"\a" not in seen:
            seen += os.read(screen, 1024)
        host.terminate()
        while seen.count(b"\a") < 3:
            seen += os.read(screen, 1024)
        assert host.wait() == 128 + signal.SIGTERM
        assert b"disarmed at the end" in seen
        assert termios.tcgetattr(terminal) == before
    os.close(screen)
    os.close(terminal)


@contextlib.contextmanager
def started(*command: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        bufsize=1,
    ) as process:
        try:
            yield process
        finally:
            process.kill()
