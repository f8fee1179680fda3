"""Results of a training, as plain values for the report and `NAME.json`.

Lists of lists, numbers and texts only, so that JSON holds all of it. NaN is a figure that is not
known; in the file it is null.
"""

import math
from dataclasses import dataclass, field
from typing import Final

from controller.recognition.touch_position import PositionSpread
from models.results.figure import Figure

ENOUGH: Final = "there is enough of every gesture, and none is confused with another"  # advice


@dataclass(frozen=True, slots=True)
class Lateness:
    """Lateness of the labels of one session, seconds; below zero is early.

    Attributes:
        begin_s: The median over the labels' beginnings; NaN: there was nothing to compare.
        begin_spread_s: The middle half of them lies in a range as long as this.
        end_s: The same of their ends.
        end_spread_s: The same of their ends.
        edges: Number of edges compared.
        moved: Labels whose edges were moved to where the touch was.
        masked: Frames too close to an edge to be labelled; they are left out of training.
        unfelt: Labels without a touch; they are left out of training.
        unlabelled: Touches that no label names: taken for what is no gesture, and so for null.
        true_begin_s: True lateness of the beginnings, from a simulation; NaN: not known.
        true_end_s: Of the ends.
        wrong: Share of labelled frames that were wrong before the repair; NaN: not known.
        wrong_after: The same after the repair, of the frames that are left.
    """

    begin_s: float = math.nan
    begin_spread_s: float = math.nan
    end_s: float = math.nan
    end_spread_s: float = math.nan
    edges: int = 0
    moved: int = 0
    masked: int = 0
    unfelt: int = 0
    unlabelled: int = 0
    true_begin_s: float = math.nan
    true_end_s: float = math.nan
    wrong: float = math.nan
    wrong_after: float = math.nan


@dataclass(frozen=True, slots=True)
class SessionRow:
    """One recording that was learned from, or held out.

    Attributes:
        path: The file.
        user: Identity of the user; "" unknown.
        session: Name of the user's session.
        seconds: Its length.
        verdict: "good", "doubtful" or "failed": `controller recordings check`.
        findings: Findings of the check, in sentences.
        labeller: Source of the labels: "true", "button", "key" or "cue".
        held_out: Nothing was learned from it.
        examples: Times that each gesture was made, by label.
        lateness: Of its labels; None where they are the truth.
    """

    path: str
    user: str
    session: str
    seconds: float
    verdict: str
    findings: tuple[str, ...]
    labeller: str
    held_out: bool
    examples: dict[str, int]
    lateness: Lateness | None = None


@dataclass(frozen=True, slots=True)
class ClassRow:
    """Figures of one class.

    Attributes:
        label: Its name.
        examples: Times that it was made, in the sessions that were learned from; 0 for null.
        seconds: Their length.
        recall: Share of its windows that are recognised, in sessions held out.
        precision: Share of the windows so named that are it, in sessions held out.
        event_recall: Share of its events recognised, in sessions held out; NaN for null.
        more: Further examples worth recording; 0: enough.
        advice: The same in words.
    """

    label: str
    examples: int
    seconds: float
    recall: float
    precision: float
    event_recall: float = math.nan
    more: int = 0
    advice: str = ""


@dataclass(frozen=True, slots=True)
class Epoch:
    """One pass over the examples.

    Attributes:
        number: From 1.
        loss: Mean over its batches, without penalties.
        train: Of these examples: share of right windows, or mean error in grid units.
        check_loss: On the sessions held out.
        check: On the sessions held out: the same as `train`; NaN: none are.
        random: On windows drawn at random from the training sessions: the paper's protocol.
    """

    number: int
    loss: float
    train: float
    check_loss: float
    check: float
    random: float


