"""Results of a training that identifies users, as plain values."""

from dataclasses import dataclass

from models.results.figure import Figure


@dataclass(frozen=True, slots=True)
class OpenSetFigures:
    """Figures of enrolled users against strangers after a number of gestures."""

    seen: int  # gestures in a row
    auroc: float  # probability that an enrolled user scores above a stranger
    false_accepts: float  # share of strangers taken for an enrolled user
    right: float  # share of enrolled users named rightly
    wrong: float  # share of enrolled users taken for another


@dataclass(frozen=True, slots=True)
class Enrolled:
    """One person."""

    name: str  # as in the recordings
    sessions: int  # that were recorded
    gestures: int  # that were made in them
    right: float  # share of their gestures, in the session held out, that are theirs by far


@dataclass(frozen=True, slots=True)
class UserResult:
    """Results of a user identification."""

    name: str  # of the bundle
    command: str  # command line
    gestures: tuple[str, ...]  # labels that identify users
    people: tuple[Enrolled, ...]  # enrolled users
    split: str  # the hold-out rule, a sentence
    random: float  # share of windows at random named rightly: the paper's protocol, which leaks
    # share of rows of so many gestures that are named rightly, in what was held out
    seen: dict[int, Figure]
    events: int  # gestures held out
    strangers: int  # number of people who are not enrolled and in no training
    open: tuple[OpenSetFigures, ...]  # against them; empty where there are none
    temperature: float  # of the evidence
    accept: float  # probability from which a user is named
    notes: tuple[str, ...] = ()  # further remarks, in sentences
