"""The watchdog of the ledger: it writes down what it would press, and when, in microseconds."""

import os
import sys
import time
from pathlib import Path
from typing import TextIO

from host.injection.backends import Backend
from host.injection.watchdog import now_ms, serve


class Paper(Backend):
    """A keyboard that remembers."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def set(self, key: str, *, down: bool) -> None:
        us = time.monotonic_ns() // 1000 & 0xFFFFFFFF
        print("+" if down else "-", us, file=self._file, flush=True)


def main() -> None:
    """Serve, on paper."""
    keys = sys.argv[sys.argv.index("--") + 1 :]
    with Path(sys.argv[1]).open("a") as file:
        print("ready uinput", flush=True)
        serve(Paper(file), keys, lambda: os.read(0, 4096), lambda a: print(a, flush=True), now_ms)


if __name__ == "__main__":
    main()
