"""Results of a training that identifies users, as plain values."""

from dataclasses import dataclass

from models.results.figure import Figure


@dataclass(frozen=True, slots=True)
class Open:
    """How enrolled people and strangers are told apart after so many gestures.

    Attributes:
        seen: Gestures in a row.
        auroc: Probability that somebody enrolled is believed more than a stranger.
        false_accepts: Share of strangers who are taken for somebody.
        right: Share of enrolled people who are named, rightly.
        wrong: Share of enrolled people who are taken for somebody else.
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
        name: As the recordings say.
        sessions: That were recorded.
        gestures: That were made in them.
        right: Share of their gestures, in the session held out, that are theirs by far.
    """

    name: str
    sessions: int
    gestures: int
    right: float


@dataclass(frozen=True, slots=True)
class Telling:
    """What a user network is worth.

    Attributes:
        name: Of the bundle.
        command: What was typed.
        gestures: Labels that tell.
        people: Who is enrolled.
        split: What was held out, a sentence.
        random: Share of windows at random named rightly: the paper's protocol, which leaks.
        seen: Share of rows of so many gestures that are named rightly, in what was held out.
        events: Gestures held out.
        strangers: People who were to be taken for nobody, and no training met.
        open: Against them; empty where there are none.
        temperature: Of the evidence.
        accept: Probability from which on somebody is named.
        notes: What else there is to say.
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
    open: tuple[Open, ...]
    temperature: float
    accept: float
    notes: tuple[str, ...] = ()
