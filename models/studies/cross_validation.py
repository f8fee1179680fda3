"""Cross-validation over people or sessions: each window is named by networks that never saw them.

In each fold CNN-3D is trained on the others by the default recipe, with fewer steps. Nothing that
is judged decides anything: the scale of the signal, the symmetries of undeclared gestures and the
epoch that is kept are chosen on the fold's own people.
"""

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.recordings.recording import software
from controller.shared.aliases import Say
from controller.shared.errors import count
from models.data import load, splits
from models.data.augment import Symmetry
from models.data.examples import Choice, refuse_test_seed
from models.data.load import Data
from models.data.recipe import DEFAULT, FOLD_STEPS, NetworkRecipe
from models.data.splits import Fold, Parts
from models.evaluation import scores
from models.formatting import duration
from models.results import storage
from models.results.training import Epoch
from models.studies import fold_choices, fold_statistics, trajectory_baseline
from models.studies.fold_choices import Own
from models.studies.fold_statistics import TOUCHED, CrossValidation, Windows
from models.training import checkpoint, symmetry_search
from models.training.gesture_task import GestureTask
from models.training.loop import fit, prepare_torch

Answers = dict[str, NDArray[np.float32]]  # of each model, (windows of the fold, classes)
Done = tuple[Answers, dict[str, Any]]  # "cpu_s" of each model; "chosen", in words

EDGES: Final = (1 / 1000, 1 / 2, 1.0)  # touched shares of a window: between two of `TOUCHED`
MOST_EPOCHS: Final = 1000  # no limit in practice
# Passes over the examples from which on a network may learn people by heart: some are held out,
# and the epoch that is best for them is kept.
OFTEN: Final = 12
MEASURED: Final = 3  # batches by which the time of a training is estimated
REPORT_S: Final = 30.0  # between two lines on progress, seconds
PATIENCE: Final = 0.25  # epochs without a better one before training stops, share of all
OURS: Final = "ours"
NAMES: Final = {
    OURS: "CNN-3D", "plain": "trajectory trees", "mended": "trajectory trees, mended"
}  # fmt: skip
SOUND: Final = ("no taxel or electrode dies in training",)
NONE: Final = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Request:
    """Options of a cross-validation."""

    paths: tuple[Path, ...]  # folders and files of recordings
    out: Path  # JSON file of the results; finished parts are kept beside it until all are
    by: str = "user"  # group that is held out together: "user" or "session"
    folds: int = 5  # number of folds
    steps: int = FOLD_STEPS  # training batches of each network
    window: int = 0  # images in a window; 0: those of a second
    labels: Choice = "auto"  # source of the labels
    all: bool = False  # take recordings that fail the check
    given: bool = False  # take labels as given; else they are moved to the touch
    sound: bool = False  # no taxel or electrode dies in training
    declared: bool = False  # try no symmetries that are not declared
    plain: bool = True  # judge trees on the touch's trajectory, too
    seed: int = 0  # of everything random
    command: str = ""  # command line


def cross(request: Request, say: Say) -> CrossValidation:
    """Train and judge every fold, and write the results; or raise ValueError, one sentence."""
    begun = time.process_time()
    refuse_test_seed(request.seed, "this cross-validation")
    storage.target(request.out)
    device = prepare_torch(request.seed)
    recipe = replace(DEFAULT, repair=DEFAULT.repair and not request.given)
    data = load.read(
        request.paths, recipe, request.labels, say, window=request.window, every=request.all
    )
    for note in data.notes:
        say(note)
    study = _Study(request, data, _course(recipe.gesture, request), device, say)
    reading_s = time.process_time() - begun
    say(f"{study.describe()}; {len(study.folds)} folds by {request.by}")
    say(f"about {duration(study.expected_s())} of training on this machine")
    done = [*study.judged()]
    how = replace(recipe, gesture=study.course).sentences(gesture=True, location=False)
    found = _results(study, done, tuple(how), reading_s)
    storage.write_json(request.out, found)
    shutil.rmtree(study.folder)
    return found


