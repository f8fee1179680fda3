"""Lower bounds on I(window; label) from the cross-entropy of classifiers on held-out sessions.

For any q(y | window), I >= H(y) - E[-log q(y | window)], if q was trained on other labels. So the
bound holds on the held-out sessions, and it is what survives to another day; a better classifier
makes it tighter. Probabilities are scaled by a temperature that is chosen on a further session
(D. Barber, F. Agakov, The IM algorithm, NIPS 2003, for the bound; C. Guo et al., On calibration of
modern neural networks, ICML 2017, for the temperature).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from controller.bundles import vocabulary
from controller.shared.aliases import Mask
from models.data.augment import Symmetry, vary_windows
from models.data.recipe import Augmentation
from models.evaluation import bootstrap, scores
from models.results.evaluation import Figure
from models.studies.information.windows import GAIN, Windows

HIDDEN: Final = (96, 48)
BATCH: Final = 128
EPOCHS: Final = 24
RATE: Final = 2e-3
DECAY: Final = 1e-3  # of weights
DROPOUT: Final = 0.2
VARIED: Final = Augmentation(dropout=0.0, electrode=0.0)
FEWEST: Final = 40  # gestures from which their temperature is chosen
BLOCKS: Final = 5  # of time, where there is only one session
LEAST: Final = 1e-12  # probability

Kind = Literal["linear", "mlp"]
Logits = NDArray[np.float64]  # (n, classes); also logarithms of probabilities
Examples = tuple[NDArray[np.float32], NDArray[np.int64]]  # inputs (n, d), and classes (n,)


class Fold(NamedTuple):
    """Masks of the windows for training, for epoch and temperature, and for the test."""

    train: Mask
    check: Mask
    test: Mask


class HeldOut(NamedTuple):
    """Answers to held-out windows."""

    # logarithms of calibrated probabilities, (n, classes); NaN where nothing was tested
    log_p: Logits
    temperature: NDArray[np.float64]  # another temperature, of whole gestures, (n,)


@dataclass(frozen=True, slots=True)
class Variation:
    """Augmentation of training examples, of rows and columns, by their gestures' symmetries."""

    grid: tuple[int, int]
    symmetry: Symmetry

    @classmethod
    def of(cls, windows: Windows) -> "Variation":
        """Return the variation that the shipped gestures declare; none for other gestures."""
        declared = vocabulary.of(windows.labels)
        return cls(windows.grid, Symmetry.of(declared, *windows.grid))

    def apply(self, x: Tensor, y: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """Rotate, mirror and disturb examples (n, d) of classes (n,)."""
        z = 1.0 + x.reshape(len(x), -1, *self.grid) / GAIN
        z, y = vary_windows(VARIED, z, y, self.symmetry, generator)
        return (GAIN * (z - 1.0)).reshape(len(x), -1), y


def folds(windows: Windows) -> list[Fold]:
    """Return a fold for each session; of one session alone, blocks of time with gaps.

    Of more than two sessions one chooses epoch and temperature; of two, the last fifth of the
    training session.
    """
    group, frame = windows.session, windows.frame
    usable = np.ones(len(group), dtype=np.bool_)
    if len(np.unique(group)) == 1:
        at, images = frame - frame.min(), windows.x.shape[1]
        length = (at.max() + 1) / BLOCKS
        group = np.minimum(at // length, BLOCKS - 1).astype(np.int64)
        usable = np.minimum(at - group * length, (group + 1) * length - at) > images
    names, found = np.unique(group), []
    for place, name in enumerate(names):
        test, check = group == name, group == names[(place + 1) % len(names)]
        if len(names) == 2:
            check &= frame > np.quantile(frame[check], 0.8)
        found.append(Fold(~test & ~check & usable, check & usable, test))
    return found


def held_out(
    windows: Windows,
    kind: Kind = "mlp",
    *,
    epochs: int = EPOCHS,
    variation: Variation | None = None,
) -> HeldOut:
    """Test each session by a classifier that was trained on the others; see `trained`."""
    size = (len(windows.y), len(windows.labels))
    log_p, heat = np.full(size, np.nan), np.full(size[0], np.nan)
    x, y = windows.flat, windows.y
    for seed, fold in enumerate(folds(windows)):
        if not all(mask.any() for mask in fold):
            continue
        train, check = (x[fold.train], y[fold.train]), (x[fold.check], y[fold.check])
        classify = trained(train, check, size[1], seed, epochs, kind, variation)
        known = classify(check[0])
        temperature = scores.temperature(known, check[1])
        log_p[fold.test] = _log_softmax(classify(x[fold.test]) / temperature)
        heat[fold.test] = _gesture_temperature(
            windows.pick(fold.check), _log_softmax(known / temperature)
        )
    return HeldOut(log_p, heat)


def rescaled(windows: Windows, probabilities: NDArray[np.floating]) -> HeldOut:
    """Return a finished classifier's answers (n, classes), calibrated on each day's others."""
    raw = _log(probabilities.astype(np.float64))
    log_p, heat = raw.copy(), np.ones(len(raw))
    for name in np.unique(windows.session):
        own = windows.session == name
        if own.all():
            break
        log_p[own] = _log_softmax(raw[own] / scores.temperature(raw[~own], windows.y[~own]))
        heat[own] = _gesture_temperature(windows.pick(~own), raw[~own])
    return HeldOut(log_p, heat)


def window_bound(windows: Windows, log_p: Logits) -> Figure:
    """Return H(y) - cross-entropy of the windows for log-probabilities (n, classes), nats."""
    return bootstrap.event_gain(
        log_p[np.arange(len(windows.y)), windows.y], windows.y, windows.event
    )


def gesture_bound(windows: Windows, answers: HeldOut) -> Figure:
    """Return the bound for whole gestures, begin and end known, by their mean answer, nats."""
    y, p = gestures(windows, answers.log_p)
    use = (windows.y > 0) & np.isfinite(answers.log_p[:, 0])
    _, first = np.unique(windows.event[use], return_index=True)
    log_p = _log_softmax(_log(p) / answers.temperature[use][first][:, None])
    return bootstrap.event_gain(log_p[np.arange(len(y)), y], y, np.arange(len(y)))


def gestures(windows: Windows, log_p: Logits) -> tuple[NDArray[np.int64], Logits]:
    """Return class, from 0, and mean probabilities of gestures, of known windows (n, classes)."""
    use = (windows.y > 0) & np.isfinite(log_p[:, 0])
    _, number = np.unique(windows.event[use], return_inverse=True)
    p = np.zeros((int(number.max(initial=-1)) + 1, log_p.shape[1] - 1))
    np.add.at(p, number, np.exp(log_p[use, 1:]))
    y = np.zeros(len(p), dtype=np.int64)
    y[number] = windows.y[use] - 1
    return y, p / np.maximum(p.sum(axis=1, keepdims=True), LEAST)


class _Classifier(nn.Module):
    """A network of dense layers on standardised inputs."""

    def __init__(self, examples: Tensor, classes: int, hidden: tuple[int, ...]) -> None:
        super().__init__()
        self.middle, self.spread = examples.mean(dim=0), examples.std() + 1e-6
        layers: list[nn.Module] = []
        inputs = examples.shape[1]
        for size in hidden:
            layers += [nn.Linear(inputs, size), nn.ReLU(), nn.Dropout(DROPOUT)]
            inputs = size
        self.layers = nn.Sequential(*layers, nn.Linear(inputs, classes))

    def forward(self, x: Tensor) -> Tensor:
        """Return logits (n, classes) for inputs (n, d)."""
        return torch.as_tensor(self.layers((x - self.middle) / self.spread))


def trained(
    train: Examples,
    check: Examples,
    classes: int,
    seed: int = 0,
    epochs: int = EPOCHS,
    kind: Kind = "mlp",
    variation: Variation | None = None,
) -> Callable[[NDArray[np.float32]], Logits]:
    """Train a network, and return its function from inputs (n, d) to logits (n, classes).

    The epoch with the least loss on `check` is kept. The kind "linear" has one layer: logistic
    regression. The variation augments training examples.
    """
    torch.set_num_threads(1)
    generator = torch.Generator().manual_seed(seed)
    torch.manual_seed(seed)
    (x, y), (check_x, check_y) = (
        [torch.from_numpy(np.ascontiguousarray(column)) for column in examples]
        for examples in (train, check)
    )
    net = _Classifier(x, classes, HIDDEN if kind == "mlp" else ())
    optimizer = torch.optim.AdamW(net.parameters(), RATE, weight_decay=DECAY)
    steps = epochs * -(-len(y) // BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 2 * RATE, total_steps=steps)
    best, least = net.state_dict(), np.inf
    for _ in range(epochs):
        net.train()
        for batch in torch.split(torch.randperm(len(y), generator=generator), BATCH):
            inputs, labels = x[batch], y[batch]
            if variation is not None:
                inputs, labels = variation.apply(inputs, labels, generator)
            loss = nn.functional.cross_entropy(net(inputs), labels)
            optimizer.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            schedule.step()
        net.eval()
        with torch.no_grad():
            loss_on_check = float(nn.functional.cross_entropy(net(check_x), check_y))
        if loss_on_check < least:
            least = loss_on_check
            best = {name: value.clone() for name, value in net.state_dict().items()}
    net.load_state_dict(best)
    net.eval()

    def classify(inputs: NDArray[np.float32]) -> Logits:
        with torch.no_grad():
            return np.asarray(net(torch.from_numpy(inputs)).numpy(), dtype=np.float64)

    return classify


def _gesture_temperature(windows: Windows, log_p: Logits) -> float:
    """Return the temperature of whole gestures, for log-probabilities (n, classes); 1 if few."""
    y, p = gestures(windows, log_p)
    return scores.temperature(_log(p), y) if len(y) >= FEWEST else 1.0


def _log(p: NDArray[np.float64]) -> Logits:
    """Return logarithms of probabilities (n, classes) that are above zero."""
    return np.asarray(np.log(np.maximum(p, LEAST)))


def _log_softmax(logits: Logits) -> Logits:
    """Return log-probabilities (n, classes) of logits (n, classes)."""
    return _log(scores.softmax(logits))
