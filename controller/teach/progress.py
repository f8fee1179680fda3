"""Log of a teaching session: what to do, and how many examples there are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from controller import errors
from controller.aliases import Say
from controller.bundles.vocabulary import Vocabulary
from controller.capture.cue_log import Display, describe
from controller.capture.cues import NULL_LABEL, Cue, Phase
from controller.capture.labels import FrameLabels
from controller.recognition.pipeline import Step
from controller.teach.protocols import NOTHING


@dataclass(slots=True)
class _Example:
    """An example under way, or one that counts."""

    label: str  # what was asked for
    begin_s: float  # when go was said
    answer: str = ""  # what the model took it for; "" nothing


@dataclass
class ExampleCounts:
    """Counts of one session."""

    wanted: Mapping[str, int]  # how many examples of each label the session asks for
    before: Mapping[str, int] = field(default_factory=dict)  # how many the folder had
    model: Sequence[str] = ()  # the labels that the present model knows; none without one
    more: dict[str, int] = field(default_factory=dict)  # how many are still wanted
    _done: list[_Example] = field(default_factory=list)
    _now: _Example | None = None

    def __post_init__(self) -> None:
        """Begin with everything wanted."""
        self.more = dict(self.wanted)

    def take(self, said: FrameLabels, step: Step) -> None:
        """Take a frame."""
        for void in said.voids:
            self._drop(void.label, void.from_s, void.to_s)
        cue = said.asked
        if cue is None:
            return
        self.more = {label: cue.more.get(label, 0) for label in self.wanted}
        if said.fresh:
            self._turn(cue, step.t_s)
        if self._now is not None and not self._now.answer and step.gesture is not None:
            self._now.answer = step.gesture

    def have(self, label: str) -> int:
        """Return how many examples of this session count."""
        return self.wanted[label] - self.more[label]

    def understood(self, label: str) -> tuple[int, int] | None:
        """Return how many examples the model took for what they are, of how many; None: unknown."""
        if label not in self.model:
            return None
        right = "" if label == NULL_LABEL else label
        answers = [one.answer for one in self._done if one.label == label]
        return answers.count(right), len(answers)

    def _turn(self, cue: Cue, t_s: float) -> None:
        """Begin or end an example; answers may come while the hand is already leaving."""
        if cue.phase is Phase.GO:
            if self._now is None:
                self._now = _Example(cue.label, t_s)
        elif cue.phase in (Phase.GET_READY, Phase.DONE) and self._now is not None:
            self._done.append(self._now)
            self._now = None

    def _drop(self, label: str, from_s: float, to_s: float) -> None:
        """Forget an example that does not count. It began at the first frame after its go."""
        now = self._now
        if now is not None and now.label == label and from_s <= now.begin_s <= to_s:
            self._now = None
        self._done = [
            one for one in self._done if not (one.label == label and from_s <= one.begin_s <= to_s)
        ]


class ProgressLog(Display):
    """A line for each change, and with a vocabulary for each cue."""

    def __init__(self, tally: ExampleCounts, say: Say, guided: Vocabulary | None = None) -> None:
        """Pass lines to `say`; a hand that needs no cues is not `guided`."""
        self._tally, self._say, self._guided = tally, say, guided is not None
        entries = () if guided is None else guided.entries
        self._words = {NULL_LABEL: NOTHING, **{one.label: one.say for one in entries}}
        self._enough: set[str] = set()

    def show(self, said: FrameLabels, step: Step) -> None:
        """Log what a frame changed."""
        self._tally.take(said, step)
        cue = said.asked
        if self._guided and said.fresh and cue is not None and cue.phase is not Phase.REST:
            self._say(describe(cue, self._words))
        for void in said.voids:
            self._say(f"{void.label} again: {void.why}")
            self._enough.discard(void.label)
        for label, more in self._tally.more.items():
            if not more and label not in self._enough:
                self._enough.add(label)
                self._say(f"{label}: enough ({self._tally.wanted[label]})")


def summary(tally: ExampleCounts) -> list[str]:
    """Return what a session gave, in lines."""
    lines = []
    for label in tally.wanted:
        have = tally.have(label)
        line = f"  {label}: {errors.count(have, 'example')}"
        if tally.before:
            line += f", {have + tally.before.get(label, 0)} in all"
        if (understood := tally.understood(label)) is not None and understood[1]:
            line += f"; {understood[0]} of {understood[1]} understood by the present model"
        lines.append(line)
    return lines