class _Study:
    """Recordings, folds and models of one cross-validation."""

    def __init__(
        self, request: Request, data: Data, course: NetworkRecipe, device: torch.device, say: Say
    ) -> None:
        """Prepare features, claim a folder for finished parts; ValueError: too few people."""
        self.request, self.data, self.course, self.device = request, data, course, device
        self.say, examples = say, data.examples
        by_user = request.by == "user"
        self.group = (data.user if by_user else data.session)[examples.session]  # (frames,)
        present = len(np.unique(self.group[examples.ends]))
        if not 2 <= request.folds <= present:
            raise ValueError(
                f"{request.folds} folds by {request.by} of {present}; ask for 2 or more, at most "
                "one for each"
            )
        self.folds = splits.by_group(examples.ends, examples.window, self.group, request.folds)
        self.searched = symmetry_search.undeclared(data) and not request.declared
        self.rows = {
            name: trajectory_baseline.features(examples, mended=name == "mended")
            for name in NAMES if name != OURS and request.plain
        }  # fmt: skip
        self.windows = _windows(data)
        options = replace(request, paths=(), out=Path(), command="")
        of = options, course, data.digest, data.vocabulary, data.settings, software()
        self.folder = request.out.with_name(f"{request.out.name}.folds")
        checkpoint.claim(self.folder, "all.npz", of, "run")

    def describe(self) -> str:
        """Return the data set in words."""
        examples, windows = self.data.examples, self.windows
        _, rows, columns = examples.images.shape
        return (
            f"{len(examples.ends)} windows of {examples.window} images of {rows}×{columns} taxels "
            f"at {self.data.settings.rate_hz:g} Hz, in {int(windows.stretch[-1]) + 1} stretches, "
            f"of {count(len(windows.people), 'person', 'people')}"
        )

    def sentences(self) -> list[str]:
        """Return the declared symmetries in sentences; none if each fold finds its own."""
        if self.searched:
            return ["symmetries: found in each fold among its own people"]
        vocabulary, grid = self.data.vocabulary, self.data.examples.images.shape[1:]
        return Symmetry.of(vocabulary, *grid).sentences(vocabulary.labels)

    def expected_s(self) -> float:
        """Return the time of all trainings by that of a few batches, seconds; without trees."""
        parts = Parts(self.folds[0].train[: 2 * self.course.batch], NONE, NONE)
        classes, generator = len(self.windows.labels), torch.Generator(self.device)
        own = Own(self.data, None)
        task = GestureTask(
            self.data.examples, parts, classes, own.symmetry, self.course, self.device
        )
        batch, times = next(task.batches(np.random.default_rng(0))), [time.monotonic()]
        for _ in range(MEASURED):
            task.loss(batch, generator)[0].backward()  # type: ignore[no-untyped-call]
            times.append(time.monotonic())
        each = float(np.median(np.diff(times))) * self.course.batch / len(batch)
        return each * self.course.steps * len(self.folds)

    def judged(self) -> Iterator[Done]:
        """Yield the models' answers to each fold's test part; report the time that is left."""
        begun = time.monotonic()
        for number in range(len(self.folds)):
            yield self.judge(number)
            left = (time.monotonic() - begun) / (number + 1) * (len(self.folds) - number - 1)
            if left:
                self.say(f"about {duration(left)} left")

    def judge(self, number: int) -> Done:
        """Return the models' answers to a fold's test part, which are kept in a file."""
        kept, fold = self.folder / f"fold-{number}.npz", self.folds[number]
        done = checkpoint.load(kept) or self._judge(number, fold)
        checkpoint.save(kept, *done)
        for part in self.folder.glob(f"fold-{number}-*.npz"):
            part.unlink()
        label = self.windows.label[fold.test]
        right = [
            f"{NAMES[key]} {(answers.argmax(axis=1) == label).mean():.4f}"
            for key, answers in done[0].items()
        ]
        line = f"fold {number + 1} of {len(self.folds)}: {', '.join(right)} {done[1]['chosen']}"
        self.say(line.rstrip())
        return done

    def _judge(self, number: int, fold: Fold) -> Done:
        """Train all models on a fold."""
        begun = time.process_time()
        label, seed = self.windows.label[fold.train], self.request.seed
        own = self._own(fold)
        chosen = f"({own.words})" * bool(own.words)
        answers = {OURS: self._train(number, fold, own)}
        cpu_s = {OURS: time.process_time() - begun}
        for name, rows in self.rows.items():
            begun = time.process_time()
            trees = trajectory_baseline.train(rows[fold.train], label, seed)
            classes = len(self.windows.labels)
            answers[name] = trajectory_baseline.predict(trees, rows[fold.test], classes)
            cpu_s[name] = time.process_time() - begun
        return answers, {"cpu_s": cpu_s, "chosen": chosen}

    def _own(self, fold: Fold) -> Own:
        """Return what a fold's own people decide."""
        own = fold_choices.of(self.data, fold, self.group)
        if not (self.searched and own.inner):
            return own
        own = fold_choices.searched(own, self.course, self.request.seed, self.device)
        self.say(f"  among the people of fold {fold.name}: {own.words}")
        return own

    def _train(self, number: int, fold: Fold, own: Own) -> NDArray[np.float32]:
        """Train on a fold; return probabilities (windows, classes) of its test part.

        If the examples come by often, some of the fold's own people stop it.
        """
        seed, examples = self.request.seed, own.data.examples
        parts, classes = Parts(fold.train, NONE, NONE), len(self.windows.labels)
        if own.inner is not None and self.course.passes(len(fold.train)) > OFTEN:
            parts = Parts(own.inner.train, own.inner.test, NONE)
        torch.manual_seed(seed)
        task = GestureTask(examples, parts, classes, own.symmetry, self.course, self.device)
        fit(task, seed, self.folder / f"fold-{number}-last.npz", self._watch(task))
        logits, _ = task.answers(examples.ends[fold.test])
        return scores.softmax(logits.cpu().numpy()).astype(np.float32)

    def _watch(self, task: GestureTask) -> Callable[[Epoch], None]:
        """Return what reports a training's progress, every `REPORT_S` seconds at most."""
        begun = said = time.monotonic()
        passes = task.recipe.passes(task.steps() * task.recipe.batch)

        def watch(epoch: Epoch) -> None:
            nonlocal said
            now = time.monotonic()
            if now - said >= REPORT_S:
                said, left = now, (now - begun) / epoch.number * (passes - epoch.number)
                self.say(f"  {epoch.number} of {passes} epochs, at most {duration(left)} to go")

        return watch


