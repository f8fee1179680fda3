"""Train both networks from examples: augmented, seeded, one thread, best epoch kept."""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import nn

from models.augment import Augmentation
from models.dataset import Examples
from models.networks import GestureNet, LocationNet

Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Recipe:
    """How networks are trained.

    Attributes:
        epochs: Passes over the examples, CNN-3D and CNN-2D.
        batch: Examples per step.
        rate: Highest learning rate; it falls to zero along a cosine.
        l2: Penalty on squared weights of convolutions and dense layers: paper, section 4.2.
        null_share: Share of the null windows that each epoch draws; idling teaches little.
        seed: Of initial weights, order and augmentation.
        augmentation: How windows are varied.
        location: How press images are varied: less, because noise hides where a press is.
    """

    epochs: tuple[int, int] = (16, 96)
    batch: int = 150
    rate: float = 1e-3
    l2: tuple[float, float] = (5e-4, 1e-5)
    null_share: float = 0.5
    seed: int = 0
    augmentation: Augmentation = field(default_factory=Augmentation)
    location: Augmentation = field(
        default_factory=lambda: Augmentation(offset=0.002, noise=0.0, dropout=0.05)
    )


def train_gesture(
    train: Examples, check: Examples, labels: Sequence[str], recipe: Recipe, say: Progress
) -> GestureNet:
    """Train CNN-3D and return it as it was in its best epoch on the check sessions."""
    torch.manual_seed(recipe.seed)
    generator = torch.Generator().manual_seed(recipe.seed)
    rng = np.random.default_rng(recipe.seed)
    rows, columns = train.images.shape[1:]
    net = GestureNet(train.window, rows, columns, len(labels))
    label = train.label[train.ends]
    null, touched = train.ends[label == 0], train.ends[label != 0]
    count = len(touched) + round(recipe.null_share * len(null))
    optimizer, schedule = _optimizer(net, recipe, recipe.epochs[0] * -(-count // recipe.batch))
    loss_of = nn.CrossEntropyLoss()
    best, best_loss = copy.deepcopy(net), float("inf")
    for epoch in range(recipe.epochs[0]):
        net.train()
        some = rng.choice(null, count - len(touched), replace=False)
        order = rng.permutation(np.concatenate([touched, some]))
        for start in range(0, count, recipe.batch):
            ends = order[start : start + recipe.batch]
            windows, target = recipe.augmentation.windows(
                torch.from_numpy(train.windows(ends)),
                torch.from_numpy(train.label[ends]),
                labels,
                generator,
            )
            loss = loss_of(net(windows), target) + _penalty(net, recipe)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
        loss_value, accuracy = _check_gesture(net, check)
        say(
            f"CNN-3D epoch {epoch + 1:2d}/{recipe.epochs[0]}: "
            f"unseen sessions' loss {loss_value:.4f}, frame accuracy {accuracy:.3f}"
        )
        if loss_value < best_loss:
            best, best_loss = copy.deepcopy(net), loss_value
    return best.eval()


def train_location(train: Examples, check: Examples, recipe: Recipe, say: Progress) -> LocationNet:
    """Train CNN-2D on the frames of presses; return its best epoch on the check sessions."""
    torch.manual_seed(recipe.seed)
    generator = torch.Generator().manual_seed(recipe.seed)
    rng = np.random.default_rng(recipe.seed)
    net = LocationNet(*train.images.shape[1:])
    use, held = _presses(train), _presses(check)
    optimizer, schedule = _optimizer(net, recipe, recipe.epochs[1] * -(-len(use) // recipe.batch))
    check_images = torch.from_numpy(check.images[held])
    check_touch = torch.from_numpy(check.touch[held])
    best, best_error = copy.deepcopy(net), float("inf")
    for epoch in range(recipe.epochs[1]):
        net.train()
        order = rng.permutation(use)
        for start in range(0, len(order), recipe.batch):
            index = order[start : start + recipe.batch]
            images, touches = recipe.location.images(
                torch.from_numpy(train.images[index]),
                torch.from_numpy(train.touch[index]),
                generator,
            )
            off = net(images) - touches
            # Huber: the first and last frames of a press are faint, and must not rule.
            loss = nn.functional.smooth_l1_loss(off, torch.zeros_like(off), beta=0.3)
            loss = loss + _penalty(net, recipe)
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            schedule.step()
        net.eval()
        with torch.no_grad():
            error = float((net(check_images) - check_touch).abs().mean())
        say(
            f"CNN-2D epoch {epoch + 1:2d}/{recipe.epochs[1]}: "
            f"unseen sessions' frame error {error:.3f} grid units"
        )
        if error < best_error:
            best, best_error = copy.deepcopy(net), error
    return best.eval()


def _presses(examples: Examples) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.flatnonzero(np.isfinite(examples.touch[:, 0]))


def _optimizer(
    net: nn.Module, recipe: Recipe, steps: int
) -> tuple[torch.optim.Optimizer, torch.optim.lr_scheduler.LRScheduler]:
    optimizer = torch.optim.Adam(net.parameters(), lr=recipe.rate)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, max_lr=recipe.rate * 2, total_steps=steps, pct_start=0.1
    )
    return optimizer, schedule


def _penalty(net: nn.Module, recipe: Recipe) -> torch.Tensor:
    """L2 on weights, not on biases: paper, eq. (5) and (6)."""
    total = torch.zeros(())
    for module in net.modules():
        if isinstance(module, nn.Conv2d | nn.Conv3d):
            total = total + recipe.l2[0] * module.weight.square().sum()
        elif isinstance(module, nn.Linear):
            total = total + recipe.l2[1] * module.weight.square().sum()
    return total


def _check_gesture(net: GestureNet, check: Examples) -> tuple[float, float]:
    net.eval()
    losses, right = 0.0, 0
    with torch.no_grad():
        for start in range(0, len(check.ends), 2000):
            ends = check.ends[start : start + 2000]
            target = torch.from_numpy(check.label[ends])
            logits = net(torch.from_numpy(check.windows(ends)))
            losses += float(nn.functional.cross_entropy(logits, target, reduction="sum"))
            right += int((logits.argmax(dim=1) == target).sum())
    return losses / len(check.ends), right / len(check.ends)
