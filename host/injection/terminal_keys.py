"""The keys of the terminal that `host` was started in: those that arm and change the profile."""

import re
import sys
from typing import Final, Protocol, TextIO

# Function keys as nearly every terminal sends them, modifiers left out.
_FUNCTION: Final = {17: "f6", 18: "f7", 19: "f8", 20: "f9", 21: "f10", 23: "f11", 24: "f12"}
_KEY: Final = re.compile(rb"\x1b\[(\d+)(?:;\d+)?~|\x1b\[[\d;]*[ -~]|\x1bO?.|[a-z0-9]", re.DOTALL)
_UNFINISHED: Final = re.compile(rb"\x1b(?:O|\[[\d;]*)?\Z")
_CHUNK: Final = 1024


class TerminalKeys(Protocol):
    """Where the user may type."""

    def poll(self) -> list[str]:
        """Return the names of the keys typed since the last call, without waiting."""

    def close(self) -> None:
        """Leave the terminal as it was found."""


def decode(data: bytes) -> tuple[list[str], bytes]:
    """Return the keys in what a terminal sent, and the beginning of one that is not complete."""
    unfinished = _UNFINISHED.search(data)
    rest = unfinished[0] if unfinished else b""
    keys = []
    for found in _KEY.finditer(data[: len(data) - len(rest)]):
        if found[1]:
            keys.append(_FUNCTION.get(int(found[1][:4]), ""))
        elif len(found[0]) == 1:
            keys.append(found[0].decode())
    return [key for key in keys if key], rest


def open_terminal(stream: TextIO | None = None) -> TerminalKeys | None:
    """Return the terminal at the standard input, None if there is none, or it is not ours."""
    stream = sys.stdin if stream is None else stream
    if stream is None or not stream.isatty():
        return None
    if sys.platform == "win32":
        return Console()
    return Posix(stream.fileno()) if _ours(stream.fileno()) else None


if sys.platform == "win32":
    import msvcrt

    class Console:
        """The console of Windows. Untried."""

        _FUNCTION: Final = dict(zip(b"@ABCD\x85\x86", _FUNCTION.values(), strict=True))

        def poll(self) -> list[str]:
            """Return what was typed since the last call."""
            keys = []
            while msvcrt.kbhit():
                char = msvcrt.getch()
                if char in (b"\0", b"\xe0"):
                    keys.append(self._FUNCTION.get(msvcrt.getch()[0], ""))
                elif char.isascii():
                    keys.append(char.decode())
            return [key for key in keys if key]

        def close(self) -> None:
            """Nothing was changed."""

else:
    import contextlib
    import os
    import select
    import termios

    class Posix:
        """A terminal of a system that has termios; it is read key by key, and shows none."""

        def __init__(self, handle: int) -> None:
            """Take the terminal at a file descriptor."""
            self._handle, self._rest = handle, b""
            self._before = termios.tcgetattr(handle)
            changed = termios.tcgetattr(handle)
            changed[3] &= ~(termios.ICANON | termios.ECHO)
            changed[6][termios.VMIN] = changed[6][termios.VTIME] = 0
            termios.tcsetattr(handle, termios.TCSANOW, changed)

        def poll(self) -> list[str]:
            """Return what was typed since the last call."""
            if not select.select([self._handle], [], [], 0)[0] or not _ours(self._handle):
                return []
            try:
                data = os.read(self._handle, _CHUNK)
            except OSError:  # it has gone
                return []
            keys, self._rest = decode(self._rest + data)
            return keys

        def close(self) -> None:
            """Give the terminal back, what was typed for us thrown away."""
            with contextlib.suppress(termios.error):
                if _ours(self._handle):
                    termios.tcsetattr(self._handle, termios.TCSAFLUSH, self._before)

    def _ours(handle: int) -> bool:
        """Whether the program is in the terminal's foreground; elsewhere reading would stop it."""
        try:
            return os.tcgetpgrp(handle) == os.getpgrp()
        except OSError:
            return False
