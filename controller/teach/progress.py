"""Display of a teaching session: what to do, how many examples, what the present model says."""

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil
from typing import Final, TextIO

from controller import errors
from controller.bundles.vocabulary import Vocabulary
from controller.capture.cues import NULL_LABEL, Cue, Phase
from controller.capture.labels import FrameLabels
from controller.capture.status_line import Display, TerminalDisplay
from controller.recognition.pipeline import Step
from controller.teach.protocols import NOTHING

KEYS: Final = "hold 1-9: label by hand, space: pause, backspace: drop 3 s, Ctrl-C: end"
_BAR: Final = 10  # characters
_SHOWN_HZ: Final = 15.0  # faster than anyone reads
_TALLEST: Final = 11  # lines of a map of the sensor


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
        if cue.phase is Phase.GO and not cue.paused:
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


class ProgressPage:
    """The page for every frame, as lines of text; pure."""

    def __init__(
        self,
        vocabulary: Vocabulary,
        tally: ExampleCounts,
        grid: tuple[int, int],
        *,
        model: Sequence[str] = (),
        example_s: float = 5.0,
        keyboard: bool = True,
        plain: bool = False,
    ) -> None:
        """Prepare a page for a sensor of `grid` = (rows, columns), and the `model` of some labels.

        `example_s` is how long one example takes; `plain` draws with ASCII only.
        """
        self._says = {NULL_LABEL: NOTHING, **{e.label: e.say for e in vocabulary.entries}}
        self._labels = vocabulary.labels
        self._tally, self._grid, self._model = tally, grid, model
        self._example_s, self._keyboard = example_s, keyboard
        self._full, self._rest, self._here = "#-o" if plain else "█░●"

    def lines(self, said: FrameLabels, step: Step, problem: str = "") -> list[str]:
        """Return the page for a frame."""
        cue = said.asked or Cue(Phase.WAIT)
        lines = [f"{int(step.t_s) // 60}:{int(step.t_s) % 60:02}  {self.do(cue)}"]
        if said.key > 0:
            lines[0] += f"   key: {self._labels[said.key]}"
        if problem:
            lines.append(f"      DISK PROBLEM: {problem}")
        lines += [self.then(cue), "", *self._counts(step)]
        if cue.place is not None and cue.phase in (Phase.GET_READY, Phase.GO):
            lines += ["", *self._map(cue.place)]
        return [*lines, "", KEYS] if self._keyboard else lines

    def do(self, cue: Cue) -> str:
        """Return what to do now."""
        if cue.paused:
            return "PAUSED; space goes on"
        match cue.phase:
            case Phase.WAIT:
                return "hands off: the sensor finds its rest"
            case Phase.DONE:
                return "done"
            case Phase.REST:
                return "rest"
        say = self._says.get(cue.label, cue.label)
        place = "" if cue.place is None else f", at {cue.place[0]:g}, {cue.place[1]:g}"
        now = "get ready" if cue.phase is Phase.GET_READY else "GO"
        return f"{now} {ceil(cue.left_s)} s: {say}{place}"

    def then(self, cue: Cue) -> str:
        """Return what comes next; places are shown when it is their turn."""
        if cue.paused or cue.phase is Phase.DONE or not cue.then:
            return ""
        return f"      then: {self._says.get(cue.then, cue.then)}"

    def _counts(self, step: Step) -> list[str]:
        """Return a line for the whole, and one for each label that is asked for."""
        tally = self._tally
        left, whole = sum(tally.more.values()), sum(tally.wanted.values())
        bar, minutes = self._bar((whole - left) / whole), ceil(left * self._example_s / 60.0)
        width = max(map(len, tally.wanted))
        head = f"     {'':<{width}} examples            "
        head += "  before" if tally.before else ""
        head += "  understood  now" if tally.model else ""
        lines = [f"      {bar} {whole - left} of {whole}, about {minutes} min left", "", head]
        numbers = {label: str(i) for i, label in enumerate(self._labels[1:10], 1)}
        for label, wanted in tally.wanted.items():
            have, more = tally.have(label), tally.more[label]
            count, still = f"{have}/{wanted}", f"{more} more" if more else "enough"
            line = f"{numbers.get(label, ' '):>4} {label:<{width}} {self._bar(have / wanted)}"
            line += f" {count:<5} {still:<7}"
            if tally.before:
                line += f"{tally.before.get(label, 0):>5}"
            if (understood := tally.understood(label)) is not None:
                chance = float(step.probabilities[self._model.index(label)])
                right = f"{understood[0]}/{understood[1]}"
                line += f"{right:>12}  {self._bar(chance)} {chance:.2f}"
            lines.append(line.rstrip())
        return lines

    def _bar(self, share: float) -> str:
        full = round(_BAR * share)
        return self._full * full + self._rest * (_BAR - full)

    def _map(self, place: tuple[float, float]) -> list[str]:
        """Return the sensor as its player sees it, and where to touch: y goes up."""
        rows, columns = self._grid
        if 2 * rows - 1 > _TALLEST:
            return []
        lines = [[" "] * (4 * columns - 3) for _ in range(2 * rows - 1)]
        for row in range(rows):
            for column in range(columns):
                lines[2 * row][4 * column] = "."
        x, y = place
        row, column = round(2 * (rows - 1 - y)), round(4 * x)
        lines[row][column] = self._here
        return [("      " + "".join(line)).rstrip() for line in lines]


