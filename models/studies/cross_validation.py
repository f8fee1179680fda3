"""Train and judge in folds: each person's windows are named by networks that never saw them.

In each fold CNN-3D learns from everybody else by the default recipe, and the last step's network is
kept: nobody who is judged has a say in anything. If asked to, each fold chooses first, by short
trainings on some of those people, judged on the rest of them: how far examples are shifted, where
gestures are declared to be the same anywhere (`shifts`), and how hot probabilities are.
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

from controller.console import count
from controller.recordings.recording import software
from models import user_files
from models.data import load, splits
from models.data.augment import Symmetry
from models.data.examples import Choice, refuse_test_seed
from models.data.load import Data
from models.data.recipe import DEFAULT, NetworkRecipe, Recipe
from models.data.splits import Fold, Parts
from models.evaluation import scores
from models.studies import fold_statistics as folds
from models.studies import trajectory_baseline
from models.studies.fold_statistics import Crossed, Rowed
from models.training import checkpoint
from models.training.gesture_task import GestureTask
from models.training.loop import fit, prepare_torch

Say = Callable[[str], None]

TOUCHED: Final = (1 / 1000, 1 / 2, 1.0)  # shares of a window's images: edges of `folds.TOUCHED`
DISTANCES: Final = (0, 1, 2)  # taxels by which examples may be shifted, to choose from
SHORT: Final = 3  # a training to choose by has one in so many steps
MOST: Final = 1000  # epochs: no limit of its own
# What is judged, by its name in what is kept.
OURS: Final = "CNN-3D"
NAMES: Final = {
    "ours": OURS, "plain": "trajectory trees", "mended": "trajectory trees, mended"
}  # fmt: skip
SOUND: Final = ("no taxel or electrode dies in training",)
NONE: Final = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Request:
    """What somebody asked for.

    Attributes:
        paths: Folders and files.
        out: The figures, as JSON; parts that are done are kept beside it until all is.
        by: Who is left out together: "user" or "session".
        folds: How many.
        steps: Batches that each network learns from; 0: the recipe's.
        window: Images in a window; 0: those of a second.
        labels: Whose labels are learned.
        every: Recordings that fail the check are taken too.
        given: Labels are taken as they were given, not moved to the touch.
        choose: Each fold chooses among its own people first.
        sound: No taxel or electrode dies in training: the sensor is not one that breaks.
        plain: Trees on the touch's trajectory are judged too.
        seed: Of everything random.
        command: What was typed.
    """

    paths: tuple[Path, ...]
    out: Path
    by: str = "user"
    folds: int = 5
    steps: int = 0
    window: int = 0
    labels: Choice = "auto"
    every: bool = False
    given: bool = False
    choose: bool = False
    sound: bool = False
    plain: bool = True
    seed: int = 0
    command: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class _Work:
    """What all folds have in common."""

    data: Data
    recipe: Recipe
    group: NDArray[np.int64]
    symmetry: Symmetry
    course: NetworkRecipe
    rows: dict[str, NDArray[np.float32]]  # what each plain model sees
    choose: bool
    seed: int
    device: torch.device


def cross(request: Request, say: Say) -> Crossed:
    """Train and judge every fold, and write what came of it.

    Args:
        request: What was asked for.
        say: Takes lines of progress.

    Raises:
        ValueError: It cannot be done; one sentence.
    """
    begun = time.process_time()
    refuse_test_seed(request.seed, "this cross-validation")
    user_files.target(request.out)
    device = prepare_torch(request.seed)
    recipe = replace(DEFAULT, repair=DEFAULT.repair and not request.given)
    data = load.read(
        request.paths, recipe, request.labels, say, window=request.window, every=request.every
    )
    for note in data.notes:
        say(note)
    examples = data.examples
    group = (data.user if request.by == "user" else data.session)[examples.session]
    rounds = splits.by_group(examples.ends, examples.window, group, _count(request, group, data))
    symmetry = Symmetry.of(data.vocabulary, *examples.images.shape[1:])
    course = _course(recipe.gesture, request.steps, sound=request.sound)
    plain = ("plain", "mended") if request.plain else ()
    rows = {name: trajectory_baseline.features(examples, mended=name == "mended") for name in plain}
    work = _Work(data, recipe, group, symmetry, course, rows, request.choose, request.seed, device)
    listed = _listed(data)
    reading_s = time.process_time() - begun
    say(f"{_sentence(data, listed)}; {len(rounds)} folds by {request.by}")
    folder = _claim(request, data, course)
    done = []
    for number, fold in enumerate(rounds):
        done.append(_done(folder, number, fold, work, say))
        arrays, words = done[-1]
        told = [f"{NAMES[key]} {_right(one, fold, data):.4f}" for key, one in arrays.items()]
        say(f"fold {number + 1} of {len(rounds)}: {', '.join(told)} {words['chosen']}".rstrip())
    found = _found(request, work, rounds, done, listed, reading_s)
    user_files.write_text(request.out, f"{found.text()}\n")
    shutil.rmtree(folder)
    return found


def _count(request: Request, group: NDArray[np.int64], data: Data) -> int:
    """Return how many folds there are.

    Raises:
        ValueError: There are fewer people than that, or only one.
    """
    present = len(np.unique(group[data.examples.ends]))
    if not 2 <= request.folds <= present:
        raise ValueError(
            f"{request.folds} folds by {request.by} of {present}; ask for 2 or more, at most one "
            "for each"
        )
    return request.folds


def _course(course: NetworkRecipe, steps: int, *, sound: bool) -> NetworkRecipe:
    """Return how a fold's network is trained: as always, but nothing held out ends it."""
    plain = replace(course, keep_best=False, patience=0.0)
    if sound:
        whole = replace(course.augmentation, dropout=0.0, electrode=0.0)
        plain = replace(plain, augmentation=whole)
    return replace(plain, epochs=0, steps=steps, limits=(1, MOST)) if steps else plain


