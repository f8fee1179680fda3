"""Cues: get ready, go, rest, example after example, until there are enough of all; pure.

An example counts when something was felt while it was asked for. One that does not (nothing felt,
dropped, broken off by a pause) is asked for again, and its frames are left out of training.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

import numpy as np

from controller.capture.cue_plan import BLOCKS, CuePlan, CueTiming, ExampleRequest

FELT_FRAMES: Final = 2  # make a touch; noise leaves the gate in one of a thousand
NULL_LABEL: Final = "null"  # asks for no touch
GAP_S: Final = 1.0  # without a frame for longer, the cue was not shown
_INSTANT_S: Final = 1e-6  # times are sums, and not quite exact


class Phase(Enum):
    """Phase of an example."""

    WAIT = "wait"  # hands off: the sensor finds its rest
    GET_READY = "get ready"
    GO = "go"
    REST = "rest"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class Cue:
    """The cue at one time.

    Attributes:
        phase: Of the present example.
        label: Of the present example; "" where there is none.
        place: Where to touch, (x, y) in grid units, if that is asked.
        left_s: Until the phase ends.
        more: How many more of each label are wanted; 0 is enough.
        paused: Time stands still.
        then: Label of the next example, so that people can prepare; "" if there is none.
    """

    phase: Phase
    label: str = ""
    place: tuple[float, float] | None = None
    left_s: float = 0.0
    more: dict[str, int] = field(default_factory=dict)
    paused: bool = False
    then: str = ""

    @property
    def left(self) -> int:
        """How many more examples are wanted in all."""
        return sum(self.more.values())

    def plain(self, t_s: float) -> dict[str, object]:
        """Return the cue as plain data, for any screen."""
        return {
            "t": round(t_s, 3),
            "cue": "pause" if self.paused else self.phase.value,
            "label": self.label,
            **({} if self.place is None else {"place": list(self.place)}),
            "seconds": round(self.left_s, 3),
            "left": self.left,
            "more": {label: count for label, count in self.more.items() if count},
            "enough": [label for label, count in self.more.items() if not count],
        }


@dataclass(frozen=True, slots=True)
class DiscardedExample:
    """An example that does not count and is asked for again.

    Attributes:
        label: Of the example.
        from_s: When it began.
        to_s: When it ended; frames up to then are left out of training.
        why: Why it does not count.
    """

    label: str
    from_s: float
    to_s: float
    why: str

    def plain(self, t_s: float) -> dict[str, object]:
        """Return the event as plain data."""
        return {"t": round(t_s, 3), "cue": "again", "label": self.label, "why": self.why}


class CueSession:
    """A session of cues. Its time is that of the frames, without pauses."""

    def __init__(
        self,
        asks: Sequence[ExampleRequest],
        pace: CueTiming,
        rng: np.random.Generator,
        *,
        shuffled: bool = True,
    ) -> None:
        """Prepare to ask.

        Args:
            asks: The examples, in order.
            pace: How long each takes.
            rng: Draws the rests, and when an example is asked for again.
            shuffled: Ask again at any time to come; else at once.
        """
        self._queue = deque(asks)
        self._pace, self._rng, self._shuffled = pace, rng, shuffled
        self._counted: list[
            tuple[ExampleRequest, float, float]
        ] = []  # examples that count: from, to
        self._labels = tuple(dict.fromkeys(ask.label for ask in asks))
        self._phase = Phase.WAIT
        self._ask: ExampleRequest | None = None  # the present example
        self._last_s = self._from_s = self._until_s = 0.0  # the last frame; this phase
        self._felt = 0  # frames of this example in which something touched
        self._new = 0  # those of a touch that began since the last example
        self._felt_s = 0.0  # the last of them
        self._clear = False  # the sensor was seen untouched since the last example
        self._paused = False

    @classmethod
    def of(cls, plan: CuePlan) -> "CueSession":
        """Return the session of a plan."""
        rng = np.random.default_rng([plan.seed, 1])
        return cls(plan.asks(), plan.pace, rng, shuffled=plan.order != BLOCKS)

    @property
    def done(self) -> bool:
        """Whether there are enough examples of all labels."""
        return self._phase is Phase.DONE

    def advance(self, t_s: float, *, felt: bool, paused: bool = False) -> list[DiscardedExample]:
        """Advance to the frame at `t_s`; return the examples that are discarded.

        Args:
            t_s: Time of the frame.
            felt: Something touches in it.
            paused: It is left out of training.
        """
        if self._phase is Phase.WAIT:
            self._last_s = t_s
            self._next(t_s)
        passed_s, self._last_s = t_s - self._last_s, t_s
        self._paused = paused
        if paused or passed_s > GAP_S:
            self._until_s += passed_s
            why = "there was a pause" if paused else "frames were missed"
            return self._restart(t_s, why) if self._phase is Phase.GO else []
        self._feel(t_s, felt=felt)
        voids: list[DiscardedExample] = []
        while self._phase is not Phase.DONE and t_s >= self._until_s:
            voids += self._turn()
        return voids

    def at(self, t_s: float) -> Cue:
        """Return the cue at `t_s`, the time of the latest step."""
        ask = self._ask
        waiting = [ask.label for ask in self._queue]
        if ask is not None and self._phase is not Phase.REST:  # at rest it has been counted
            waiting.append(ask.label)
        return Cue(
            self._phase,
            ask.label if ask else "",
            ask.place if ask else None,
            max(self._until_s - t_s, 0.0),
            {label: waiting.count(label) for label in self._labels},
            self._paused,
            self._queue[0].label if self._queue else "",
        )

    def drop(self, from_s: float, to_s: float) -> list[DiscardedExample]:
        """Discard the examples between two times, and return them."""
        voids = []
        for example in tuple(self._counted):
            ask, began_s, ended_s = example
            if began_s < to_s and from_s < ended_s:
                self._counted.remove(example)
                self._again(ask)
                voids.append(DiscardedExample(ask.label, began_s, ended_s, "it was dropped"))
        if to_s <= self._from_s:
            return voids
        if self._phase is Phase.GO:
            voids += self._restart(self._last_s, "it was dropped")
        elif self._phase is Phase.GET_READY:  # time to get ready again
            self._until_s = self._last_s + self._pace.get_ready_s
        return voids

    def _feel(self, t_s: float, *, felt: bool) -> None:
        """Count touched frames; go ends early when the touch has been over for a while.

        The rest of an earlier touch, as soft skin returns slowly, does not count.
        """
        self._clear |= not felt
        if self._phase is not Phase.GO or t_s > self._until_s:
            return
        if felt:
            self._felt += 1
            self._new += self._clear
            self._felt_s = t_s
        elif self._pace.still_s and self._new >= FELT_FRAMES:
            still_s = t_s - self._felt_s
            self._until_s = t_s if still_s > self._pace.still_s - _INSTANT_S else self._until_s

    def _turn(self) -> list[DiscardedExample]:
        """Change from a phase that is over to the next one."""
        now_s, ask = self._until_s, self._ask
        if self._phase is Phase.GET_READY:
            self._felt = self._new = 0
            self._enter(Phase.GO, now_s, self._pace.go_s)
            return []
        if self._phase is Phase.REST or ask is None:
            self._next(now_s)
            return []
        began_s, pace = self._from_s, self._pace
        self._clear = False
        self._enter(Phase.REST, now_s, pace.rest_s + float(self._rng.uniform(0.0, pace.jitter_s)))
        if self._felt >= FELT_FRAMES or ask.label == NULL_LABEL:
            self._counted.append((ask, began_s, now_s))
            return []
        self._again(ask)
        return [DiscardedExample(ask.label, began_s, now_s, "nothing was felt")]

    def _next(self, now_s: float) -> None:
        """Begin the next example, if there is one."""
        self._ask = self._queue.popleft() if self._queue else None
        if self._ask is None:
            self._enter(Phase.DONE, now_s, 0.0)
        else:
            self._enter(Phase.GET_READY, now_s, self._pace.get_ready_s)

    def _restart(self, t_s: float, why: str) -> list[DiscardedExample]:
        """Begin the present example again."""
        assert self._ask is not None
        void = DiscardedExample(self._ask.label, self._from_s, t_s, why)
        self._enter(Phase.GET_READY, t_s, self._pace.get_ready_s)
        return [void]

    def _again(self, ask: ExampleRequest) -> None:
        """Ask for an example once more."""
        last = len(self._queue)  # the next one was announced already, and stays
        at = min(1, last) + int(self._rng.integers(max(last, 1))) if self._shuffled else 0
        self._queue.insert(at, ask)

    def _enter(self, phase: Phase, from_s: float, seconds: float) -> None:
        self._phase, self._from_s, self._until_s = phase, from_s, from_s + seconds
