"""The watchdog for tests: it writes to a file, one line each, what it would press.

    python tests/support/recording_watchdog.py FILE [NAME [times]] --backend auto ... -- KEY ...

NAME is the back end that it claims to be: uinput, unless given. With `times` each line ends with
the monotonic clock, microseconds.
"""

import os
import sys
import time
from pathlib import Path
from typing import TextIO

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from host.injection.backends import Backend
from host.injection.watchdog import now_ms, serve


class Paper(Backend):
    """A keyboard that remembers."""

    def __init__(self, file: TextIO, *, times: bool) -> None:
        self._file, self._times = file, times

    def set(self, key: str, *, down: bool) -> None:
        now = f" {time.monotonic_ns() // 1000 & 0xFFFFFFFF}" if self._times else ""
        print(f"{'+' if down else '-'}{key}{now}", file=self._file, flush=True)

    def close(self) -> None:
        print("closed", file=self._file, flush=True)


def main() -> None:
    keys = sys.argv[sys.argv.index("--") + 1 :]
    name = "uinput" if sys.argv[2].startswith("-") else sys.argv[2]
    with Path(sys.argv[1]).open("a") as file:
        print(f"ready {name}", flush=True)
        paper = Paper(file, times=sys.argv[3] == "times")
        serve(paper, keys, lambda: os.read(0, 4096), lambda a: print(a, flush=True), now_ms)


if __name__ == "__main__":
    main()
