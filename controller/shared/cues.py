"""Cues: get ready, go, rest, example after example, until there are enough of all; pure.

An example counts if the sensor was touched during its go phase. One without a touch, or with
missing frames, is requested again, and its frames are left out of training.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

import numpy as np

FELT_FRAMES: Final = 2  # least touched frames of a touch; noise exceeds the gate in 1 of 1000
NULL_LABEL: Final = "null"  # an example without a touch
GAP_S: Final = 1.0  # after a longer interval between frames, the cue was not visible
_INSTANT_S: Final = 1e-6  # tolerance for sums of times


@dataclass(frozen=True, slots=True)
class ExampleRequest:
    """One example to record."""

    label: str  # its gesture
    # position of the touch, (x, y) in grid units; None: the usual one of the gesture
    place: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class CueTiming:
    """Durations of the phases of one example, seconds; a rest takes up to `jitter_s` longer.

    A gesture takes half a second, and users need half a second to begin. Go ends early after a
    touch that has been over for `still_s`; 0: never.
    """

    get_ready_s: float = 1.0
    go_s: float = 2.0
    rest_s: float = 1.5
    jitter_s: float = 0.5
    still_s: float = 0.0


class Phase(Enum):
    """Phase of an example."""

    WAIT = "wait"  # hands off: the sensor finds its baseline
    GET_READY = "get ready"
    GO = "go"
    REST = "rest"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class Cue:
    """The cue at one time."""

    phase: Phase  # of the present example
    label: str = ""  # of the present example; "" if there is none
    place: tuple[float, float] | None = None  # requested position, (x, y) in grid units; None: any
    left_s: float = 0.0  # time left in the phase
    more: dict[str, int] = field(default_factory=dict)  # number of missing examples of each label
    then: str = ""  # label of the next example; "" if there is none

    @property
    def left(self) -> int:
        """Number of missing examples of all labels."""
        return sum(self.more.values())


@dataclass(frozen=True, slots=True)
class DiscardedExample:
    """An example that does not count: requested again, its frames left out of training."""

    label: str  # its gesture
    from_s: float  # its beginning
    to_s: float  # its end
    why: str  # reason, as text


class CueSession:
    """A session of cues, with the time of the frames without pauses."""

    def __init__(
        self, asks: Sequence[ExampleRequest], pace: CueTiming, rng: np.random.Generator
    ) -> None:
        """Prepare a session of examples in order; `rng` draws rests and places of repetitions."""
        self._queue = deque(asks)
        self._pace, self._rng = pace, rng
        self._labels = tuple(dict.fromkeys(ask.label for ask in asks))
        self._phase = Phase.WAIT
        self._present: ExampleRequest | None = None
        self._last_s = self._from_s = self._until_s = 0.0  # the last frame; this phase
        self._touched = 0  # touched frames of this example
        self._new = 0  # those of a touch that began since the last example
        self._touched_s = 0.0  # the last of them
        self._clear = False  # the sensor was untouched since the last example

    @property
    def done(self) -> bool:
        """Whether there are enough examples of all labels."""
        return self._phase is Phase.DONE

    def advance(self, t_s: float, *, felt: bool) -> list[DiscardedExample]:
        """Advance to a frame, touched or not; return the discarded examples."""
        if self._phase is Phase.WAIT:
            self._last_s = t_s
            self._next(t_s)
        passed_s, self._last_s = t_s - self._last_s, t_s
        if passed_s > GAP_S:
            self._until_s += passed_s
            return self._restart(t_s) if self._phase is Phase.GO else []
        self._count_touch(t_s, touched=felt)
        discarded: list[DiscardedExample] = []
        while self._phase is not Phase.DONE and t_s >= self._until_s:
            discarded += self._next_phase()
        return discarded

    def at(self, t_s: float) -> Cue:
        """Return the cue at `t_s`, the time of the latest step."""
        present = self._present
        missing = [request.label for request in self._queue]
        if present is not None and self._phase is not Phase.REST:  # at rest it has been counted
            missing.append(present.label)
        return Cue(
            self._phase,
            present.label if present else "",
            present.place if present else None,
            max(self._until_s - t_s, 0.0),
            {label: missing.count(label) for label in self._labels},
            self._queue[0].label if self._queue else "",
        )

    def _count_touch(self, t_s: float, *, touched: bool) -> None:
        """Count touched frames; go ends early when the touch has been over for `still_s`.

        The end of an earlier touch, from which soft skin recovers slowly, does not count.
        """
        self._clear |= not touched
        if self._phase is not Phase.GO or t_s > self._until_s:
            return
        if touched:
            self._touched += 1
            self._new += self._clear
            self._touched_s = t_s
        elif self._pace.still_s and self._new >= FELT_FRAMES:
            still_s = t_s - self._touched_s
            self._until_s = t_s if still_s > self._pace.still_s - _INSTANT_S else self._until_s

    def _next_phase(self) -> list[DiscardedExample]:
        """Change from an ended phase to the next one; return a discarded example."""
        now_s, present = self._until_s, self._present
        if self._phase is Phase.GET_READY:
            self._touched = self._new = 0
            self._enter(Phase.GO, now_s, self._pace.go_s)
            return []
        if self._phase is Phase.REST or present is None:
            self._next(now_s)
            return []
        began_s, pace = self._from_s, self._pace
        self._clear = False
        self._enter(Phase.REST, now_s, pace.rest_s + float(self._rng.uniform(0.0, pace.jitter_s)))
        if self._touched >= FELT_FRAMES or present.label == NULL_LABEL:
            return []
        self._repeat(present)
        return [DiscardedExample(present.label, began_s, now_s, "nothing was felt")]

    def _next(self, now_s: float) -> None:
        """Begin the next example, if there is one."""
        self._present = self._queue.popleft() if self._queue else None
        if self._present is None:
            self._enter(Phase.DONE, now_s, 0.0)
        else:
            self._enter(Phase.GET_READY, now_s, self._pace.get_ready_s)

    def _restart(self, t_s: float) -> list[DiscardedExample]:
        """Begin the present example again."""
        assert self._present is not None
        void = DiscardedExample(self._present.label, self._from_s, t_s, "frames were missed")
        self._enter(Phase.GET_READY, t_s, self._pace.get_ready_s)
        return [void]

    def _repeat(self, request: ExampleRequest) -> None:
        """Queue an example again, at a random later place."""
        last = len(self._queue)  # the next one is visible already, and stays next
        at = min(1, last) + int(self._rng.integers(max(last, 1)))
        self._queue.insert(at, request)

    def _enter(self, phase: Phase, from_s: float, seconds: float) -> None:
        self._phase, self._from_s, self._until_s = phase, from_s, from_s + seconds
