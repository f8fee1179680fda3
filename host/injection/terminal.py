"""Hot keys typed into the program's terminal: letters, digits and F6 to F12; `poll` never waits.

The terminal's state is restored when the program ends; after SIGKILL and SIGQUIT, type `reset`.
"""

import contextlib
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, TextIO

_CHUNK: Final = 1024
# CSI NUMBER ~, as nearly every terminal sends function keys.
_FUNCTION_KEYS: Final = {17: "f6", 18: "f7", 19: "f8", 20: "f9", 21: "f10", 23: "f11", 24: "f12"}
_KEY: Final = re.compile(rb"\x1b\[(\d+)(?:;\d+)?~|\x1b\[[0-?]*[ -/]*[@-~]|\x1bO.|([0-9a-z])")
_UNFINISHED: Final = re.compile(rb"\x1b(?:O|\[[0-?]{0,60}[ -/]*)?\Z")

Poll = Callable[[], list[str]]  # names of the keys typed since the last call


def typed(data: bytes) -> tuple[list[str], bytes]:
    """Return the names of the keys in a terminal's bytes, and a sequence that is not complete."""
    unfinished = _UNFINISHED.search(data)
    rest = unfinished[0] if unfinished else b""
    found = _KEY.finditer(data[: len(data) - len(rest)])
    names = (_FUNCTION_KEYS.get(int(m[1])) if m[1] else (m[2] or b"").decode() for m in found)
    return [name for name in names if name], rest


@contextmanager
def keyboard(stream: TextIO | None = None) -> Iterator[Poll]:
    """Read the keys of a terminal, by default standard input, during the context.

    Without a terminal, and in the background, no key is ever typed.
    """
    stream = sys.stdin if stream is None else stream
    if stream is None or not stream.isatty():
        yield list
    elif sys.platform == "win32":
        yield _windows_keys
    else:
        keys = _PosixKeys(stream.fileno())
        try:
            yield keys.poll
        finally:
            keys.close()


if sys.platform == "win32":
    import msvcrt

    _SCAN_CODES: Final = dict(
        zip(b"@ABCD\x85\x86", ("f6", "f7", "f8", "f9", "f10", "f11", "f12"), strict=True)
    )

    def _windows_keys() -> list[str]:
        """Return the keys typed into the console. Never run on Windows."""
        names = []
        while msvcrt.kbhit():
            char = msvcrt.getch()
            if char in (b"\0", b"\xe0"):
                names.append(_SCAN_CODES.get(msvcrt.getch()[0], ""))
            else:
                names += typed(char)[0]
        return [name for name in names if name]

else:
    import select
    import termios

    class _PosixKeys:
        """The keys of a terminal, which sends them at once and does not show them."""

        def __init__(self, handle: int) -> None:
            self._handle = handle
            self._before = termios.tcgetattr(handle)
            self._changed = False
            self._rest = b""  # a sequence of which more is to come

        def poll(self) -> list[str]:
            """Return the keys typed since the last call."""
            try:
                if os.tcgetpgrp(self._handle) != os.getpgrp():
                    return []  # in the background, reading would suspend the program
                if not self._changed:
                    self._change()
                if not select.select([self._handle], [], [], 0.0)[0]:
                    return []
                names, self._rest = typed(self._rest + os.read(self._handle, _CHUNK))
            except (OSError, termios.error):  # the terminal has gone
                return []
            return names

        def close(self) -> None:
            """Restore the terminal."""
            if self._changed:
                with contextlib.suppress(OSError, termios.error):
                    if os.tcgetpgrp(self._handle) == os.getpgrp():
                        termios.tcsetattr(self._handle, termios.TCSAFLUSH, self._before)

        def _change(self) -> None:
            """Turn off line buffering and echo; Ctrl-C and Ctrl-Z keep their meaning."""
            changed = termios.tcgetattr(self._handle)
            changed[3] &= ~(termios.ICANON | termios.ECHO)
            changed[6] = [*changed[6]]
            changed[6][termios.VMIN], changed[6][termios.VTIME] = 0, 0
            termios.tcsetattr(self._handle, termios.TCSANOW, changed)
            self._changed = True
