"""Ctrl-C in the first second of `host`: how it ends, and what it prints.

Each start gets SIGINT after .1 to 1 s; every other one is a demo without a window. It must end by
itself within ENDS_S, print nothing of its own but a sentence, and leave no orb behind. A trace of
Python's own start, before it has opened a file of ours, is counted apart.
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.benchmarks.results import Results, command_line, say

ENDS_S = 4.0  # two for the hard end, and as much for a busy machine
HOST = str(Path(sys.executable).with_name("host"))
WAYS = ([HOST], [HOST, "--demo", "--headless", "--seconds", "9"])
PACKAGES = tuple(
    f"{Path(__file__).parents[2] / name}/".encode()
    for name in ("orbtouch", "controller", "host", "models", "tetris")
)
TRACES = (b"Traceback", b"SystemError", b"Exception ignored", b"Fatal Python")


def start(words: list[str], after_s: float, home: str) -> tuple[str, float, bytes]:
    """Return how one start ended, the seconds from the signal to the end, and its messages."""
    environment = {
        **os.environ,
        "HOME": home,
        "SDL_VIDEODRIVER": "dummy",
        "SDL_AUDIODRIVER": "dummy",
    }
    with subprocess.Popen(
        words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        assert process.stderr is not None
        time.sleep(after_s)
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        process.send_signal(signal.SIGINT)
        began_s = time.monotonic()
        try:
            process.wait(ENDS_S)
            outcome = f"status {process.returncode}"
        except subprocess.TimeoutExpired:
            process.kill()
            outcome = "hung"
        took_s = time.monotonic() - began_s
        messages = process.stderr.read()
    if any(trace in messages for trace in TRACES):
        outcome = (
            "trace" if any(name in messages for name in PACKAGES) else "trace of Python's start"
        )
    elif any(_lives(int(child)) for child in children):
        outcome = "orb left behind"
    return outcome, took_s, messages


def _lives(pid: int) -> bool:
    """Return whether a process still runs after a moment."""
    for _ in range(30):
        stat = Path(f"/proc/{pid}/stat")
        if not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] == "Z":
            return False
        time.sleep(0.1)
    return True


def main() -> None:
    """Start, interrupt and count."""
    options = command_line(__doc__, starts=100, seed=1).parse_args()
    # A shell's background ignores it, and its programs with it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    draw, ends, slowest_s = random.Random(options.seed), Counter[str](), 0.0
    with tempfile.TemporaryDirectory() as home:
        for number in range(options.starts):
            after_s = draw.uniform(0.1, 1.0)
            outcome, took_s, messages = start(WAYS[number % 2], after_s, home)
            ends[outcome] += 1
            slowest_s = max(slowest_s, took_s)
            if outcome in ("trace", "hung", "orb left behind"):
                say(f"{outcome} after {after_s:.3f} s: {messages.decode(errors='replace')}")
            if (number + 1) % 50 == 0:
                say(f"{number + 1} of {options.starts}: {dict(ends)}")
    results = Results("interrupts")
    bad = sum(ends[name] for name in ("trace", "hung", "orb left behind"))
    results.note("interrupted_badly", bad, f"of {options.starts}", goal=0)
    results.note("interrupt_to_end_s", round(slowest_s, 2), "s", goal=2)
    for name, count in sorted(ends.items()):
        results.note(f"ended_{name}", count)
    results.finish(options.json)


if __name__ == "__main__":
    main()
