"""Lower bounds of I(window; y): how much less a held-out label surprises who has seen the window.

Whatever q(y | window) is, I >= H(y) - E[-log q(y | window)], if q has not seen the label. So the
bound holds on the sessions that were held out, and it is what survives to another day; a better
classifier makes it tighter. Probabilities are scaled by a temperature that is chosen on a further
session (D. Barber, F. Agakov, The IM algorithm, NIPS 2003, for the bound; C. Guo et al., On
calibration of modern neural networks, ICML 2017, for the temperature).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from controller.bundles import vocabulary
from models.data.augment import Augmentation, Symmetry
from models.evaluation import bootstrap, scores
from models.results.figure import Figure
from models.studies.information.windows import GAIN, Taken

HIDDEN: Final = (96, 48)
BATCH: Final = 128
EPOCHS: Final = 24
RATE: Final = 2e-3
DECAY: Final = 1e-3  # of weights
DROPOUT: Final = 0.2
VARIED: Final = Augmentation(dropout=0.0, electrode=0.0)
FEWEST: Final = 40  # gestures by which their temperature is chosen
BLOCKS: Final = 5  # of time, where there is only one session

Kind = str  # "linear", "mlp"
Logits = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Fold:
    """What is learned from, what chooses epoch and temperature, and what is tested."""

    train: NDArray[np.bool_]
    check: NDArray[np.bool_]
    test: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """What held-out windows were taken for.

    Attributes:
        raw: Logarithms of the probabilities, (n, classes); NaN where nothing was tested.
        scaled: The same with the temperature.
        hot: Another temperature, that of whole gestures, (n,).
    """

    raw: Logits
    scaled: Logits
    hot: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Shape:
    """What a question is like, so that it can be turned and mirrored.

    Attributes:
        grid: Rows and columns of taxels.
        symmetry: What may be done to each class.
    """

    grid: tuple[int, int]
    symmetry: Symmetry

    @classmethod
    def of(cls, taken: Taken) -> "Shape":
        """Return what is declared by the gestures that ship; of others nothing is known."""
        words = vocabulary.of(taken.labels)
        return cls(taken.grid, Symmetry.of(words, *taken.grid))


def folds(taken: Taken) -> list[Fold]:
    """Return a fold for each session; of one session alone, blocks of time with gaps.

    Of more than two sessions one chooses epoch and temperature; of two, the last fifth of the one
    that is learned from.
    """
    names = np.unique(taken.session)
    if len(names) == 1:
        return _by_time(taken)
    made = []
    for place, name in enumerate(names):
        test = taken.session == name
        if len(names) > 2:
            check = taken.session == names[(place + 1) % len(names)]
        else:
            own = np.flatnonzero(~test)
            last = taken.frame[own] > np.quantile(taken.frame[own], 0.8)
            check = np.zeros(len(test), dtype=np.bool_)
            check[own[last]] = True
        made.append(Fold(~test & ~check, check, test))
    return made


def _by_time(taken: Taken) -> list[Fold]:
    """Cut one session into blocks; what is closer than two windows to another block is left out."""
    at = taken.frame - taken.frame.min()
    length = (at.max() + 1) / BLOCKS
    block = np.minimum(at // length, BLOCKS - 1).astype(np.int64)
    inner = np.minimum(at - block * length, (block + 1) * length - at) > taken.x.shape[1]
    return [
        Fold(
            (block != one) & (block != (one + 1) % BLOCKS) & inner,
            (block == (one + 1) % BLOCKS) & inner,
            block == one,
        )
        for one in range(BLOCKS)
    ]


def told(
    taken: Taken,
    kind: Kind = "mlp",
    seed: int = 0,
    epochs: int = EPOCHS,
    shape: Shape | None = None,
    most: int = 0,
    batch: int = BATCH,
) -> Told:
    """Train on all sessions but one, and ask about that one; each in turn.

    Args:
        taken: Windows of several sessions.
        kind: "mlp", or "linear": one layer, logistic regression.
        seed: Of weights and order.
        epochs: At most; the one that surprises the session that checks least is kept.
        shape: How examples may be varied (`Shape.of`); None: they stay as they are.
        most: So many sessions are tested at most; 0: all.
        batch: Windows of a step.
    """
    size = (len(taken.y), len(taken.labels))
    raw, scaled, heat = np.full(size, np.nan), np.full(size, np.nan), np.full(size[0], np.nan)
    flat = taken.x.reshape(len(taken.x), -1)
    for number, fold in enumerate(folds(taken)[: most or None]):
        if not (fold.train.any() and fold.check.any() and fold.test.any()):
            continue
        net = fitted(
            (flat[fold.train], taken.y[fold.train]),
            (flat[fold.check], taken.y[fold.check]),
            size[1],
            kind,
            seed + number,
            epochs,
            shape,
            batch,
        )
        asked = net(flat[fold.check])
        hot = scores.temperature(asked, taken.y[fold.check])
        logits = net(flat[fold.test])
        raw[fold.test] = _log_softmax(logits)
        scaled[fold.test] = _log_softmax(logits / hot)
        y, sure = of_gestures(taken.pick(fold.check), _log_softmax(asked / hot))
        heat[fold.test] = _of_few(y, sure)
    return Told(raw, scaled, heat)


def rescaled(taken: Taken, probabilities: NDArray[np.floating]) -> Told:
    """Return what a classifier from elsewhere said, each day's temperatures from the others.

    Args:
        taken: Windows that it never learned from.
        probabilities: What it said of them, (n, classes).
    """
    raw = np.log(np.maximum(probabilities.astype(np.float64), 1e-12))
    scaled, heat = raw.copy(), np.ones(len(raw))
    for name in np.unique(taken.session):
        own = taken.session == name
        if own.all():
            break
        scaled[own] = _log_softmax(raw[own] / scores.temperature(raw[~own], taken.y[~own]))
        y, sure = of_gestures(taken.pick(~own), raw[~own])
        heat[own] = _of_few(y, sure)
    return Told(raw, scaled, heat)


def windows(taken: Taken, log_p: Logits) -> Figure:
    """Return H(y) - cross-entropy over the windows, nats."""
    own = log_p[np.arange(len(taken.y)), taken.y]
    return bootstrap.event_gain(own, taken.y, taken.event)


def gestures(taken: Taken, found: Told) -> Figure:
    """Return the same over whole gestures, null aside: nats per gesture.

    A gesture's probabilities are the mean over its windows, null left out. Where a gesture begins
    and ends is taken as known, so this is what its shape says, not what playing is worth.
    """
    y, sure = of_gestures(taken, found.scaled)
    use = (taken.y > 0) & np.isfinite(found.scaled[:, 0])
    _, first = np.unique(taken.event[use], return_index=True)
    hot = found.hot[use][first][:, None]
    log_p = _log_softmax(np.log(np.maximum(sure, 1e-12)) / hot)
    return bootstrap.event_gain(log_p[np.arange(len(y)), y], y, np.arange(len(y)))


def of_gestures(taken: Taken, log_p: Logits) -> tuple[NDArray[np.int64], Logits]:
    """Return each tested gesture's class, from 0, and probabilities, (gestures, classes - 1)."""
    use = (taken.y > 0) & np.isfinite(log_p[:, 0])
    _, number = np.unique(taken.event[use], return_inverse=True)
    p = np.zeros((int(number.max(initial=-1)) + 1, log_p.shape[1] - 1))
    np.add.at(p, number, np.exp(log_p[use, 1:]))
    y = np.zeros(len(p), dtype=np.int64)
    y[number] = taken.y[use] - 1
    p /= np.maximum(p.sum(axis=1, keepdims=True), 1e-300)
    return y, p


