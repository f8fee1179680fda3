"""Pages of Teach on which a bundle is trained from sessions recorded by cues."""

import math
import shutil
from collections.abc import Collection, Sequence
from pathlib import Path
from random import Random
from typing import Final

from controller.shared.cues import NULL_LABEL, ExampleRequest
from controller.shared.errors import reason
from controller.shared.files import atomic_write, data_folder
from controller.shared.protocol.teaching import Undo
from host.app.screen import rows
from host.app.screens.teach import trainer
from host.app.screens.teach.page import Course, TeachPage
from host.app.screens.teach.record import EXAMPLE_S, RecordPage
from host.app.screens.teach.trainer import GestureResult, TrainingRun
from host.ui import naming
from host.ui.orb_state import OrbState
from host.ui.pointer_input import DomeArea
from tetris.kit.menu import Item, Menu

REPETITIONS: Final = (10, 20, 30)
_REACH: Final = 0.6  # of the dome's radius, within which places lie
_OWN: Final = "gestures.toml"  # commands of gestures that do not ship, read by `models train`
_PAPER: Final = ("null", "press", "pinch", "twist_cw", "twist_ccw")  # labels that it extends


class TrainPage(TeachPage):
    """Counts the recorded sessions, records more, and begins the training."""

    def __init__(self, course: Course) -> None:
        self._repetitions, self._problem = REPETITIONS[1], ""
        self._missing = trainer.missing()
        super().__init__(course)

    @property
    def sessions(self) -> list[Path]:
        """The recordings of the orb's folder, oldest first; [] where it is not on this machine."""
        vocabulary = self.lessons.vocabulary
        found = Path(vocabulary.folder, "recordings").glob("[!.]*.npz") if vocabulary else ()
        return sorted(found, key=lambda path: (_written_s(path), path.name))

    def page(self) -> Menu:
        """Return what can be done, and what is there."""
        words, sessions, recording = self.words, self.sessions, self.course.recording
        labels = len(self.orb.state.gestures) + 1
        minutes = f"{labels * self._repetitions * EXAMPLE_S / 60:.0f}"
        record, value = self._record if self._ready else None, f"{self._repetitions} ×"
        hint = words("train.record_hint", minutes=minutes)
        items = [self.item("train.record", record, value, step=self._turn, hint=hint)]
        obstacle = self._obstacle(sessions)
        value, hint = words("train.sessions", count=len(sessions)), words("train.train_hint")
        train = None if obstacle else self._train
        items.append(self.item("train.begin", train, value, hint=obstacle or hint))
        said = naming.said(words, recording.text) if recording else ""
        said = said.replace(str(Path.home()), "~")
        title, notice = words("train.title"), self.notice() or self._problem
        return Menu(title, [*items, self.back_item()], rows(said)[:3], notice=notice)

    @property
    def _ready(self) -> bool:
        vocabulary, state = self.lessons.vocabulary, self.orb.state
        described = vocabulary is not None and len(state.gestures) == len(vocabulary.labels) - 1
        return described and state.link == "live" and state.ready

    def _obstacle(self, sessions: list[Path]) -> str:
        """Return why nothing can be trained now, a sentence; "" if it can."""
        words, vocabulary = self.words, self.lessons.vocabulary
        if "models" in self._missing:
            return words("train.no_models")
        if self._missing:
            return words("train.no_torch")
        if vocabulary is not None and not Path(vocabulary.folder).is_dir():
            return words("train.elsewhere")
        return "" if len(sessions) >= trainer.LEAST else words("train.few")

    def _turn(self, step: int) -> None:
        place = REPETITIONS.index(self._repetitions) + step
        self._repetitions = REPETITIONS[place % len(REPETITIONS)]

    def _record(self) -> None:
        infos = self.orb.state.gestures
        located = [label for label, info in infos.items() if len(info.rules) > 1]
        seed = len(self.sessions)  # another order in each session
        labels = [label for label in (*infos, NULL_LABEL) for _ in range(self._repetitions)]
        asks = requests(labels, (*located, NULL_LABEL), self.orb.state.pad, Random(seed))
        self.show(RecordPage(self.course, asks, seed))

    def _train(self) -> None:
        folder, out = data_folder() / "training", data_folder() / "bundles" / "trained.orb"
        try:
            sessions = _copied(self.sessions, folder, gestures_file(self.orb.state))
            out.parent.mkdir(parents=True, exist_ok=True)
            steps = trainer.steps(sessions, out, folder / "evaluation.json")
            page = TrainingPage(self.course, TrainingRun(steps, trainer.COMMAND), folder, out)
        except OSError as error:
            self._problem = f"{error.filename}: {reason(error)}"
            return
        self._problem = ""
        self.show(page)


def requests(
    labels: Sequence[str], anywhere: Collection[str], pad: DomeArea, rng: Random
) -> list[ExampleRequest]:
    """Return the examples of these labels in a random order, those of `anywhere` all over the dome.

    The others are in its middle.
    """
    return [
        ExampleRequest(label, _drawn(pad, rng) if label in anywhere else pad.centre)
        for label in rng.sample(labels, len(labels))
    ]