def _listed(data: Data) -> Rowed:
    """Return what is judged."""
    examples = data.examples
    session = examples.session[examples.ends].astype(np.int64)
    label = examples.label[examples.ends]
    people, person = np.unique(data.user, return_inverse=True)
    names = [row.user or Path(row.path).stem for row in data.rows]
    first = {int(one): names[i] for i, one in reversed(list(enumerate(data.user)))}
    kinds, kind = np.unique([row.session for row in data.rows], return_inverse=True)
    return Rowed(
        label,
        folds.stretches(examples.ends, label, session),
        person.reshape(-1)[session],
        kind.reshape(-1)[session],
        tuple(first[int(one)] for one in people),
        tuple(kinds.tolist()),
        np.digitize(trajectory_baseline.touched(examples), TOUCHED),
        data.vocabulary.labels,
    )


def _sentence(data: Data, listed: Rowed) -> str:
    examples, settings = data.examples, data.settings
    _, rows, columns = examples.images.shape
    return (
        f"{len(examples.ends)} windows of {examples.window} images of {rows}×{columns} taxels at "
        f"{settings.rate_hz:g} Hz, in {int(listed.stretch[-1]) + 1} stretches, of "
        f"{count(len(listed.people), 'person', 'people')}"
    )


def _claim(request: Request, data: Data, course: NetworkRecipe) -> Path:
    """Return the folder of parts that are done: of this cross-validation, or new.

    Raises:
        CheckpointError: It is another one's.
    """
    folder = request.out.with_name(f"{request.out.name}.folds")
    asked = replace(request, paths=(), out=Path(), command="")
    of = asked, course, data.digest, data.vocabulary, data.settings, software()
    return checkpoint.claim(folder, "all.npz", of, "run")


def _done(
    folder: Path, number: int, fold: Fold, work: _Work, say: Say
) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return what a fold's models answer to the people whom it leaves out, and what it cost."""
    kept = folder / f"fold-{number}.npz"
    if (found := checkpoint.load(kept)) is not None:
        return _checked(kept, found, fold, work)
    examples = work.data.examples
    arrays: dict[str, NDArray[Any]] = {}
    words: dict[str, Any] = {}
    begun = time.process_time()
    distance, hot, words["chosen"] = work.course.augmentation.shifted, 1.0, ""
    if work.choose:
        inner = splits.within(fold, examples.ends, examples.window, work.group)
        distance, hot, words["chosen"] = _choose(folder, number, inner, work, say)
    task = _learned(folder, f"fold-{number}-last", fold, work, _shifting(work.course, distance))
    logits, _ = task.answers(examples.ends[fold.test])
    arrays["ours"] = scores.softmax(logits.cpu().numpy(), hot).astype(np.float32)
    words["cpu_s"] = {"ours": time.process_time() - begun}
    label, classes = examples.label[examples.ends], len(work.data.vocabulary.labels)
    for name, rows in work.rows.items():
        begun = time.process_time()
        trees = trajectory_baseline.learn(rows[fold.train], label[fold.train], work.seed)
        arrays[name] = trajectory_baseline.ask(trees, rows[fold.test], classes)
        words["cpu_s"][name] = time.process_time() - begun
    checkpoint.save(kept, arrays, words)
    for part in folder.glob(f"fold-{number}-*.npz"):
        part.unlink()
    return arrays, words


