"""Cross-validation over people or sessions: each window is named by networks that never saw them.

In each fold CNN-3D is trained on the others by the default recipe, with fewer steps. Nothing that
is judged decides anything: the scale of the signal, the symmetries of undeclared gestures and the
epoch that is kept are chosen on the fold's own people.
"""

import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.recognition.images.scale import FIRM
from controller.recordings.recording import software
from controller.shared.aliases import Index, Say
from controller.shared.errors import count
from models.data import load, splits
from models.data.augment import Symmetry
from models.data.examples import Choice, Examples, refuse_test_seed
from models.data.load import Data
from models.data.recipe import DEFAULT, FOLD_STEPS, NetworkRecipe
from models.data.splits import Fold, Parts
from models.evaluation import scores
from models.formatting import duration
from models.results import storage
from models.studies import fold_statistics, trajectory_baseline
from models.studies.fold_statistics import CrossValidation, Windows
from models.training import checkpoint, symmetry_search
from models.training.gesture_task import GestureTask
from models.training.loop import fit, prepare_torch

Answers = dict[str, NDArray[np.float32]]  # of each model, (windows of the fold, classes)
Done = tuple[Answers, dict[str, Any]]  # "cpu_s" of each model; "chosen", in words

MOST_EPOCHS: Final = 1000  # no limit in practice
# Passes over the examples from which on a network may learn people by heart: some are held out,
# and the epoch that is best for them is kept.
OFTEN: Final = 12
PATIENCE: Final = 0.25  # epochs without a better one before training stops, share of all
FIRM_SHARE: Final = 0.75  # quantile of the strength of touched images: a firm touch
NAMES: Final = {"ours": "CNN-3D", "trees": "trajectory trees"}
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
    every: bool = False  # take recordings that fail the check
    declared: bool = False  # try no symmetries that are not declared
    seed: int = 0  # of everything random
    command: str = ""  # command line


def cross(request: Request, say: Say) -> CrossValidation:
    """Train and judge every fold, and write the results; or raise ValueError, one sentence."""
    begun = time.process_time()
    refuse_test_seed(request.seed, "this cross-validation")
    storage.target(request.out)
    device = prepare_torch(request.seed)
    data = load.read(
        request.paths, DEFAULT, request.labels, say, window=request.window, every=request.every
    )
    for note in data.notes:
        say(note)
    course = replace(
        DEFAULT.gesture, patience=PATIENCE, epochs=0, steps=request.steps, limits=(1, MOST_EPOCHS)
    )
    study = _Study(request, data, course, device, say)
    reading_s = time.process_time() - begun
    say(f"{study.describe()}; {len(study.folds)} folds by {request.by}")
    done = [*study.judged()]
    found = _results(study, done, reading_s)
    storage.write_json(request.out, found)
    shutil.rmtree(study.folder)
    return found


@dataclass(frozen=True, slots=True)
class Own:
    """Choices of a fold, made on its own people: scale and symmetries."""

    data: Data  # of all people, to the fold's scale
    inner: Fold | None  # a fold of its own people; None if it has only one
    words: str = ""  # the symmetries found; "" if they are declared

    @property
    def symmetry(self) -> Symmetry:
        """The symmetries of the gestures."""
        return Symmetry.of(self.data.vocabulary, *self.data.examples.images.shape[1:])


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
        self.rows = trajectory_baseline.features(examples)
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
        """Train both models on a fold."""
        begun = time.process_time()
        label, classes = self.windows.label[fold.train], len(self.windows.labels)
        own = self._own(fold)
        ours, trees = NAMES
        answers = {ours: self._train(number, fold, own)}
        cpu_s = {ours: time.process_time() - begun}
        begun = time.process_time()
        plain = trajectory_baseline.train(self.rows[fold.train], label, self.request.seed)
        answers[trees] = trajectory_baseline.predict(plain, self.rows[fold.test], classes)
        cpu_s[trees] = time.process_time() - begun
        return answers, {"cpu_s": cpu_s, "chosen": f"({own.words})" * bool(own.words)}

    def _own(self, fold: Fold) -> Own:
        """Return the choices of a fold's own people: scale, and symmetries that help them."""
        data, inner = self.data, None
        ends = data.examples.ends
        if len(np.unique(self.group[ends[fold.train]])) > 1:
            inner = fold_statistics.within(fold, ends, data.examples.window, self.group)
        if data.settings.normalise == "difference":
            data = replace(data, examples=scaled(data.examples, ends[fold.train]))
        if not (self.searched and inner):
            return Own(data, inner)
        judge = symmetry_search.trial(
            data, inner.train, inner.test, self.course, self.request.seed, self.device
        )
        found = symmetry_search.search(judge, data.vocabulary)
        self.say(f"  among the people of fold {fold.name}: {found.words}")
        return Own(replace(data, vocabulary=found.vocabulary), inner, found.words)

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
        fit(task, seed, self.folder / f"fold-{number}-last.npz")
        logits, _ = task.answers(examples.ends[fold.test])
        return scores.softmax(logits.cpu().numpy()).astype(np.float32)


def scaled(examples: Examples, ends: Index) -> Examples:
    """Return examples in which a firm touch at some frames (n,) is as strong as on the orb."""
    ends = ends[examples.label[ends] > 0]
    strength = np.abs(examples.images[ends] - 1.0).mean(axis=(1, 2))
    session = examples.session[ends]
    firm = [np.quantile(strength[session == one], FIRM_SHARE) for one in np.unique(session)]
    usual = float(np.median(firm)) if firm else 0.0
    if not usual > 0.0:
        return examples
    signal = np.float32(FIRM / usual) * (examples.images - np.float32(1.0))
    return replace(examples, images=signal + np.float32(1.0))


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
        data.vocabulary.labels,
        tuple(row.user or Path(row.path).stem for row in rows),
    )


def _results(study: _Study, done: Sequence[Done], reading_s: float) -> CrossValidation:
    """Return all results."""
    request, windows, folds = study.request, study.windows, study.folds
    answers, models = [], []
    for key, name in NAMES.items():
        whole = np.zeros((len(windows.label), len(windows.labels)), dtype=np.float32)
        for fold, (own, _) in zip(folds, done, strict=True):
            whole[fold.test] = own[key]
        cpu_s = sum(float(words["cpu_s"][key]) for _, words in done)
        models.append(fold_statistics.judge(windows, folds, name, whole, cpu_s, request.seed))
        answers.append(whole)
    how = replace(DEFAULT, gesture=study.course).sentences(gesture=True, location=False)
    people = (np.unique(windows.person[fold.test]).tolist() for fold in folds)
    classes = np.bincount(windows.label)
    chosen = tuple(str(words["chosen"]) for _, words in done)
    return CrossValidation(
        command=request.command,
        software=software(),
        data=study.describe(),
        how=(*how, *study.sentences()),
        labels=windows.labels,
        majority=float(classes.max() / classes.sum()),
        windows=len(windows.label),
        stretches=int(windows.stretch[-1]) + 1,
        people=windows.people,
        held=tuple(", ".join(windows.people[one] for one in some) for some in people),
        chosen=chosen if any(chosen) else (),
        models=tuple(models),
        gain=fold_statistics.gain(windows, answers[0], answers[1], request.seed),
        reading_cpu_s=reading_s,
        cpu_minutes=(reading_s + sum(model.cpu_s for model in models)) / 60.0,
    )