def fitted(
    train: tuple[NDArray[np.float32], NDArray[np.int64]],
    check: tuple[NDArray[np.float32], NDArray[np.int64]],
    classes: int,
    kind: Kind = "mlp",
    seed: int = 0,
    epochs: int = EPOCHS,
    shape: Shape | None = None,
    batch: int = BATCH,
) -> Callable[[NDArray[np.float32]], Logits]:
    """Train a network, and return what answers questions (n, d) with logits (n, classes).

    Args:
        train: Questions (n, d) and classes (n,) to learn from.
        check: Those that choose the epoch.
        classes: How many there are.
        kind: "mlp" or "linear".
        seed: Of weights, order and variations.
        epochs: At most.
        shape: How examples may be varied; None: they are no images, and stay as they are.
        batch: Examples of a step.
    """
    torch.set_num_threads(1)
    generator = torch.Generator().manual_seed(seed)
    torch.manual_seed(seed)
    inside, label = (torch.from_numpy(np.ascontiguousarray(one)) for one in train)
    asked, truth = (torch.from_numpy(np.ascontiguousarray(one)) for one in check)
    middle, spread = inside.mean(dim=0), inside.std() + 1e-6
    net = _net(inside.shape[1], classes, HIDDEN if kind == "mlp" else ())
    optimizer = torch.optim.AdamW(net.parameters(), RATE, weight_decay=DECAY)
    steps = epochs * -(-len(label) // batch)
    falling = torch.optim.lr_scheduler.OneCycleLR(optimizer, 2 * RATE, total_steps=steps)
    best, least = net.state_dict(), np.inf
    for _ in range(epochs):
        net.train()
        order = torch.randperm(len(label), generator=generator)
        for part in torch.split(order, batch):
            asks, means = inside[part], label[part]
            if shape is not None:
                asks, means = _varied(asks, means, shape, generator)
            loss = nn.functional.cross_entropy(net((asks - middle) / spread), means)
            optimizer.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            falling.step()
        net.eval()
        with torch.no_grad():
            surprise = float(nn.functional.cross_entropy(net((asked - middle) / spread), truth))
        if surprise < least:
            least = surprise
            best = {name: value.clone() for name, value in net.state_dict().items()}
    net.load_state_dict(best)
    net.eval()

    def ask(questions: NDArray[np.float32]) -> Logits:
        with torch.no_grad():
            answers = net((torch.from_numpy(questions) - middle) / spread)
        return np.asarray(answers.numpy(), dtype=np.float64)

    return ask


def _varied(
    asks: Tensor, means: Tensor, shape: Shape, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Turn, mirror and disturb examples as their gestures allow."""
    z = 1.0 + asks.reshape(len(asks), -1, *shape.grid) / GAIN
    z, means = VARIED.windows(z, means, shape.symmetry, generator)
    return (GAIN * (z - 1.0)).reshape(len(asks), -1), means


def _net(inputs: int, outputs: int, hidden: Sequence[int]) -> nn.Sequential:
    layers: list[nn.Module] = []
    for size in hidden:
        layers += [nn.Linear(inputs, size), nn.ReLU(), nn.Dropout(DROPOUT)]
        inputs = size
    return nn.Sequential(*layers, nn.Linear(inputs, outputs))


def _of_few(y: NDArray[np.int64], sure: Logits) -> float:
    """Return the temperature of gestures; of too few to choose one by, they stay as they are."""
    if len(y) < FEWEST:
        return 1.0
    return scores.temperature(np.log(np.maximum(sure, 1e-12)), y)


def _log_softmax(logits: Logits) -> Logits:
    return np.asarray(np.log(np.maximum(scores.softmax(logits), 1e-12)))


def single(taken: Taken) -> Taken:
    """Return the windows' last frames only."""
    return replace(taken, x=taken.x[:, -1:])