def _course(course: NetworkRecipe, request: Request) -> NetworkRecipe:
    """Return the recipe of the folds, with their number of batches."""
    plain = replace(course, patience=PATIENCE)
    if request.sound:
        sound = replace(course.augmentation, dropout=0.0, electrode=0.0)
        plain = replace(plain, augmentation=sound)
    return replace(plain, epochs=0, steps=request.steps, limits=(1, MOST_EPOCHS))


def _windows(data: Data) -> Windows:
    """Return the windows to judge."""
    examples = data.examples
    session = examples.session[examples.ends].astype(np.int64)
    label = examples.label[examples.ends]
    _, first, person = np.unique(data.user, return_index=True, return_inverse=True)
    rows = [data.rows[number] for number in first]
    return Windows(
        label,
        np.cumsum(examples.begins(examples.ends, gap=1)) - 1,
        person[session],
        np.digitize(trajectory_baseline.touched(examples), EDGES),
        data.vocabulary.labels,
        tuple(row.user or Path(row.path).stem for row in rows),
    )


def _results(
    study: _Study, done: Sequence[Done], how: tuple[str, ...], reading_s: float
) -> CrossValidation:
    """Return all results."""
    request, windows, folds = study.request, study.windows, study.folds
    answers, models = {}, []
    for key in (OURS, *study.rows):
        whole = np.zeros((len(windows.label), len(windows.labels)), dtype=np.float32)
        for fold, (own, _) in zip(folds, done, strict=True):
            whole[fold.test] = own[key]
        cpu_s = sum(float(words["cpu_s"][key]) for _, words in done)
        seed, name = request.seed, NAMES[key]
        models.append(fold_statistics.judge(windows, folds, name, whole, cpu_s, seed))
        answers[key] = whole
    gains = [
        fold_statistics.gain(windows, answers[OURS], NAMES[key], answers[key], request.seed)
        for key in study.rows
    ]
    people = (np.unique(windows.person[fold.test]).tolist() for fold in folds)
    classes = np.bincount(windows.label)
    chosen = tuple(str(words["chosen"]) for _, words in done)
    return CrossValidation(
        command=request.command,
        software=software(),
        data=study.describe(),
        how=(*how, *SOUND[: request.sound], *study.sentences()),
        labels=windows.labels,
        majority=float(classes.max() / classes.sum()),
        windows=len(windows.label),
        stretches=int(windows.stretch[-1]) + 1,
        people=windows.people,
        held=tuple(", ".join(windows.people[one] for one in some) for some in people),
        chosen=chosen if any(chosen) else (),
        touched=tuple(np.bincount(windows.touched, minlength=len(TOUCHED)).tolist()),
        models=tuple(models),
        gains=tuple(gains),
        reading_cpu_s=reading_s,
        cpu_minutes=(reading_s + sum(model.cpu_s for model in models)) / 60.0,
    )
