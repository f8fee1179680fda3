"""Round-trip time and clock offset, estimated from heartbeats.

Each heartbeat carries its sender's clock, the newest clock reading that came from the other side,
and for how long that was held; so both ends measure, as NTP does (RFC 5905, section 8). Whole
milliseconds. Pure: time comes in.
"""

from collections import deque
from typing import Final

NEVER: Final = 0xFFFFFFFF  # held for so long: nothing has come yet
_WINDOW: Final = 32  # samples, 3 s of heartbeats; of them the one with the shortest trip counts
_LONGEST_MS: Final = 10_000  # a longer round trip is none of a living session
_GRAIN_MS: Final = 2  # what rounding and drift may add between two samples


class ClockSync:
    """One end's view of the other's clock.

    Attributes:
        rtt_ms: The newest round trip; None: not measured yet.
        offset_ms: The other's clock minus ours, wrong by half a round trip at most; None: unknown.
    """

    def __init__(self) -> None:
        """Begin without a measurement."""
        self.rtt_ms: int | None = None
        self.offset_ms: int | None = None
        # (round trip, offset, the most that the offset can be)
        self._samples: deque[tuple[int, int, int]] = deque(maxlen=_WINDOW)
        self._most_ms = 0
        self._theirs_ms = 0  # the other's clock, as it came last
        self._taken_ms: int | None = None  # when that was

    def stamps(self, now_ms: int) -> tuple[int, int, int]:
        """Return what the next heartbeat carries: our clock, theirs, and how long it was held."""
        if self._taken_ms is None:
            return now_ms & 0xFFFFFFFF, 0, NEVER
        return now_ms & 0xFFFFFFFF, self._theirs_ms, min(now_ms - self._taken_ms, NEVER - 1)

    def take(self, sent_ms: int, echo_ms: int, held_ms: int, now_ms: int) -> None:
        """Take what a heartbeat carried; what is impossible is no measurement."""
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
                self._samples.clear()  # no clock could have shown both: one was set
        # It arrived there after it was sent here, so their clock cannot be further ahead.
        self._samples.append((rtt_ms, offset_ms, signed(sent_ms - held_ms - echo_ms)))
        self.rtt_ms, self.offset_ms = rtt_ms, min(self._samples)[1]
        self._most_ms = min(most_ms for _, _, most_ms in self._samples)

    def age_ms(self, sent_ms: int, now_ms: int) -> int | None:
        """Return how old something can be at most that the other's clock dates; None: unknown.

        It is more than the truth by the quickest way there, which is not known apart from the way
        back.
        """
        return None if self.offset_ms is None else signed(now_ms - sent_ms + self._most_ms)


def signed(value: int) -> int:
    """Return a difference of two u32 clocks, across the wrap."""
    return (value + 0x80000000 & 0xFFFFFFFF) - 0x80000000
