"""Latency statistics: the time of each hop of the latest frames, in memory that never grows.

A ledger takes one line of stamps a frame: when it was due, then the end of each hop. It knows no
clock; whoever has one stamps. `StageLatency` is what people are told.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

# The device's hops, in their order: what ends with each of them.
HOPS: Final = ("wait", "scan", "prepare", "network", "decide", "send")
LINES: Final = 4096  # frames that count: seven minutes at 10 a second
_SHARES: Final = (50.0, 95.0, 99.0)


@dataclass(frozen=True, slots=True)
class StageLatency:
    """How long one hop took, milliseconds."""

    hop: str
    p50: float
    p95: float
    p99: float


class LatencyStatistics:
    """The stamps of the latest frames.

    Attributes:
        lines: Frames that were noted since the start.
        missed: Frames whose time was over before they could be read.
    """

    def __init__(self, hops: Sequence[str] = HOPS, lines: int = LINES) -> None:
        """Prepare for so many hops and lines; nothing more is ever asked for."""
        self.lines = 0
        self.missed = 0
        self._hops = tuple(hops)
        self._stamps = np.zeros((lines, len(hops) + 1), dtype=np.int64)

    def note(self, stamps_ns: Sequence[int]) -> None:
        """Take a frame's stamps: when it was due, then the end of each hop, nanoseconds."""
        self._stamps[self.lines % len(self._stamps)] = stamps_ns
        self.lines += 1

    def latest(self) -> NDArray[np.float64]:
        """Return the newest line's hops, milliseconds, (hops,)."""
        line = self._stamps[(self.lines - 1) % len(self._stamps)]
        hops: NDArray[np.float64] = np.diff(line) / 1e6
        return hops

    def digest(self) -> list[StageLatency]:
        """Return each hop's percentiles, and those of all of them together."""
        known = self._stamps[: min(self.lines, len(self._stamps))]
        if not len(known):
            return []
        spans = np.diff(known, axis=1) / 1e6
        spans = np.column_stack([spans, spans.sum(axis=1)])
        rows = np.percentile(spans, _SHARES, axis=0).T
        return [
            StageLatency(hop, *(round(float(value), 3) for value in row))
            for hop, row in zip((*self._hops, "all"), rows, strict=True)
        ]
