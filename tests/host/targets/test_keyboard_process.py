"""`host --target keyboard` as a process, told what to do by an orb."""

import contextlib
import json
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


def test_a_mapping_that_cannot_be_armed_is_refused(tmp_path: Path) -> None:
    keys = tmp_path / "keys.toml"
    keys.write_text('[profile.a]\ndown = "down"\n')
    host = [sys.executable, "-m", "host", *KEYBOARD, "--mapping", str(keys)]
    done = subprocess.run(host, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "no command of" in done.stderr
    assert "menu = { arm = true }" in done.stderr


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
