"""End-to-end latency of frames: from the orb's schedule to here, and from here to the screen."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from controller.shared.protocol.messages import LatencyReport, StageTime, Telemetry
from host.connection.receiver import Delivered, Received

FRAMES: Final = 600  # that count: a minute at 10 a second
_SHARES: Final = (50.0, 95.0, 99.0)
_RECENT: Final = 20  # frames


class EndToEndLatency:
    """Latency of frames, stage by stage; subscribe `on_received` to a receiver.

    Attributes:
        pace: What the orb said last of its own hops.
        frames: That have come since the start.
    """

    def __init__(
        self,
        offset_ms: Callable[[], int | None],
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Measure; `offset_ms` is the orb's time minus ours, if it is known."""
        self.pace: LatencyReport | None = None
        self._offset_ms, self._clock_ns = offset_ms, clock_ns
        self.frames = 0
        self._arrive: deque[float] = deque(maxlen=FRAMES)
        self._draw: deque[float] = deque(maxlen=FRAMES)
        self._taken_ms: float | None = None  # when the newest frame was, that is not drawn yet

    def on_received(self, news: Sequence[Received]) -> None:
        """Take what is new."""
        now_ms = self._clock_ns() / 1e6
        for item in news:
            if not isinstance(item, Delivered):
                continue
            if isinstance(item.message, LatencyReport):
                self.pace = item.message
            elif isinstance(item.message, Telemetry):
                self._taken_ms = now_ms
                self.frames += 1
                if (offset_ms := self._offset_ms()) is not None:
                    self._arrive.append(max(0.0, now_ms - (item.t_ms - offset_ms)))

    def drawn(self) -> None:
        """The window shows all that was taken."""
        if self._taken_ms is not None:
            self._draw.append(self._clock_ns() / 1e6 - self._taken_ms)
            self._taken_ms = None

    def recent_ms(self) -> list[float]:
        """Return the ages of the last frames when they came here, ascending; [] if unknown."""
        return sorted([*self._arrive][-_RECENT:])

    def digest(self) -> list[StageTime]:
        """Return what is known: in the orb, from its schedule to here, and to the screen."""
        own = [replace(hop, name="orb") for hop in self.pace.hops[-1:]] if self.pace else []
        spans = (("here", self._arrive), ("drawn", self._draw))
        known = [(name, np.percentile(list(values), _SHARES)) for name, values in spans if values]
        return own + [StageTime(name, *map(float, shares)) for name, shares in known]
