"""`host` as a process: how it ends, what it leaves behind, and output that cannot be written."""

import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

END_S = 30.0  # an upper bound; it takes a second
UNSEEN = {**os.environ, "SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy"}
HOST = (sys.executable, "-m", "host")
DEMO = (*HOST, "--demo", "--headless", "--seconds", "1", "--json")

# Presses Ctrl+C when `host` imports the module that is the first argument.
INTERRUPTED = """
import os, runpy, signal, sys

class Finder:
    def find_spec(self, name, path, target=None):
        if name == module:
            os.kill(os.getpid(), signal.SIGINT)

module = sys.argv.pop(1)
sys.meta_path.insert(0, Finder())
runpy.run_module("host", run_name="__main__", alter_sys=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT to send")
@pytest.mark.parametrize(
    "module",
    ["host.cli", "controller.shared.errors", "host.cli.play", "numpy", "pygame", "host.ui.dome"],
)
def test_interrupt_while_modules_are_imported_is_silent(module: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, module, "--headless", "--seconds", "1"],
        env=UNSEEN, capture_output=True, text=True, timeout=END_S,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "")


@pytest.mark.skipif(sys.platform != "linux", reason="looks into Linux's /proc")
@pytest.mark.parametrize(
    ("number", "status"),
    [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGKILL, -9)],
)
def test_no_virtual_orb_outlives_its_host(number: int, status: int, tmp_path: Path) -> None:
    environment = {**UNSEEN, "XDG_CONFIG_HOME": str(tmp_path)}
    with subprocess.Popen(
        [*HOST, "--verbose"], env=environment, stderr=subprocess.PIPE, text=True
    ) as host:
        assert host.stderr is not None
        assert host.stderr.readline().startswith("connected to ")
        tasks = Path(f"/proc/{host.pid}/task").iterdir()
        [orb] = [pid for task in tasks for pid in (task / "children").read_text().split()]
        watch = os.pidfd_open(int(orb))
        host.send_signal(number)
        try:
            assert host.wait(END_S) == status
        finally:
            host.kill()
        assert "Traceback" not in host.stderr.read()
        ended, _, _ = select.select([watch], [], [], END_S)
        os.close(watch)
    assert ended


@pytest.mark.skipif(sys.platform != "linux", reason="no /dev/full")
@pytest.mark.parametrize("command", [DEMO, (*HOST, "find", "--json")])
def test_full_disk_behind_stdout_is_one_sentence(command: tuple[str, ...], tmp_path: Path) -> None:
    environment = {**UNSEEN, "XDG_CONFIG_HOME": str(tmp_path)}
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(
            command, env=environment, stdout=full, stderr=subprocess.PIPE, text=True, timeout=END_S
        )
    assert done.returncode == 1
    assert done.stderr.endswith("host: cannot write the output: no space left on device\n")
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGPIPE to mask")
@pytest.mark.parametrize("command", [DEMO, (*HOST, "find", "--json")])
def test_reader_that_left_ends_it_without_a_word(command: tuple[str, ...], tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            command,
            env={**UNSEEN, "XDG_CONFIG_HOME": str(tmp_path)},
            stdout=writing, stderr=subprocess.PIPE, text=True, timeout=END_S,
        )  # fmt: skip
    finally:
        os.close(writing)
    assert done.returncode == 1
    assert "host: cannot" not in done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
