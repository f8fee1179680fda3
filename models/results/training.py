"""Results of a training, as plain values for the report and `NAME.json`.

Lists of lists, numbers and texts only, so that JSON holds all of it. NaN is a figure that is not
known; in the file it is null.
"""

import math
from dataclasses import dataclass, field
from typing import Final

from controller.recognition.touch_position import PositionSpread
from models.results.evaluation import Figure
from models.results.verdict import Verdict

ENOUGH: Final = "there is enough of every gesture, and none is often missed"  # advice


@dataclass(frozen=True, slots=True)
class Lateness:
    """Lateness of the labels of one session, seconds; below zero is early."""

    # the median over the labels' beginnings; NaN: there was nothing to compare
    begin_s: float = math.nan
    end_s: float = math.nan  # the same of their ends
    edges: int = 0  # number of edges compared
    # labels without a touch; they are left out of training, unless all are
    unfelt: int = 0
    named: int = 0  # frames that labels name a gesture
    # of those, frames that the repair names otherwise, or whose label is left out as unfelt
    changed: int = 0


@dataclass(frozen=True, slots=True)
class SessionRow:
    """One recording that was learned from, or held out."""

    path: str  # the file
    user: str  # identity of the user; "" unknown
    session: str  # name of the user's session
    seconds: float  # its length
    verdict: str  # "good", "doubtful" or "failed": `controller recordings`
    findings: tuple[str, ...]  # findings of the check, in sentences
    labeller: str  # source of the labels: "true", "button", "key" or "cue"
    held_out: bool  # nothing was learned from it
    examples: dict[str, int]  # times that each gesture was made, by label
    lateness: Lateness | None = None  # of its labels; None where they are the truth


@dataclass(frozen=True, slots=True)
class ClassRow:
    """Figures of one class."""

    label: str  # its name
    examples: int  # times that it was made, in the sessions that were learned from; 0 for null
    seconds: float  # their length
    recall: float  # share of its windows that are recognised, in sessions held out
    precision: float  # share of the windows so named that are it, in sessions held out
    # share of its events recognised, in sessions held out; NaN for null
    event_recall: float = math.nan


@dataclass(frozen=True, slots=True)
class Epoch:
    """One pass over the examples."""

    number: int  # from 1
    loss: float  # mean over its batches, without penalties
    train: float  # of these examples: share of right windows, or mean error in grid units
    check_loss: float  # on the sessions held out
    check: float  # on the sessions held out: the same as `train`; NaN: none are
    random: float  # on windows drawn at random from the training sessions: the paper's protocol


@dataclass(frozen=True, slots=True)
class HeldOutScore:
    """Score of a network on unseen sessions, and by the paper's protocol."""

    unseen: float  # score on sessions (users, or blocks of time) that nothing was learned from
    low: float  # lower bound of its 95 % interval; NaN where there is but one session
    high: float  # upper bound
    random: float  # score on windows at random, whose neighbours were learned from

    @property
    def gap(self) -> float:
        """Score by the paper's protocol above that on unseen sessions."""
        return self.random - self.unseen

    @property
    def figure(self) -> Figure:
        """The score on unseen sessions and its interval."""
        return Figure(self.unseen, self.low, self.high)


@dataclass(frozen=True, slots=True)
class Calibration:
    """Calibration of probabilities."""

    temperature: float  # divisor of the logits; folded into the last layer
    error: float  # expected calibration error as trained
    error_after: float  # the same after that
    # (confidence, accuracy, windows) of ten equal ranges of confidence, afterwards
    bins: tuple[tuple[float, float, int], ...]


@dataclass(frozen=True, slots=True)
class GestureResult:
    """Results of CNN-3D."""

    epochs: tuple[Epoch, ...]  # its curve
    honesty: HeldOutScore  # share of windows named rightly
    event_accuracy: float  # share of events in sessions held out that the mean probability names
    # windows of sessions held out: true class by named class
    confusion: tuple[tuple[int, ...], ...]
    # the same of events; the first row and column, of null, are empty
    event_confusion: tuple[tuple[int, ...], ...]
    calibration: Calibration  # of its probabilities
    weights: int  # number of weights
    # events of sessions held out by what the device would answer; row 0: nothing happened, column
    # 0: no answer. (): not measured.
    answered: tuple[tuple[int, ...], ...] = ()
    # those without an answer by reason, (classes, models/results/verdict.py:REASONS)
    unanswered: tuple[tuple[int, ...], ...] = ()
    verdict: Verdict = ()  # on every gesture, the worst first


@dataclass(frozen=True, slots=True)
class LocationResult:
    """Results of CNN-2D; errors are means over the axes, grid units."""

    epochs: tuple[Epoch, ...]  # its curve
    honesty: HeldOutScore  # mean error of an image (for once less is better)
    # x, y, error in x, error in y of every touch in sessions held out
    touches: tuple[tuple[float, float, float, float], ...]
    on_site: float  # mean error of touches within a quarter pitch of a taxel
    off_site: float  # of all others
    weights: int  # number of weights
    unseen: str = ""  # the hold-out rule, if it differs from the training's
    # calibrated position error; None: too few touches are held out
    spread: PositionSpread | None = None
    # mean distance that places move if the touch has half its strength; NaN: not measured
    half_strength: float = math.nan


@dataclass(frozen=True, slots=True)
class Training:
    """Results of a training."""

    name: str  # file name of the bundle
    command: str  # command line
    software: str  # version of this program
    recipe: str  # "default" or "paper"
    how: tuple[str, ...]  # the recipe, in sentences
    rows: int  # of the sensor
    columns: int  # of the sensor
    pitch_mm: float  # of the sensor
    rate_hz: float  # of the recordings
    unit: str  # of their frames
    labels: tuple[str, ...]  # classes, "null" first
    vocabulary: str  # its name
    split: str  # the hold-out rule, a sentence
    symmetries: tuple[str, ...]  # symmetries in use, a sentence each
    sessions: tuple[SessionRow, ...]  # every recording
    classes: tuple[ClassRow, ...]  # every class
    gesture: GestureResult | None  # CNN-3D; None where it was not trained
    location: LocationResult | None  # CNN-2D; None where it was not trained
    advice: tuple[str, ...] = ()  # next steps, in sentences, the most urgent first
    debounce: dict[str, float] = field(default_factory=dict)  # debounce settings by name
    notes: tuple[str, ...] = ()  # further remarks, in sentences


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
    random: float  # share of windows at random named rightly: the paper's protocol, which leaks
    # share of rows of so many gestures that are named rightly, in what was held out
    seen: dict[int, Figure]
    events: int  # gestures held out
    strangers: int  # number of people who are not enrolled and in no training
    open: tuple[OpenSetFigures, ...]  # against them; empty where there are none
    temperature: float  # of the evidence
    accept: float  # probability from which a user is named
    notes: tuple[str, ...] = ()  # further remarks, in sentences
