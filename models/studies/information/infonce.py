"""A lower bound without a likelihood: telling which label belongs to a window, among many.

Source: A. van den Oord, Y. Li, O. Vinyals, Representation learning with contrastive predictive
coding, 2018 ("InfoNCE"); B. Poole et al., On variational bounds of mutual information, ICML 2019.

A critic f(x, y) = a(x) . b(y) is trained to be greater for pairs than for a window with the labels
of others in its batch of n; then I >= E[f(x, y) - log mean_j exp f(x, y_j)], which never exceeds
log n. It holds on sessions that were held out, for any y: classes, or the place of a press. Draws
in a batch should be independent; they are windows drawn at random from whole sessions.
"""

import math
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from models.studies.information.classifier_bound import Fold

BATCH: Final = 256  # n: no more than 5.5 nats can be told
WIDTH: Final = 96
MEET: Final = 24  # dimensions in which windows and labels meet
EPOCHS: Final = 25
RATE: Final = 2e-3
DECAY: Final = 1e-3
DROPOUT: Final = 0.2
ROUNDS: Final = 4  # how often held-out windows are shuffled into batches


def info_nce(
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    folds: list[Fold],
    seed: int = 0,
    epochs: int = EPOCHS,
) -> NDArray[np.float64]:
    """Return each held-out pair's part of the bound, nats; its mean is the bound.

    Args:
        x: Windows, (n, d).
        y: Labels, (n, e); `one_hot` of classes.
        folds: What is learned from, what chooses the epoch, what is tested.
        seed: Of weights, order and batches.
        epochs: At most.

    Returns:
        (n,); NaN where nothing was tested.
    """
    torch.set_num_threads(1)
    inputs, labels = (_scaled(one) for one in (x, y))
    part = np.full(len(x), np.nan)
    for number, fold in enumerate(folds):
        torch.manual_seed(seed + number)
        generator = torch.Generator().manual_seed(seed + number)
        critic = _Critic(inputs.shape[1], labels.shape[1])
        _train(critic, inputs, labels, fold, generator, epochs)
        part[fold.test] = _test(critic, inputs, labels, fold.test, generator)
    return part


def one_hot(y: NDArray[np.integer], classes: int) -> NDArray[np.float32]:
    """Return classes as vectors, (n, classes)."""
    return np.asarray(np.eye(classes)[y], dtype=np.float32)


class _Critic(nn.Module):
    """Scores for all pairs of some windows and some labels."""

    def __init__(self, inputs: int, labels: int) -> None:
        super().__init__()

        def side(size: int, dropout: float) -> nn.Sequential:
            return nn.Sequential(
                nn.Linear(size, WIDTH), nn.ReLU(), nn.Dropout(dropout),
                nn.Linear(WIDTH, WIDTH), nn.ReLU(), nn.Linear(WIDTH, MEET),
            )  # fmt: skip

        self.of_x, self.of_y = side(inputs, DROPOUT), side(labels, 0.0)

    def forward(self, x: Tensor, y: Tensor) -> Tensor:
        """Return (windows, labels): each window's own label stands on the diagonal."""
        return torch.as_tensor(self.of_x(x) @ self.of_y(y).T / math.sqrt(MEET))


def _train(
    critic: _Critic,
    x: Tensor,
    y: Tensor,
    fold: Fold,
    generator: torch.Generator,
    epochs: int,
) -> None:
    """Train, and keep the epoch that is best on what checks."""
    train = torch.from_numpy(np.flatnonzero(fold.train))
    optimizer = torch.optim.AdamW(critic.parameters(), RATE, weight_decay=DECAY)
    best, most = critic.state_dict(), -math.inf
    for _ in range(epochs):
        critic.train()
        order = train[torch.randperm(len(train), generator=generator)]
        for batch in torch.split(order, BATCH):
            if len(batch) < BATCH // 4:
                continue  # too few to tell anything apart
            loss = -_bound(critic(x[batch], y[batch])).mean()
            optimizer.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
        found = float(_test(critic, x, y, fold.check, generator).mean())
        if found > most:
            most = found
            best = {name: value.clone() for name, value in critic.state_dict().items()}
    critic.load_state_dict(best)


def _test(
    critic: _Critic, x: Tensor, y: Tensor, tested: NDArray[np.bool_], generator: torch.Generator
) -> NDArray[np.float64]:
    """Return each tested pair's part, the mean over several ways to put them into batches."""
    critic.eval()
    at = torch.from_numpy(np.flatnonzero(tested))
    total = np.zeros(len(at))
    with torch.no_grad():
        for _ in range(ROUNDS):
            order = torch.randperm(len(at), generator=generator)
            batches = list(torch.split(order, BATCH))
            if len(batches) > 1 and len(batches[-1]) < BATCH:  # the last one borrows from the first
                spare = order[: BATCH - len(batches[-1])]
                batches[-1] = torch.cat([batches[-1], spare])
            for batch in batches:
                part = _bound(critic(x[at[batch]], y[at[batch]])).numpy()
                total[batch.numpy()] = total[batch.numpy()] + part / ROUNDS
            if len(batches) > 1 and len(order) % BATCH:  # who was lent was counted twice
                total[spare.numpy()] -= part[-len(spare) :] / ROUNDS
    return total


def _bound(scores: Tensor) -> Tensor:
    return torch.diagonal(scores) - torch.logsumexp(scores, dim=1) + math.log(len(scores))


def _scaled(values: NDArray[np.floating]) -> Tensor:
    flat = np.asarray(values.reshape(len(values), -1), dtype=np.float32)
    return torch.from_numpy((flat - flat.mean(axis=0)) / (flat.std() + 1e-6))
