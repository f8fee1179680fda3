"""Peers: other models trained on the same recordings, so that ours has something to beat.

    same_data   our recipe, on the peers' recordings
    paper       the paper's networks by the paper's recipe (section 4.2), with a fifth of the steps
                of its 500 epochs of 17,500 windows and 2,000 of 10,000 images: more make its
                score on unseen sessions worse, and take an hour
    logistic    logistic regression on the window; ridge regression for places
    forest      a random forest of 100 trees, for both
    mlp         two dense layers on the window, trained as ours
    gru         a gated recurrent unit over its images, trained as ours

All but the paper's see what our networks see. Each is trained once, its thresholds are chosen on
development streams, and it is kept under a hash of recordings, recipe and code.
"""

import hashlib
import shutil
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor
from sklearn.linear_model import LogisticRegression, Ridge
from torch import nn

from controller.recognition.frames import PreprocessSettings
from models.data import load, splits, touch_images
from models.data.augment import Symmetry
from models.data.load import Data
from models.data.recipe import DEFAULT, NEVER_S, PAPER, Recipe
from models.evaluation import scores
from models.results.training import HeldOutScore
from models.training import checkpoint
from models.training.gesture_task import GestureTask, train_gestures
from models.training.location_task import train_locations
from models.training.loop import TrainingJob, fit, prepare_torch
from models.training.networks import GAIN, gesture_net, location_net

from ..results import code_hash
from .forest import Forest
from .peer_nets import NETS, ask

NAMES: Final = ("same_data", "paper", "logistic", "forest", "mlp", "gru")
PAPER_WINDOWS, PAPER_IMAGES = 17_500, 10_000  # paper, section 4.2
PAPER_SHARE: Final = 5  # one in so many of its steps
MANY: Final = 100_000  # epochs: no limit
SEED: Final = 0
TREES: Final = 100
# Whose change changes what is learned.
CODE: Final = (
    "controller.recognition.preprocess", "controller.recognition.touch_position",
    "models.data.augment", "models.data.examples", "models.training.loop",
    "tests.benchmarks.baselines.forest", "models.training.gesture_task",
    "models.training.location_task", "models.training.networks",
    "tests.benchmarks.baselines.peer_nets", "tests.benchmarks.baselines.peers",
    "models.data.touch_images",
)  # fmt: skip

Rows = NDArray[np.float32]
Answer = Callable[[Rows], Rows]  # many questions -> many answers
Say = Callable[[str], None]
Saved = tuple[dict[str, NDArray[Any]], dict[str, Any]]  # arrays, and words as JSON has them


@dataclass(frozen=True, slots=True, eq=False)
class Peer:
    """Another model."""

    name: str  # of `NAMES`
    settings: PreprocessSettings  # how it sees frames
    averaged: bool  # its places are told from the image of a touch; else from each frame's
    gesture: Answer  # windows -> probabilities
    place: Answer | None  # images -> places, grid units; None: it tells none
    # its score on unseen sessions beside that on windows at random; None: unknown
    honesty: HeldOutScore | None


class Brief(Recipe):
    """The paper's recipe where sessions begin with three quiet seconds, not with ten."""

    def settings(self, rate_hz: float, window: int) -> PreprocessSettings:
        """Return how images are made: rest is the mean of the first two seconds, and stays."""
        plain = PreprocessSettings(rate_hz=rate_hz, window=window)
        return replace(plain, start_s=2.0, settle_s=NEVER_S, adopt_s=NEVER_S)


def train(name: str, paths: Sequence[Path], cache: Path, say: Say, *, again: bool = False) -> Peer:
    """Return a peer: the one that is kept, or trained now."""
    recipe = _recipe(name)
    digest = hashlib.sha256()
    for path in sorted(file for folder in paths for file in folder.rglob("[!.]*.npz")):
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    digest.update(repr((name, recipe, SEED)).encode() + code_hash(CODE))
    kept = cache / f"peer-{name}-{digest.hexdigest()[:16]}.npz"
    saved = None if again else checkpoint.load(kept)
    if saved is None:
        say(f"training {name}, once; it is kept in {cache}")
        prepare_torch(SEED)
        folder = cache / f"{kept.stem}.training"  # an interrupted training goes on from here
        if again:
            shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        saved = _learn(name, recipe, _data(tuple(paths), paper=name == "paper"), folder)
        checkpoint.save(kept, *saved)
        shutil.rmtree(folder)
    return _peer(name, recipe, saved)


def _recipe(name: str) -> Recipe:
    """Return how a peer is trained; the paper's in as many steps, whatever the recordings."""
    if name != "paper":
        return DEFAULT
    courses = [
        replace(
            course,
            epochs=0,
            steps=course.epochs * size // course.batch // PAPER_SHARE,
            limits=(1, MANY),
        )
        for course, size in ((PAPER.gesture, PAPER_WINDOWS), (PAPER.location, PAPER_IMAGES))
    ]
    own = {field.name: getattr(PAPER, field.name) for field in fields(PAPER)}
    return Brief(**{**own, "gesture": courses[0], "location": courses[1]})


@lru_cache(maxsize=1)
def _data(paths: tuple[Path, ...], *, paper: bool) -> Data:
    """Return the recordings as the paper's peer sees them, or as all others do."""
    return load.read(paths, _recipe("paper" if paper else "same_data"), "auto", lambda _: None)


