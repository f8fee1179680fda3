"""Cues of a session to train from: a random order of gestures, and its phases in time; pure."""

from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from random import Random
from typing import Final, Literal

from host.ui.pointer_input import DomeArea

NULL: Final = "null"  # a touch that is no gesture
READY_S: Final = 1.0
GO_S: Final = 1.2
REST_S: Final = (0.6, 1.4)  # in play some gestures follow each other quickly
EXAMPLE_S: Final = READY_S + GO_S + sum(REST_S) / 2  # mean duration
UNTOUCHED: Final = 3  # examples without a touch in a row, after which the session pauses
_REACH: Final = 0.6  # of the dome's radius, within which places lie

Phase = Literal["ready", "go", "rest", "over"]


@dataclass(frozen=True, slots=True)
class Cue:
    """One example to make."""

    label: str  # the gesture; `NULL`: any other touch
    place: tuple[float, float]  # where it is made, grid units


def plan(
    labels: Sequence[str], located: Collection[str], repetitions: int, pad: DomeArea, rng: Random
) -> list[Cue]:
    """Return as many cues of each label, in a random order.

    Those of `located` labels and of `NULL` are anywhere on the dome, the others in its middle.
    """
    wanted = [label for label in labels for _ in range(repetitions)]
    rng.shuffle(wanted)
    return [
        Cue(label, _anywhere(pad, rng) if label in (*located, NULL) else pad.centre)
        for label in wanted
    ]


def _anywhere(pad: DomeArea, rng: Random) -> tuple[float, float]:
    """Return a place, distributed evenly over the inner part of the dome."""
    x, y = pad.centre
    while True:
        across, up = rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)
        if across * across + up * up <= 1.0:
            return x + _REACH * pad.radius * across, y + _REACH * pad.radius * up


class CueRun:
    """The phases of one cue after another.

    An example of a gesture without a touch is made again at the end; after some in a row the run
    pauses.

    Attributes:
        phase: "ready", "go", "rest", and "over" at the end.
        left_s: Time left in the phase, of `length_s`.
        made: Number of examples that count.
        paused: Whether time stands still.
    """

    def __init__(self, cues: Sequence[Cue], rng: Random) -> None:
        """Begin with the first of the cues, at least one; `rng` draws the rests."""
        self.phase: Phase = "ready"
        self.left_s = self.length_s = READY_S
        self.made, self.paused = 0, False
        self._cues, self._rng = deque(cues), rng
        self._touched, self._missed = False, 0

    @property
    def cue(self) -> Cue:
        """The present example; the last one at the end."""
        return self._cues[0]

    @property
    def label(self) -> str:
        """Label of the present phase."""
        return self.cue.label if self.phase == "go" else NULL

    @property
    def count(self) -> int:
        """Number of all examples."""
        return self.made + len(self._cues) * (self.phase != "over")

    def advance(self, passed_s: float, *, touched: bool) -> None:
        """Let time pass, less than the shortest phase; `touched`: a touch began in it."""
        if self.paused or self.phase == "over":
            return
        self._touched |= touched
        self.left_s -= passed_s
        if self.left_s > 0.0:
            return
        if self.phase == "ready":
            self._enter("go", GO_S)
        elif self.phase == "go":
            self._enter("rest", self._rng.uniform(*REST_S))
        else:
            self._next()

    def _next(self) -> None:
        if self._touched or self.cue.label == NULL:
            self.made += 1
            self._missed = 0
        else:
            self._cues.append(self.cue)
            self._missed += 1
        self.paused = self._missed == UNTOUCHED
        self._missed %= UNTOUCHED
        self._touched = False
        if len(self._cues) == 1:
            self._enter("over", 0.0)
        else:
            self._cues.popleft()
            self._enter("ready", READY_S)

    def _enter(self, phase: Phase, seconds: float) -> None:
        self.phase, self.length_s = phase, seconds
        self.left_s += seconds
