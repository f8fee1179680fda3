"""Peers: other models trained on the same recordings, so that ours has something to beat.

    same_data   our recipe, on the peers' recordings
    paper       the paper's networks by the paper's recipe (section 4.2), with a fifth of the steps
                of its 500 epochs of 17,500 windows and 2,000 of 10,000 images: more make its
                score on unseen sessions worse, and take an hour
    logistic    logistic regression on the window; ridge regression for places
    forest      a random forest of 100 trees, for both
    mlp         two dense layers on the window, trained as ours
    gru         a gated recurrent unit over its images, trained as ours

All but the paper's see what our networks see; thresholds are chosen on development streams.
Networks are trained once, and kept under a hash of recordings, recipe and code.
"""

import hashlib
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor
from sklearn.linear_model import LogisticRegression, Ridge
from torch import Tensor, nn

from controller.recognition.images.frames import PreprocessSettings
from controller.shared.aliases import Say
from models.data import load, splits, touch_images
from models.data.augment import Symmetry
from models.data.load import Data
from models.data.recipe import DEFAULT, NEVER_S, PAPER, Recipe
from models.evaluation import scores
from models.training import checkpoint
from models.training.gesture_task import GestureTask, train_gestures
from models.training.location_task import train_locations
from models.training.loop import TrainingJob, fit, prepare_torch
from models.training.networks import GAIN, gesture_net, location_net

from .results import code_hash

NAMES: Final = ("same_data", "paper", "logistic", "forest", "mlp", "gru")
PAPER_WINDOWS, PAPER_IMAGES = 17_500, 10_000  # paper, section 4.2
PAPER_SHARE: Final = 5  # one in so many of its steps
MANY: Final = 100_000  # epochs: no limit
SEED: Final = 0
TREES: Final = 100
# Whose change changes what is learned.
CODE: Final = (
    "controller.recognition.images.preprocess", "controller.recognition.touch_position",
    "models.data.augment", "models.data.examples", "models.data.touch_images",
    "models.training.gesture_task", "models.training.location_task", "models.training.loop",
    "models.training.networks", "tests.benchmarks.peers",
)  # fmt: skip
AT_ONCE: Final = 256  # questions that a network is asked together

Rows = NDArray[np.float32]
Answer = Callable[[Rows], Rows]  # many questions -> many answers
Weights = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class Peer:
    """Another model."""

    name: str  # of `NAMES`
    settings: PreprocessSettings  # how it sees frames
    averaged: bool  # its places are told from the image of a touch; else from each frame's
    gesture: Answer  # windows -> probabilities
    place: Answer | None  # images -> places, grid units; None: it tells none


class Gru(nn.Module):
    """A gated recurrent unit over the images of a window."""

    def __init__(self, window: int, taxels: int, classes: int) -> None:
        super().__init__()
        self.gru = nn.GRU(taxels, 64, batch_first=True)
        self.out = nn.Linear(64, classes)

    def forward(self, windows: Tensor) -> Tensor:
        states, _ = self.gru((windows.flatten(2) - 1.0) * GAIN)
        return torch.as_tensor(self.out(states[:, -1]))


class Mlp(nn.Module):
    """Two dense layers on a whole window."""

    def __init__(self, window: int, taxels: int, classes: int) -> None:
        super().__init__()
        self.dense1, self.dense2 = nn.Linear(window * taxels, 128), nn.Linear(128, 64)
        self.out = nn.Linear(64, classes)

    def forward(self, windows: Tensor) -> Tensor:
        x = torch.relu(self.dense1((windows.flatten(1) - 1.0) * GAIN))
        return torch.as_tensor(self.out(torch.relu(self.dense2(x))))


NETS: Final[dict[str, Callable[[int, int, int], nn.Module]]] = {"gru": Gru, "mlp": Mlp}


class Brief(Recipe):
    """The paper's recipe where sessions begin with three quiet seconds, not with ten."""

    def settings(self, rate_hz: float, window: int) -> PreprocessSettings:
        """Return how images are made: rest is the mean of the first two seconds, and stays."""
        plain = PreprocessSettings(rate_hz=rate_hz, window=window)
        return replace(plain, start_s=2.0, settle_s=NEVER_S, adopt_s=NEVER_S)


