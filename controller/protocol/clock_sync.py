"""Round-trip time and clock offset, estimated from heartbeats.

Each heartbeat carries the sender's clock, the newest clock reading received, and the time since.
Both ends estimate as NTP does (RFC 5905, section 8). Whole milliseconds. Pure: time is an argument.
"""

from collections import deque
from typing import Final

NEVER: Final = 0xFFFFFFFF  # hold time before the first heartbeat
_WINDOW: Final = 32  # samples, 3 s of heartbeats; the one with the shortest round trip counts
_LONGEST_MS: Final = 10_000  # longest valid round trip
_GRAIN_MS: Final = 2  # rounding and drift between two samples


class ClockSync:
    """Estimate of the peer's clock.

    Attributes:
        rtt_ms: The newest round trip; None: not measured yet.
        offset_ms: The peer's clock minus ours, with an error of half a round trip at most; None:
            unknown.
    """

    def __init__(self) -> None:
        """Begin without a measurement."""
        self.rtt_ms: int | None = None
        self.offset_ms: int | None = None
        # (round trip, offset, upper limit of the offset)
        self._samples: deque[tuple[int, int, int]] = deque(maxlen=_WINDOW)
        self._most_ms = 0
        self._theirs_ms = 0  # the newest clock reading of the peer
        self._taken_ms: int | None = None  # our time of that

    def stamps(self, now_ms: int) -> tuple[int, int, int]:
        """Return the clock fields of the next heartbeat: ours, the peer's, and its hold time."""
        if self._taken_ms is None:
            return now_ms & 0xFFFFFFFF, 0, NEVER
        return now_ms & 0xFFFFFFFF, self._theirs_ms, min(now_ms - self._taken_ms, NEVER - 1)

    def take(self, sent_ms: int, echo_ms: int, held_ms: int, now_ms: int) -> None:
        """Take the clock fields of a heartbeat; impossible ones are no measurement."""
        self._theirs_ms, self._taken_ms = sent_ms, now_ms
        if held_ms == NEVER:
            return
        rtt_ms = signed(now_ms - echo_ms - held_ms)
        if not 0 <= rtt_ms <= _LONGEST_MS:
            return
        offset_ms = signed(sent_ms + rtt_ms // 2 - now_ms)
        if self._samples and self.offset_ms is not None:
            best_ms = min(self._samples)[0]
            if abs(signed(offset_ms - self.offset_ms)) > (rtt_ms + best_ms) / 2 + _GRAIN_MS:
                self._samples.clear()  # inconsistent: a clock was set
        # The peer received our heartbeat after we sent it, which limits the offset.
        self._samples.append((rtt_ms, offset_ms, signed(sent_ms - held_ms - echo_ms)))
        self.rtt_ms, self.offset_ms = rtt_ms, min(self._samples)[1]
        self._most_ms = min(most_ms for _, _, most_ms in self._samples)

    def age_ms(self, sent_ms: int, now_ms: int) -> int | None:
        """Return the greatest possible age of an event stamped by the peer; None: unknown.

        It exceeds the true age by the shortest one-way delay, which cannot be measured.
        """
        return None if self.offset_ms is None else signed(now_ms - sent_ms + self._most_ms)


def signed(value: int) -> int:
    """Return a difference of two u32 clocks, across the wrap."""
    return (value + 0x80000000 & 0xFFFFFFFF) - 0x80000000
