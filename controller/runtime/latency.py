"""Latency of the control loop: a stamp at the end of each hop, percentiles, and their reports.

The loop stamps the beginning of a frame, the stages the ends of their hops. In the idle time
between two frames the report is sent to the host. No function waits, and memory is bounded.
"""

import time
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from controller.shared.protocol.messages import LatencyReport, StageTime

# The device's hops in order, each named by the work that ends with it.
HOPS: Final = ("wait", "scan", "prepare", "network", "decide", "send")
LINES: Final = 4096  # frames in the statistics: seven minutes at 10 a second
REPORT_S: Final = 1.0  # between two reports
_SHARES: Final = (50.0, 95.0, 99.0)
_SLACK_S: Final = 0.01  # least idle time for a report


class LatencyStatistics:
    """Time stamps of the latest frames; `lines` counts all since the start."""

    def __init__(self, hops: Sequence[str] = HOPS, lines: int = LINES) -> None:
        """Reserve memory for the hops of the latest `lines` frames."""
        self.lines = 0
        self._hops = tuple(hops)
        self._stamps = np.zeros((lines, len(hops) + 1), dtype=np.int64)

    def note(self, stamps_ns: Sequence[int]) -> None:
        """Add a frame's stamps: when it was due, then the end of each hop, nanoseconds."""
        self._stamps[self.lines % len(self._stamps)] = stamps_ns
        self.lines += 1

    def digest(self) -> tuple[StageTime, ...]:
        """Return the percentiles of each hop, and of the whole; () without frames."""
        known = self._stamps[: min(self.lines, len(self._stamps))]
        if not len(known):
            return ()
        spans = np.diff(known, axis=1) / 1e6
        spans = np.column_stack([spans, spans.sum(axis=1)])
        rows = np.percentile(spans, _SHARES, axis=0).T.round(3).tolist()
        return tuple(
            StageTime(hop, *row) for hop, row in zip((*self._hops, "all"), rows, strict=True)
        )


class LatencyReporter:
    """The latency of one session, and its reports.

    Attributes:
        statistics: Of the session's frames.
    """

    def __init__(
        self,
        period_s: float,
        send: Callable[[LatencyReport], object],
        *,
        clock_ns: Callable[[], int] = time.perf_counter_ns,
    ) -> None:
        """Prepare for the first frame; reports go to `send` every second."""
        self.statistics = LatencyStatistics()
        self._period_s, self._send = period_s, send
        self._clock_ns = clock_ns
        self._stamps = [0] * (len(HOPS) + 1)
        self._at = 0
        self._reported_s = 0.0

    def start(self, late_s: float) -> None:
        """Begin a frame that was due `late_s` ago."""
        now_ns = self._clock_ns()
        self._stamps[:2] = now_ns - round(late_s * 1e9), now_ns
        self._at = 2

    def mark(self) -> None:
        """End a hop; the last one completes the frame."""
        if self._at < len(self._stamps):
            self._stamps[self._at] = self._clock_ns()
            self._at += 1
            if self._at == len(self._stamps):
                self.statistics.note(self._stamps)

    def idle(self, now_s: float, left_s: float, missed: int) -> None:
        """Report, if it is due and `left_s`, the time until the next frame, suffices.

        `now_s` is the loop's clock, and `missed` counts frames skipped since the start.
        """
        due = now_s - self._reported_s >= REPORT_S and self.statistics.lines
        if due and left_s >= _SLACK_S:
            self._reported_s = now_s
            self._send(LatencyReport(self._period_s * 1000, missed, self.statistics.digest()))
