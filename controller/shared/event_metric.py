"""Event metric: assignment of commands to true gestures, and their latency.

A stream has true events; a command attaches to the last event that began before it and had
not ended more than `TAIL_S` ago (after the next onset, to the next). The
first right one is a hit, a further right one a duplicate, another class wrong. A command attached
to no event is a false alarm.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

TAIL_S: Final = 0.5  # a command may come until this time after the release

# Why an event has no answer, in this order; else it is unclear.
LIGHT: Final = 0.5  # probability of all gestures together that a firm touch reaches
RIVAL: Final = 0.5  # probability of the second gesture, as a share of the first one's
SHORT_S: Final = 0.3


@dataclass(frozen=True, slots=True)
class Event:
    """A true event.

    Attributes:
        onset_s: The first finger passes 40 % of its plateau depth.
        release_s: The last finger leaves.
        kind: The class that a right answer names.
    """

    onset_s: float
    release_s: float
    kind: str


@dataclass(frozen=True, slots=True)
class Answer:
    """A recognised command or gesture: time of the newest frame used, and class."""

    time_s: float
    kind: str


@dataclass(slots=True)
class Score:
    """Counts over a stream; every event is either hit or missed."""

    intended: int = 0
    hits: int = 0
    wrong: int = 0
    missed: int = 0
    false_alarms: int = 0
    duplicates: int = 0
    latencies_s: list[float] = field(default_factory=list)

    @property
    def precision(self) -> float:
        """Hits among all answers; 1 when there were none."""
        answers = self.hits + self.wrong + self.false_alarms + self.duplicates
        return self.hits / answers if answers else 1.0

    @property
    def recall(self) -> float:
        """Hits among all events; 1 when there were none."""
        return self.hits / self.intended if self.intended else 1.0

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall."""
        total = self.precision + self.recall
        return 2 * self.precision * self.recall / total if total else 0.0

    def add(self, other: "Score") -> None:
        """Pool another stream's counts into this one."""
        self.intended += other.intended
        self.hits += other.hits
        self.wrong += other.wrong
        self.missed += other.missed
        self.false_alarms += other.false_alarms
        self.duplicates += other.duplicates
        self.latencies_s += other.latencies_s


def attach(events: Sequence[Event], answers: Sequence[Answer], tail_s: float = TAIL_S) -> list[int]:
    """Return the number of the event that each answer belongs to; -1: none.

    Args:
        events: True events in order of onset, not overlapping.
        answers: Commands or gestures, in order of time.
        tail_s: How long after its release an event may still be answered, seconds.
    """
    owners, index = [], -1
    for answer in answers:
        while index + 1 < len(events) and events[index + 1].onset_s <= answer.time_s:
            index += 1
        late = index < 0 or answer.time_s > events[index].release_s + tail_s
        owners.append(-1 if late else index)
    return owners


def judge(events: Sequence[Event], answers: Sequence[Answer], tail_s: float = TAIL_S) -> Score:
    """Score answers against the events of one stream; the arguments are those of `attach`."""
    score = Score(intended=len(events))
    hit = [False] * len(events)
    for answer, index in zip(answers, attach(events, answers, tail_s), strict=True):
        if index < 0:
            score.false_alarms += 1
        elif answer.kind != events[index].kind:
            score.wrong += 1
        elif hit[index]:
            score.duplicates += 1
        else:
            hit[index] = True
            score.hits += 1
            score.latencies_s.append(answer.time_s - events[index].onset_s)
    score.missed = score.intended - score.hits
    return score
