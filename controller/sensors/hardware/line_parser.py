"""Frames in a stream of text lines: numbers between commas, spaces, tabs or semicolons. Pure."""

import re
from typing import Final

import numpy as np
from numpy.typing import NDArray

MAX_LINE: Final = 64 << 10  # bytes; a longer line is garbage
_LARGEST: Final = 1e6  # of a value, as in recordings
_SEPARATOR: Final = re.compile(rb"[ \t]*[,;\t][ \t]*| +")
_NUMERIC: Final = re.compile(rb"[-+.,;0-9eE \t]+")

Values = NDArray[np.float32]  # (values,)


class LineParser:
    """Finds whole frames; headers, cut, joined and garbled lines are dropped.

    An empty field (",,") is a missing value: the taxel's last one is taken.

    Attributes:
        count: Values of a frame; 0 until two lines in a row agree.
        frames: Number of frames so far.
        dropped: Number of other lines so far.
        latest: The newest frame, (count,); None: there was none.
    """

    def __init__(self, count: int = 0) -> None:
        """Begin in the middle of a line, as a port does; `count` 0 is found out."""
        self.count = count
        self.frames = self.dropped = 0
        self.latest: Values | None = None
        self._rest = b""
        self._whole = False  # whether the beginning of the present line was seen
        self._candidate = 0  # values of the line before, while the count is unknown

    def cut(self) -> None:
        """Begin in the middle of a line again: the port was lost."""
        self._rest, self._whole = b"", False

    def feed(self, data: bytes) -> list[Values]:
        """Take bytes as they came; return the frames that they complete, oldest first."""
        *lines, rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        found = []
        for line in filter(bytes.strip, lines if self._whole else lines[1:]):
            values = self._values(line)
            if values is None:
                self.dropped += 1
            else:
                self.frames, self.latest = self.frames + 1, values
                found.append(values)
        self._rest, self._whole = rest, self._whole or bool(lines)
        if len(rest) > MAX_LINE:
            self.cut()
        return found

    def _values(self, line: bytes) -> Values | None:
        """Return the frame in a whole line, (count,), or None."""
        if not _NUMERIC.fullmatch(line):
            return None
        fields = _SEPARATOR.split(line.strip().rstrip(b",;"))
        if not self.count:
            agreed, self._candidate = len(fields) == self._candidate, len(fields)
            if not agreed:
                return None
            self.count = len(fields)
        if len(fields) != self.count:
            return None
        try:
            values = np.array([float(field) if field else np.nan for field in fields])
        except ValueError:
            return None
        missing = np.isnan(values)
        if missing.any():
            if self.latest is None:
                return None
            values[missing] = self.latest[missing]
        return values.astype(np.float32) if np.abs(values).max() < _LARGEST else None