def train(name: str, paths: Sequence[Path], cache: Path, say: Say, *, again: bool = False) -> Peer:
    """Return a peer: the network that is kept, or one that is trained now."""
    recipe = _recipe(name)
    data = _data(tuple(paths), paper=name == "paper")
    if name in ("logistic", "forest"):
        return Peer(name, data.settings, recipe.averaged, *_learn_plain(name, data))
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
        saved = _learn(name, recipe, data, folder), {}
        checkpoint.save(kept, *saved)
        shutil.rmtree(folder)
    answers = _answers(name, recipe, data, saved[0])
    return Peer(name, data.settings, recipe.averaged, *answers)


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


@lru_cache(maxsize=2)
def _data(paths: tuple[Path, ...], *, paper: bool) -> Data:
    """Return the recordings as the paper's peer sees them, or as all others do."""
    return load.read(paths, _recipe("paper" if paper else "same_data"), "auto", lambda _: None)


def _learn(name: str, recipe: Recipe, data: Data, folder: Path) -> Weights:
    """Train networks; return their weights."""
    split = splits.split_windows(data, "session", SEED)
    work = TrainingJob(data, split, recipe, SEED, torch.device("cpu"), folder)
    if name in NETS:
        return _learn_net(name, work)
    _, net = train_gestures(work)
    _, place = train_locations(work, touch_images.find(data.examples, recipe.averaged, SEED))
    return {**checkpoint.pack("gesture", net.state_dict()),
            **checkpoint.pack("place", place.state_dict())}  # fmt: skip


def _learn_net(name: str, work: TrainingJob) -> Weights:
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


def _learn_plain(name: str, data: Data) -> tuple[Answer, Answer]:
    """Train what has no steps: on the windows as they are, with as much null as the others see."""
    examples, split = data.examples, splits.split_windows(data, "session", SEED)
    rng = np.random.default_rng(SEED)
    ends = examples.ends[split.windows.train]
    null = examples.label[ends] == 0
    keep = ~null | (rng.random(len(ends)) < DEFAULT.gesture.null_share)
    found = touch_images.find(examples, True, SEED)
    mine = touch_images.split_touches(split, examples, found, SEED).train
    if name == "logistic":
        classifier, regressor = LogisticRegression(max_iter=300), Ridge(1.0)
    else:
        options = {"n_estimators": TREES, "min_samples_leaf": 5, "random_state": SEED}
        classifier = RandomForestClassifier(**options)
        regressor = RandomForestRegressor(**options, max_features=0.33)
    classifier.fit(_flat(examples.windows(ends[keep])), examples.label[ends[keep]])
    regressor.fit(_flat(found.images[mine]), found.place[mine])
    return partial(_asked, classifier.predict_proba), partial(_asked, regressor.predict)


def _answers(
    name: str, recipe: Recipe, data: Data, weights: Weights
) -> tuple[Answer, Answer | None]:
    """Return what trained networks answer: to windows, and to images."""
    window, classes = data.examples.window, len(data.vocabulary.labels)
    rows, columns = data.examples.images.shape[1:]
    net: nn.Module
    if name in NETS:
        net = NETS[name](window, rows * columns, classes)
        net.load_state_dict(checkpoint.unpack("gesture", weights))
        return partial(_ask, net.eval(), float(weights["hot"])), None
    course = recipe.gesture
    net = gesture_net((window, rows, columns), classes, replace(course, normalised=False))
    net.load_state_dict(checkpoint.unpack("gesture", weights))
    there = location_net((rows, columns), replace(recipe.location, normalised=False))
    there.load_state_dict(checkpoint.unpack("place", weights))
    return partial(_ask, net.eval(), 1.0), partial(_ask, there.eval(), 0.0)


def _ask(net: nn.Module, hot: float, questions: Rows) -> Rows:
    """Return probabilities of a network's logits at a temperature; at 0 its answers as they are."""
    with torch.no_grad():
        parts = [
            net(torch.from_numpy(questions[i : i + AT_ONCE]))
            for i in range(0, max(1, len(questions)), AT_ONCE)
        ]
        together = torch.cat(parts)
        answers = torch.softmax(together / hot, dim=1) if hot else together
    return np.asarray(answers.numpy(), dtype=np.float32)


def _asked(model: Callable[[Rows], Rows], questions: Rows) -> Rows:
    """Return what a model of scikit-learn answers."""
    return np.asarray(model(_flat(questions)), dtype=np.float32)


def _flat(images: NDArray[np.floating]) -> Rows:
    return np.asarray(GAIN * (images.reshape(len(images), -1) - 1.0), dtype=np.float32)