def _learn(name: str, recipe: Recipe, data: Data, folder: Path) -> Saved:
    split = splits.split_windows(data, "session", SEED)
    work = TrainingJob(data, split, recipe, SEED, torch.device("cpu"), folder)
    shape = data.examples.window, *data.examples.images.shape[1:], len(data.vocabulary.labels)
    words: dict[str, Any] = {"settings": asdict(data.settings), "shape": shape}
    if name in ("same_data", "paper"):
        result, net = train_gestures(work)
        _, place = train_locations(work, touch_images.find(data.examples, recipe.averaged, SEED))
        words["honesty"] = asdict(result.honesty)
        words["curve"] = [[epoch.train, epoch.check, epoch.random] for epoch in result.epochs]
        arrays = {**checkpoint.pack("gesture", net.state_dict()),
                  **checkpoint.pack("place", place.state_dict())}  # fmt: skip
        return arrays, words
    if name in ("mlp", "gru"):
        return _learn_net(name, work), words
    return _learn_plain(name, work), words


def _learn_net(name: str, work: TrainingJob) -> dict[str, NDArray[Any]]:
    """Train another network exactly as ours is: same windows, variations, steps and rates."""
    data, course = work.data, work.recipe.gesture
    shape = data.examples.images.shape[1:]
    symmetry = Symmetry.of(data.vocabulary, *shape)
    classes = len(data.vocabulary.labels)
    task = GestureTask(
        data.examples, work.split.windows, classes, symmetry, course, torch.device("cpu")
    )
    torch.manual_seed(SEED)
    other = NETS[name](data.examples.window, shape[0] * shape[1], classes)
    task.net = other  # type: ignore[assignment]
    keep = None if work.folder is None else work.folder / f"{name}.npz"
    fit(task, SEED, keep)
    logits, label = task.answers(task.ends["check"])
    hot = scores.temperature(logits.numpy(), label.numpy())
    return {**checkpoint.pack("gesture", task.net.state_dict()), "hot": np.array(hot)}


def _learn_plain(name: str, work: TrainingJob) -> dict[str, NDArray[Any]]:
    """Train what has no steps: on the windows as they are, with as much null as the others see."""
    data, examples = work.data, work.data.examples
    rng = np.random.default_rng(SEED)
    ends = examples.ends[work.split.windows.train]
    null = examples.label[ends] == 0
    keep = ~null | (rng.random(len(ends)) < work.recipe.gesture.null_share)
    windows, label = examples.windows(ends[keep]), examples.label[ends[keep]]
    found = touch_images.find(examples, True, SEED)
    mine = touch_images.split_touches(work.split, data.examples, found, SEED).train
    images, places = found.images[mine], found.place[mine]
    if name == "logistic":
        line = LogisticRegression(max_iter=300).fit(_flat(windows), label)
        ridge = Ridge(1.0).fit(_flat(images), places)
        parts = {"weight": line.coef_, "bias": line.intercept_,
                 "place.weight": ridge.coef_, "place.bias": ridge.intercept_}  # fmt: skip
        return {key: np.asarray(value, dtype=np.float32) for key, value in parts.items()}
    options = {"n_estimators": TREES, "min_samples_leaf": 5, "random_state": SEED}
    trees = RandomForestClassifier(**options).fit(_flat(windows), label)
    where = RandomForestRegressor(**options, max_features=0.33).fit(_flat(images), places)
    return {
        **{f"gesture.{key}": array for key, array in Forest.of(trees).arrays().items()},
        **{f"place.{key}": array for key, array in Forest.of(where).arrays().items()},
    }


def _peer(name: str, recipe: Recipe, saved: Saved) -> Peer:
    arrays, words = saved
    settings = PreprocessSettings(**words["settings"])
    honesty = HeldOutScore(**words["honesty"]) if "honesty" in words else None
    gesture, place = _answers(name, recipe, arrays, words)
    return Peer(name, settings, recipe.averaged, gesture, place, honesty)


def _answers(
    name: str, recipe: Recipe, arrays: dict[str, NDArray[Any]], words: dict[str, Any]
) -> tuple[Answer, Answer | None]:
    """Return what a saved peer answers: to windows, and to images."""
    if name == "logistic":
        place = partial(_line, arrays["place.weight"], arrays["place.bias"])
        return partial(_softmax_line, arrays["weight"], arrays["bias"]), place
    if name == "forest":
        trees, where = (Forest.from_arrays(_named(arrays, one)) for one in ("gesture", "place"))
        return lambda rows: trees(_flat(rows)), lambda rows: where(_flat(rows))
    window, rows, columns, classes = (int(size) for size in words["shape"])
    net: nn.Module
    if name in ("mlp", "gru"):
        net = NETS[name](window, rows * columns, classes)
        net.load_state_dict(checkpoint.unpack("gesture", arrays))
        return partial(ask, net.eval(), float(arrays["hot"])), None
    course = recipe.gesture
    net = gesture_net((window, rows, columns), classes, replace(course, normalised=False))
    net.load_state_dict(checkpoint.unpack("gesture", arrays))
    there = location_net((rows, columns), replace(recipe.location, normalised=False))
    there.load_state_dict(checkpoint.unpack("place", arrays))
    return partial(ask, net.eval(), 1.0), partial(ask, there.eval(), 0.0)


def _flat(images: NDArray[np.floating]) -> Rows:
    return np.asarray(GAIN * (images.reshape(len(images), -1) - 1.0), dtype=np.float32)


def _line(weight: Rows, bias: Rows, questions: Rows) -> Rows:
    return np.asarray(_flat(questions) @ weight.T + bias, dtype=np.float32)


def _softmax_line(weight: Rows, bias: Rows, questions: Rows) -> Rows:
    return scores.softmax(_line(weight, bias, questions)).astype(np.float32)


def _named(arrays: dict[str, NDArray[Any]], prefix: str) -> dict[str, NDArray[Any]]:
    return {k.partition(".")[2]: v for k, v in arrays.items() if k.startswith(f"{prefix}.")}