def _drawn(pad: DomeArea, rng: Random) -> tuple[float, float]:
    """Return a place, distributed evenly over the inner part of the dome."""
    turn, far = rng.uniform(0.0, math.tau), _REACH * pad.radius * math.sqrt(rng.random())
    return pad.centre[0] + far * math.cos(turn), pad.centre[1] + far * math.sin(turn)


def _written_s(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def gestures_file(orb: OrbState) -> str:
    """Return the text of a `gestures.toml` with the commands of taught gestures; "": none needed.

    Their symmetries are unknown to the host; the training learns them as they were recorded.
    """
    labels = orb.labels
    if labels[: len(_PAPER)] != _PAPER or len(labels) == len(_PAPER):
        return ""
    lines = ['name = "trained"', 'extends = "paper"']
    for label in labels[len(_PAPER) :]:
        lines += ["", "[[gesture]]", f'label = "{label}"']
        info = orb.gestures.get(label)
        if info and len(info.rules) == 1 and info.rules[0].command:
            lines.append(f'command = "{info.rules[0].command}"')
    return "\n".join([*lines, ""])


def _copied(sessions: list[Path], folder: Path, gestures: str) -> list[Path]:
    """Copy recordings into a folder of the host's own, whose old content goes; OSError."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    if gestures:
        atomic_write(folder / _OWN, gestures.encode())
    return [Path(shutil.copy2(path, folder)) for path in sessions]


class TrainingPage(TeachPage):
    """Shows how far the training is; leaving it asks once, and ends it."""

    def __init__(self, course: Course, run: TrainingRun, folder: Path, out: Path) -> None:
        self.run, self._folder, self._out = run, folder, out
        self._begun_s = course.stage.time_s
        super().__init__(course)

    def page(self) -> Menu:
        """Return the progress."""
        words, run = self.words, self.run
        if run.problem:
            lines = rows(self._stage.told(run.problem))[:6]
            return Menu(words("train.failed"), [self.back_item()], table=lines)
        left_s = run.progress.left_s(self._stage.time_s - self._begun_s)
        minutes = "" if left_s is None else words("train.left", minutes=f"{left_s / 60 + 0.5:.0f}")
        step, hint = f"train.{run.step or 'evaluate'}", words("train.training_hint")
        items = [
            self.item(step, share=run.progress.share, hint=hint),
            self.item("train.stop", self.leave, minutes, hint=hint),
        ]
        return Menu(words("train.training"), items)

    def notice(self) -> str:
        """Return "": a training needs no orb."""
        return ""

    def tick(self, time_s: float) -> None:
        """Let time pass; at the end show what came of it."""
        self.run.poll()
        super().tick(time_s)
        if self.run.step or self.run.problem:
            return
        try:
            found = trainer.results(self._folder / "evaluation.json")
        except ValueError as error:
            self.run.problem = str(error)
            return
        self.become(ResultPage(self.course, found, self._out))

    def leave(self) -> None:
        """Go back; ask once if the training has not ended."""
        if not self.run.step:
            super().leave()
            return
        self.ask("train.sure", "", self._stop)

    def _stop(self) -> None:
        self.run.stop()
        self.leave()


class ResultPage(TeachPage):
    """Shows how often gestures of the spared session were understood, and installs the bundle."""

    def __init__(self, course: Course, found: list[GestureResult], bundle: Path) -> None:
        self._found, self._bundle, self._problem = found, bundle, ""
        if course.orb.upload is not None and course.orb.upload.over:
            course.orb.upload = None  # of another bundle
        super().__init__(course)

    def page(self) -> Menu:
        """Return the results, and what can be done with the bundle."""
        words, found, vocabulary = self.words, self._found, self.lessons.vocabulary
        events = sum(one.of for one in found)
        share = sum(one.understood for one in found) / events if events else 0.0
        undo = self._undo if vocabulary and vocabulary.undo else None
        said, sent = self.installation()
        install = self._install if self.orb.state.link == "live" else None
        items = [
            self.item("train.use", install) if sent is None else Item(said, share=sent),
            self.item("teach.undo", undo),
            *(self._item(one) for one in found),
            self.back_item(),
        ]
        title = words("train.result", percent=f"{100 * share:.0f}")
        status = naming.said(words, self.lessons.status.text) if self.lessons.status else ""
        outcome = said if sent is None else ""
        return Menu(title, items, notice=self._problem or outcome or self.notice() or status)

    def _item(self, one: GestureResult) -> Item:
        words = self.words
        value = words("teach.of", count=one.understood, tries=one.of)
        hint = naming.said(words, one.why) or words("train.all_understood")
        return Item(naming.gesture(words, one.label), value=value, hint=hint)

    def _undo(self) -> None:
        self.orb.upload = None
        self.lessons.change(Undo())

    def _install(self) -> None:
        self._problem = self._stage.told(self.orb.install(self._bundle))