@dataclass(frozen=True, slots=True)
class HeldOutScore:
    """Score of a network on unseen sessions, and by the paper's protocol.

    Attributes:
        unseen: Score on sessions (users, or blocks of time) that nothing was learned from.
        low: Lower bound of its 95 % interval; NaN where there is but one session.
        high: Upper bound.
        random: Score on windows at random, whose neighbours were learned from.
        unseen_binary: Per-output ("binary") accuracy, which the paper may mean; NaN: no classes.
        random_binary: The same on windows at random.
        unseen_windows: Number of them.
        random_windows: Number of them.
    """

    unseen: float
    low: float
    high: float
    random: float
    unseen_binary: float
    random_binary: float
    unseen_windows: int
    random_windows: int

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
    """Calibration of probabilities.

    Attributes:
        temperature: Divisor of the logits; folded into the last layer.
        error: Expected calibration error as trained.
        error_after: The same after that.
        bins: (confidence, accuracy, windows) of ten equal ranges of confidence, afterwards.
    """

    temperature: float
    error: float
    error_after: float
    bins: tuple[tuple[float, float, int], ...]


@dataclass(frozen=True, slots=True)
class GestureResult:
    """Results of CNN-3D.

    Attributes:
        epochs: Its curve.
        best: Number of the epoch that was kept.
        stopped: Why it ended before its last epoch; "" where it did not.
        honesty: Share of windows named rightly.
        event_accuracy: Share of events in sessions held out that the mean probability names.
        confusion: Windows of sessions held out: true class by named class.
        event_confusion: The same of events; the first row and column, of null, are empty.
        calibration: Of its probabilities.
        weights: Number of weights.
        answered: Events of sessions held out by what the device would answer; row 0: nothing
            happened, column 0: no answer. (): not measured.
    """

    epochs: tuple[Epoch, ...]
    best: int
    stopped: str
    honesty: HeldOutScore
    event_accuracy: float
    confusion: tuple[tuple[int, ...], ...]
    event_confusion: tuple[tuple[int, ...], ...]
    calibration: Calibration
    weights: int
    answered: tuple[tuple[int, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class LocationResult:
    """Results of CNN-2D; errors are means over the axes, grid units.

    Attributes:
        epochs: Its curve.
        best: Number of the epoch that was kept.
        stopped: Why it ended before its last epoch; "" where it did not.
        honesty: Mean error of an image (for once less is better).
        touches: x, y, error in x, error in y of every touch in sessions held out.
        on_site: Mean error of touches within a quarter pitch of a taxel.
        off_site: Of all others.
        weights: Number of weights.
        unseen: The hold-out rule, if it differs from the training's.
        spread: Calibrated position error; None: too few touches are held out.
    """

    epochs: tuple[Epoch, ...]
    best: int
    stopped: str
    honesty: HeldOutScore
    touches: tuple[tuple[float, float, float, float], ...]
    on_site: float
    off_site: float
    weights: int
    unseen: str = ""
    spread: PositionSpread | None = None


@dataclass(frozen=True, slots=True)
class Training:
    """Results of a training.

    Attributes:
        name: File name of the bundle.
        command: Command line.
        software: Version of this program.
        recipe: "default" or "paper".
        how: The recipe, in sentences.
        rows: Of the sensor.
        columns: Of the sensor.
        pitch_mm: Of the sensor.
        rate_hz: Of the recordings.
        unit: Of their frames.
        labels: Classes, "null" first.
        vocabulary: Its name.
        split: The hold-out rule, a sentence.
        symmetries: Symmetries in use, a sentence each.
        sessions: Every recording.
        classes: Every class.
        gesture: CNN-3D; None where it was not trained.
        location: CNN-2D; None where it was not trained.
        advice: Next steps, in sentences, the most urgent first.
        debounce: Debounce settings by name.
        notes: Further remarks, in sentences.
    """

    name: str
    command: str
    software: str
    recipe: str
    how: tuple[str, ...]
    rows: int
    columns: int
    pitch_mm: float
    rate_hz: float
    unit: str
    labels: tuple[str, ...]
    vocabulary: str
    split: str
    symmetries: tuple[str, ...]
    sessions: tuple[SessionRow, ...]
    classes: tuple[ClassRow, ...]
    gesture: GestureResult | None
    location: LocationResult | None
    advice: tuple[str, ...] = ()
    debounce: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
