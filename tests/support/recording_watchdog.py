"""The watchdog for tests: it writes to a file, one line each, what it would press.

    python tests/support/recording_watchdog.py FILE [NAME] --backend auto ... -- KEY ...

NAME is the back end that it claims to be: uinput, unless given.
"""

import os
import sys
from pathlib import Path
from typing import TextIO

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from host.injection.backends import Backend
from host.injection.watchdog import now_ms, serve


class Paper(Backend):
    """A keyboard that remembers."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def set(self, key: str, *, down: bool) -> None:
        print(f"{'+' if down else '-'}{key}", file=self._file, flush=True)

    def close(self) -> None:
        print("closed", file=self._file, flush=True)


def main() -> None:
    keys = sys.argv[sys.argv.index("--") + 1 :]
    name = "uinput" if sys.argv[2].startswith("-") else sys.argv[2]
    with Path(sys.argv[1]).open("a") as file:
        print(f"ready {name}", flush=True)
        serve(Paper(file), keys, lambda: os.read(0, 4096), lambda a: print(a, flush=True), now_ms)


if __name__ == "__main__":
    main()