def _checked(
    kept: Path, found: tuple[dict[str, NDArray[Any]], dict[str, Any]], fold: Fold, work: _Work
) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return what is kept of a fold, if it is whole.

    Raises:
        CheckpointError: It is not.
    """
    arrays, words = found
    names = {"ours", *work.rows}
    shape = len(fold.test), len(work.data.vocabulary.labels)
    cpu_s = words.get("cpu_s")
    if (
        set(arrays) != names
        or any(array.shape != shape for array in arrays.values())
        or not isinstance(cpu_s, dict)
        or not all(isinstance(cpu_s.get(name), float) for name in names)
        or not isinstance(words.get("chosen"), str)
    ):
        raise checkpoint.damaged(kept)
    return found


def _choose(
    folder: Path, number: int, inner: Fold, work: _Work, say: Say
) -> tuple[int, float, str]:
    """Return how far to shift, how hot probabilities are, and both in words."""
    brief = work.course
    if brief.epochs:
        brief = replace(brief, epochs=max(1, brief.epochs // SHORT))
    else:
        least, most = brief.limits
        limits = max(1, least // SHORT), most
        brief = replace(brief, steps=max(1, brief.steps // SHORT), limits=limits)
    distances = DISTANCES if work.symmetry.shifts else (0,)
    tried = {}
    for distance in distances:
        course = _shifting(brief, distance)
        task = _learned(folder, f"fold-{number}-by-{distance}", inner, work, course)
        answers = task.answers(work.data.examples.ends[inner.test])
        logits, label = (one.cpu().numpy() for one in answers)
        hot = scores.temperature(logits, label)
        own = scores.softmax(logits, hot)[np.arange(len(label)), label]
        tried[distance] = float(-np.log(np.maximum(own, 1e-12)).mean()), hot
        say(f"  within fold {number + 1}, shifted by {distance}: loss {tried[distance][0]:.4f}")
    best = min(tried, key=lambda distance: tried[distance][0])
    hot = tried[best][1]
    shifted = f"shifted by {best} at most, " if work.symmetry.shifts else ""
    return best, hot, f"({shifted}temperature {hot:.2f})"


def _shifting(course: NetworkRecipe, distance: int) -> NetworkRecipe:
    return replace(course, augmentation=replace(course.augmentation, shifted=distance))


def _learned(
    folder: Path, name: str, fold: Fold, work: _Work, course: NetworkRecipe
) -> GestureTask:
    """Return a task whose network has learned a fold's training part."""
    torch.manual_seed(work.seed)
    # Nothing is watched while it learns: what is judged is judged once, afterwards.
    parts = Parts(fold.train, NONE, NONE)
    classes = len(work.data.vocabulary.labels)
    task = GestureTask(work.data.examples, parts, classes, work.symmetry, course, work.device)
    fit(task, work.seed, folder / f"{name}.npz")
    return task


def _right(answers: NDArray[np.floating], fold: Fold, data: Data) -> float:
    label = data.examples.label[data.examples.ends[fold.test]]
    return float((answers.argmax(axis=1) == label).mean())


def _found(
    request: Request,
    work: _Work,
    rounds: Sequence[Fold],
    done: Sequence[tuple[dict[str, NDArray[Any]], dict[str, Any]]],
    listed: Rowed,
    reading_s: float,
) -> Crossed:
    """Return all figures."""
    data, classes = work.data, len(listed.labels)
    models, answers = [], {}
    for key in ("ours", *work.rows):
        name = NAMES[key]
        whole = np.zeros((len(listed.label), classes), dtype=np.float32)
        for fold, (arrays, _) in zip(rounds, done, strict=True):
            whole[fold.test] = arrays[key]
        answers[name] = whole
        cpu_s = sum(float(words["cpu_s"][key]) for _, words in done)
        models.append(folds.judge(listed, rounds, name, whole, cpu_s, request.seed))
    others = [name for name in answers if name != OURS]
    how = replace(work.recipe, gesture=work.course).sentences(gesture=True, location=False)
    count = np.bincount(listed.label)
    return Crossed(
        command=request.command,
        software=software(),
        data=_sentence(data, listed),
        how=(*how, *SOUND[: request.sound], *work.symmetry.sentences(listed.labels)),
        labels=listed.labels,
        majority=float(count.max() / count.sum()),
        windows=len(listed.label),
        stretches=int(listed.stretch[-1]) + 1,
        people=listed.people,
        held=tuple(_names(listed.people, listed.person[fold.test]) for fold in rounds),
        chosen=tuple(str(words["chosen"]) for _, words in done) if request.choose else (),
        kinds=listed.kinds if len(listed.kinds) > 1 else (),
        touched=tuple(np.bincount(listed.touched, minlength=len(folds.TOUCHED)).tolist()),
        models=tuple(models),
        gains=tuple(
            folds.gain(listed, answers[OURS], name, answers[name], request.seed) for name in others
        ),
        reading_cpu_s=reading_s,
        cpu_minutes=(reading_s + sum(model.cpu_s for model in models)) / 60.0,
    )


def _names(people: Sequence[str], person: NDArray[np.int64]) -> str:
    return ", ".join(people[number] for number in np.unique(person).tolist())
