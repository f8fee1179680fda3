"""Signals that end a program: a flag for its loop, and a hard end for a step that hangs."""

import signal
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no such signals")


def run(body: str) -> tuple[int, str, str]:
    """Run a program in a process; return its status and what it printed."""
    program = (
        f"import os, signal, sys, time\nfrom controller.shared.shutdown import signals\n{body}"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60
    )
    return done.returncode, done.stdout, done.stderr


def test_a_signal_is_a_reason_for_the_loop_and_further_ones_disturb_nothing() -> None:
    body = """
with signals() as shutdown:
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        os.kill(os.getpid(), number)
    print(*shutdown)
sys.exit(shutdown.status)
"""
    assert run(body) == (128 + signal.SIGTERM, "SIGTERM SIGINT SIGHUP\n", "")


@pytest.mark.parametrize("hang", ["time.sleep(50)", "while True: pass"])
def test_a_step_that_hangs_ends_with_the_process_and_releases_what_outlasts_it(hang: str) -> None:
    body = f"""
with signals() as shutdown:
    shutdown.close = lambda: print("every key is up", flush=True)
    os.kill(os.getpid(), signal.SIGTERM)
    {hang}
"""
    assert run(body) == (128 + signal.SIGTERM, "every key is up\n", "")


def test_a_release_that_hangs_too_does_not_keep_the_process() -> None:
    body = """
with signals() as shutdown:
    shutdown.close = lambda: time.sleep(50)
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(50)
"""
    assert run(body) == (130, "", "")


def test_a_loop_that_noticed_the_signal_has_time_for_its_last_file() -> None:
    body = """
import controller.shared.shutdown as module
module.GRACE_S = 0.1
with signals() as shutdown:
    os.kill(os.getpid(), signal.SIGTERM)
    if shutdown:
        time.sleep(0.5)
    print("sealed")
"""
    assert run(body) == (0, "sealed\n", "")


def test_an_end_that_hangs_ends_with_the_process_after_a_while() -> None:
    body = """
import controller.shared.shutdown as module
module.GRACE_S, module.ENDING_S = 0.1, 0.2
with signals() as shutdown:
    os.kill(os.getpid(), signal.SIGTERM)
    if shutdown:
        time.sleep(50)
"""
    assert run(body) == (128 + signal.SIGTERM, "", "")


def test_a_signal_that_is_ignored_stays_so() -> None:
    body = """
signal.signal(signal.SIGHUP, signal.SIG_IGN)
with signals() as shutdown:
    os.kill(os.getpid(), signal.SIGHUP)
    print(*shutdown)
"""
    assert run(body) == (0, "\n", "")