class ProgressDisplay(TerminalDisplay):
    """A page at the bottom of a terminal, written again and again."""

    def __init__(
        self, stream: TextIO, page: ProgressPage, tally: ExampleCounts, *, bell: bool = False
    ) -> None:
        """Show `page` on a terminal; with `bell` it rings at every go."""
        super().__init__(stream)
        self._page, self._tally, self._bell = page, tally, bell
        self._drawn: list[str] = []
        self._shown_s = 0.0

    def show(self, said: FrameLabels, step: Step, problem: str) -> None:
        """Show a frame."""
        self._tally.take(said, step)
        if self._bell and said.fresh and said.asked is not None and said.asked.phase is Phase.GO:
            self.emit("\a")
        if not said.fresh and step.t_s - self._shown_s < 1.0 / _SHOWN_HZ:
            return
        self._shown_s = step.t_s
        width, height = self.size()
        lines = [line[: width - 1] for line in self._page.lines(said, step, problem)]
        self._draw(lines[: height - 1])

    def clear(self) -> None:
        """Leave the lines empty for other output."""
        if self._drawn:
            self.emit("\r\x1b[J")
            self._drawn = []

    def _draw(self, lines: list[str]) -> None:
        """Write the lines in place of the last ones; the cursor goes back to the first."""
        if lines == self._drawn:
            return
        text = "".join(f"\r{line}\x1b[K\n" for line in lines)
        self.emit(f"{text}\x1b[J\x1b[{len(lines)}A")
        self._drawn = lines


class ProgressLog(Display):
    """A log of changes, where there is no terminal for a page."""

    def __init__(self, tally: ExampleCounts, say: Callable[[str], None]) -> None:
        """Pass lines to `say`."""
        self._tally, self._say = tally, say
        self._enough: set[str] = set()

    def show(self, said: FrameLabels, step: Step, problem: str) -> None:
        """Log what a frame changed."""
        self._tally.take(said, step)
        for void in said.voids:
            self._say(f"{void.label} again: {void.why}")
            self._enough.discard(void.label)
        for label, more in self._tally.more.items():
            if not more and label not in self._enough:
                self._enough.add(label)
                self._say(f"{label}: enough ({self._tally.wanted[label]})")


def drawable(stream: TextIO | None) -> bool:
    """Whether a page can be drawn there."""
    dumb = sys.platform != "win32" and os.environ.get("TERM", "dumb") == "dumb"
    return stream is not None and stream.isatty() and not dumb


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
