"""Cross-validation over people or sessions: each window is named by networks that never saw them.

In each fold CNN-3D is trained on all others by the default recipe, and the last step's network is
kept, so nothing that is judged decides anything. With `choose`, each fold first chooses, by short
trainings on part of its own people: how far examples are shifted, where gestures are declared to be
the same anywhere (`shifts`), and the temperature of probabilities.
"""

import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.errors import count
from controller.recordings.recording import software
from models.data import load, splits
from models.data.augment import Symmetry
from models.data.examples import Choice, refuse_test_seed
from models.data.load import Data
from models.data.recipe import DEFAULT, NetworkRecipe
from models.data.splits import Fold, Parts
from models.evaluation import scores
from models.results import storage
from models.studies import fold_statistics, trajectory_baseline
from models.studies.fold_statistics import TOUCHED, CrossValidation, Windows
from models.training import checkpoint
from models.training.gesture_task import GestureTask
from models.training.loop import fit, prepare_torch

Say = Callable[[str], None]
Answers = dict[str, NDArray[np.float32]]  # of each model, (windows of the fold, classes)
Done = tuple[Answers, dict[str, Any]]  # "cpu_s" of each model; "chosen", in words

EDGES: Final = (1 / 1000, 1 / 2, 1.0)  # touched shares of a window: between two of `TOUCHED`
DISTANCES: Final = (0, 1, 2)  # taxels by which examples may be shifted, to choose from
SHORT: Final = 3  # steps of a full training over those of one to choose by
MOST_EPOCHS: Final = 1000  # no limit in practice
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
    steps: int = 0  # training batches of each network; 0: the recipe's
    window: int = 0  # images in a window; 0: those of a second
    labels: Choice = "auto"  # source of the labels
    all: bool = False  # take recordings that fail the check
    given: bool = False  # take labels as given; else they are moved to the touch
    choose: bool = False  # each fold chooses settings among its own people
    sound: bool = False  # no taxel or electrode dies in training
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
    done = [study.judge(number) for number in range(len(study.folds))]
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
        self.symmetry = Symmetry.of(data.vocabulary, *examples.images.shape[1:])
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
        course, temperature, chosen = self.course, 1.0, ""
        if self.request.choose:
            course, temperature, chosen = self._choose(number, fold)
        logits, _ = self._train(f"fold-{number}-last", fold, course)
        answers = {OURS: scores.softmax(logits, temperature).astype(np.float32)}
        cpu_s = {OURS: time.process_time() - begun}
        for name, rows in self.rows.items():
            begun = time.process_time()
            trees = trajectory_baseline.train(rows[fold.train], label, seed)
            classes = len(self.windows.labels)
            answers[name] = trajectory_baseline.predict(trees, rows[fold.test], classes)
            cpu_s[name] = time.process_time() - begun
        return answers, {"cpu_s": cpu_s, "chosen": chosen}

    def _choose(self, number: int, fold: Fold) -> tuple[NetworkRecipe, float, str]:
        """Return the recipe and temperature of a fold, and the choice in words."""
        examples, shifts = self.data.examples, self.symmetry.shifts
        inner = fold_statistics.within(fold, examples.ends, examples.window, self.group)
        least, most = self.course.limits
        steps, limits = max(1, self.course.steps // SHORT), (max(1, least // SHORT), most)
        tried = {}
        for distance in DISTANCES if shifts else (0,):
            brief = replace(_shifting(self.course, distance), steps=steps, limits=limits)
            logits, label = self._train(f"fold-{number}-by-{distance}", inner, brief)
            temperature = scores.temperature(logits, label)
            own = scores.softmax(logits, temperature)[np.arange(len(label)), label]
            loss = float(-np.log(np.maximum(own, 1e-12)).mean())
            tried[distance] = loss, temperature
            self.say(f"  within fold {number + 1}, shifted by {distance}: loss {loss:.4f}")
        best = min(tried, key=lambda distance: tried[distance][0])
        temperature = tried[best][1]
        words = f"(shifted by {best} at most, " if shifts else "("
        return _shifting(self.course, best), temperature, f"{words}temperature {temperature:.2f})"

    def _train(
        self, name: str, fold: Fold, course: NetworkRecipe
    ) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """Train on a fold; return logits (windows, classes) and classes of its test part."""
        seed, examples = self.request.seed, self.data.examples
        torch.manual_seed(seed)
        parts = Parts(fold.train, NONE, NONE)  # nothing that is judged is watched
        classes = len(self.windows.labels)
        task = GestureTask(examples, parts, classes, self.symmetry, course, self.device)
        fit(task, seed, self.folder / f"{name}.npz")
        logits, label = task.answers(examples.ends[fold.test])
        return logits.cpu().numpy(), label.cpu().numpy()


def _course(course: NetworkRecipe, request: Request) -> NetworkRecipe:
    """Return the recipe of the folds: training to the last step, without held-out data."""
    plain = replace(course, keep_best=False, patience=0.0)
    if request.sound:
        sound = replace(course.augmentation, dropout=0.0, electrode=0.0)
        plain = replace(plain, augmentation=sound)
    if not request.steps:
        return plain
    return replace(plain, epochs=0, steps=request.steps, limits=(1, MOST_EPOCHS))


def _shifting(course: NetworkRecipe, distance: int) -> NetworkRecipe:
    return replace(course, augmentation=replace(course.augmentation, shifted=distance))


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
    return CrossValidation(
        command=request.command,
        software=software(),
        data=study.describe(),
        how=(*how, *SOUND[: request.sound], *study.symmetry.sentences(windows.labels)),
        labels=windows.labels,
        majority=float(classes.max() / classes.sum()),
        windows=len(windows.label),
        stretches=int(windows.stretch[-1]) + 1,
        people=windows.people,
        held=tuple(", ".join(windows.people[one] for one in some) for some in people),
        chosen=tuple(str(words["chosen"]) for _, words in done) if request.choose else (),
        touched=tuple(np.bincount(windows.touched, minlength=len(TOUCHED)).tolist()),
        models=tuple(models),
        gains=tuple(gains),
        reading_cpu_s=reading_s,
        cpu_minutes=(reading_s + sum(model.cpu_s for model in models)) / 60.0,
    )
