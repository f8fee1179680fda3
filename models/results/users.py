"""Results of a training that identifies users, as plain values."""

from dataclasses import dataclass

from models.results.figure import Figure


@dataclass(frozen=True, slots=True)
class OpenSetFigures:
    """Figures of enrolled users against strangers after a number of gestures.

    Attributes:
        seen: Gestures in a row.
        auroc: Probability that an enrolled user scores above a stranger.
        false_accepts: Share of strangers taken for an enrolled user.
        right: Share of enrolled users named rightly.
        wrong: Share of enrolled users taken for another.
    """

    seen: int
    auroc: float
    false_accepts: float
    right: float
    wrong: float


@dataclass(frozen=True, slots=True)
class Enrolled:
    """One person.

    Attributes:
        name: As in the recordings.
        sessions: That were recorded.
        gestures: That were made in them.
        right: Share of their gestures, in the session held out, that are theirs by far.
    """

    name: str
    sessions: int
    gestures: int
    right: float


@dataclass(frozen=True, slots=True)
class UserResult:
    """Results of a user identification.

    Attributes:
        name: Of the bundle.
        command: Command line.
        gestures: Labels that identify users.
        people: Enrolled users.
        split: The hold-out rule, a sentence.
        random: Share of windows at random named rightly: the paper's protocol, which leaks.
        seen: Share of rows of so many gestures that are named rightly, in what was held out.
        events: Gestures held out.
        strangers: Number of people who are not enrolled and in no training.
        open: Against them; empty where there are none.
        temperature: Of the evidence.
        accept: Probability from which a user is named.
        notes: Further remarks, in sentences.
    """

    name: str
    command: str
    gestures: tuple[str, ...]
    people: tuple[Enrolled, ...]
    split: str
    random: float
    seen: dict[int, Figure]
    events: int
    strangers: int
    open: tuple[OpenSetFigures, ...]
    temperature: float
    accept: float
    notes: tuple[str, ...] = ()
