"""Training loop of one network: a fixed course, seeded and resumable.

Nothing held out ends a training or picks an epoch: the recipe fixes the number of batches, and the
learning rate falls to zero over them.
"""

import math
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from controller.shared.aliases import Index
from models.data.load import Data
from models.data.recipe import NetworkRecipe, Recipe
from models.data.splits import Split
from models.formatting import duration
from models.results.training import Epoch
from models.training import checkpoint
from models.training.networks import Network
from models.training.transfer import Start

WARM_UP: Final = 0.1  # share of the steps in which the learning rate rises
FIRST_RATE: Final = 0.04  # share of the highest rate that it begins with
MOMENTUM: Final = 0.9
AT_ONCE: Final = 2000  # examples evaluated together
JUDGED: Final = 4000  # examples of each kind that an epoch is judged on
CLEAR: Final = "\r\x1b[2K"

Watch = Callable[[Epoch], None]  # takes every epoch


@dataclass(frozen=True, slots=True)
class TrainingJob:
    """Data and options that the trainings of one bundle share."""

    data: Data  # examples
    split: Split  # split of the examples
    recipe: Recipe  # training recipe
    seed: int  # of everything random
    device: torch.device  # runs PyTorch
    folder: Path | None  # holds the checkpoints; None: there are none
    # classes that the gesture network answers, the first ones; 0: all. The others are auxiliary:
    # learned beside them, so that the embedding keeps more
    answers: int = 0
    start: Start = field(default_factory=Start)  # weights that the networks start from


class Task(ABC):
    """Base class of the training tasks: a network, its examples, its loss and its scores.

    `net` is trained in place on the examples at the positions `train`, (examples,), and judged on
    those held out, `check`, and on those at random, the paper's protocol.
    """

    def __init__(
        self, net: Network, recipe: NetworkRecipe, train: Index, check: Index, random: Index
    ) -> None:
        self.net, self.recipe = net, recipe
        self.train, self.check, self.random = train, check, random

    def steps(self) -> int:
        """Return the number of batches of an epoch."""
        return -(-len(self.train) // self.recipe.batch)

    def batches(self, rng: np.random.Generator) -> Iterator[Index]:
        """Yield one epoch's examples in batches (batch,) of about one size, in a random order."""
        # Of about one size: no layer can be normalised over a single example.
        yield from np.array_split(rng.permutation(self.train), self.steps())

    @abstractmethod
    def loss(self, batch: Index, generator: torch.Generator) -> tuple[Tensor, float]:
        """Return the loss of a batch (batch,), and its mean score."""

    @abstractmethod
    def judge(self, examples: Index) -> tuple[float, float]:
        """Return loss and score on some of the examples."""


def fit(
    task: Task, seed: int, keep: Path | None = None, watch: Watch | None = None
) -> tuple[Epoch, ...]:
    """Train a network in place, and return its epochs.

    An interrupted training resumes from the checkpoint `keep`; CheckpointError if it is damaged.
    """
    run = _Run(task, seed)
    if keep is not None and (found := checkpoint.load(keep)) is not None:
        try:
            run.restore(*found)
        except (KeyError, ValueError, TypeError, AttributeError, RuntimeError, IndexError):
            raise checkpoint.damaged(keep) from None
    while not run.over():
        this = run.epoch()
        if keep is not None:
            checkpoint.save(keep, *run.state())
        if watch is not None:
            watch(this)
    run.finish()
    return tuple(run.epochs)


def fit_shown(
    task: Task, name: str, describe: Callable[[Epoch], str], seed: int, folder: Path | None
) -> tuple[Epoch, ...]:
    """Train as `fit` does, its checkpoint in a folder, and show each epoch on standard error."""
    passes = task.recipe.passes(task.steps() * task.recipe.batch)
    live = sys.stderr.isatty()  # on a terminal one line is redrawn
    times = [time.monotonic()]

    def show(epoch: Epoch) -> None:
        times.append(time.monotonic())
        left = duration((times[-1] - times[0]) / (len(times) - 1) * (passes - epoch.number))
        line = f"{CLEAR * live}{name} epoch {epoch.number}/{passes}: {describe(epoch)}; {left} left"
        end = "" if live and epoch.number < passes else "\n"
        print(line, end=end, file=sys.stderr, flush=True)

    return fit(task, seed, None if folder is None else folder / f"{name.lower()}.npz", show)


class _Run:
    """A training under way, with its full state."""

    def __init__(self, task: Task, seed: int) -> None:
        self.task, self.recipe, self.net = task, task.recipe, task.net
        self.device = next(self.net.parameters()).device
        self.seed, self.rng = seed, np.random.default_rng(seed)
        self.generator = torch.Generator(self.device).manual_seed(seed)
        self.optimizer = _optimizer(self.net, self.recipe)
        self.each = task.steps()
        self.passes = self.recipe.passes(self.each * self.recipe.batch)
        self.epochs: list[Epoch] = []
        self.mean: dict[str, Tensor] = {}  # of the weights since the last part of it began

    def over(self) -> bool:
        """Whether it has ended."""
        return len(self.epochs) >= self.passes

    def epoch(self) -> Epoch:
        """Go through the examples once."""
        self.net.train()
        torch.manual_seed(self.seed + len(self.epochs))  # of dropout
        losses = scores = 0.0
        examples, begun = 0, len(self.epochs) * self.each
        for step, batch in enumerate(self.task.batches(self.rng)):
            rate = _rate(self.recipe, begun + step, self.passes * self.each)
            for group in self.optimizer.param_groups:
                group["lr"] = rate
            with _products("medium" if self.recipe.coarse else "highest"):
                loss, score = self.task.loss(batch, self.generator)
                self.optimizer.zero_grad()
                loss.backward()  # type: ignore[no-untyped-call]
            if self.recipe.clip:
                nn.utils.clip_grad_norm_(self.net.parameters(), self.recipe.clip)
            self.optimizer.step()
            self._average(begun + step)
            losses += float(loss.detach()) * len(batch)
            scores += score * len(batch)
            examples += len(batch)
        self.net.eval()
        number = len(self.epochs) + 1
        with torch.no_grad():
            check, random = (
                self.task.judge(own) if len(own) else (math.nan, math.nan)
                for own in (self.task.check, self.task.random)
            )
        this = Epoch(number, losses / examples, scores / examples, *check, random[1])
        self.epochs.append(this)
        return this

    def _average(self, step: int) -> None:
        """Add the network after a step to the mean over the last part of the course."""
        late = step - round((1.0 - self.recipe.averaged) * self.passes * self.each)
        if late >= 0:
            for name, value in self.net.state_dict().items():
                if value.is_floating_point():
                    self.mean.setdefault(name, value.clone()).lerp_(value, 1.0 / (late + 1))

    def finish(self) -> None:
        """Give the network the mean of its last weights, for its use."""
        self.net.load_state_dict({**self.net.state_dict(), **self.mean})
        self.net.eval()

    def state(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return the full state: arrays of any shape, and values as JSON has them."""
        arrays = {
            **checkpoint.pack("net", self.net.state_dict()),
            **checkpoint.pack("mean", self.mean),
            **checkpoint.pack("optimizer", checkpoint.optimizer_state(self.optimizer)),
            "generator": self.generator.get_state().numpy(),
        }
        words = {
            "epochs": [asdict(epoch) for epoch in self.epochs],
            "rng": self.rng.bit_generator.state,
        }
        return arrays, words

    def restore(self, arrays: dict[str, NDArray[Any]], words: dict[str, Any]) -> None:
        """Resume from the arrays, of any shape, and values of `state`."""
        self.net.load_state_dict(checkpoint.unpack("net", arrays))
        self.mean = checkpoint.unpack("mean", arrays)
        checkpoint.restore_optimizer(self.optimizer, checkpoint.unpack("optimizer", arrays))
        self.generator.set_state(torch.from_numpy(np.array(arrays["generator"])))
        self.rng.bit_generator.state = words["rng"]
        self.epochs = [Epoch(**epoch) for epoch in words["epochs"]]


def batched(net: nn.Module, inputs: Callable[[Index], Tensor], index: Index) -> Tensor:
    """Return a network's outputs for many examples, (examples, outputs), without gradients.

    `inputs` returns the network's inputs for some of them.
    """
    starts = range(0, max(1, len(index)), AT_ONCE)
    with torch.no_grad():
        return torch.cat([net(inputs(index[start : start + AT_ONCE])) for start in starts])


def spread(index: Index, most: int) -> Index:
    """Return at most so many entries of an index (n,), evenly spread."""
    return index[:: max(1, -(-len(index) // most))]


def prepare_torch(seed: int) -> torch.device:
    """Make PyTorch reproducible, and return what it computes on: a GPU where there is one."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)  # more are slower at this size, and far slower on a busy machine
    torch.set_flush_denormal(True)  # L2 drives weights to where arithmetic is slow
    if not torch.cuda.is_available():
        return torch.device("cpu")
    torch.use_deterministic_algorithms(True, warn_only=True)
    torch.backends.cudnn.benchmark = False
    return torch.device("cuda")


@contextmanager
def _products(precision: str) -> Iterator[None]:
    """Multiply matrices as precisely as this, and as before afterwards."""
    before = torch.get_float32_matmul_precision()
    torch.set_float32_matmul_precision(precision)
    try:
        yield
    finally:
        torch.set_float32_matmul_precision(before)


def _optimizer(net: nn.Module, recipe: NetworkRecipe) -> torch.optim.Optimizer:
    """Return the optimiser; L2 is on weights, not on biases: paper, eq. (5) and (6)."""
    groups: dict[float, list[nn.Parameter]] = {}
    for name, parameter in net.named_parameters():
        convolution = parameter.ndim > 2
        # The gradient of l2 |w|² is 2 l2 w; optimisers add weight_decay x w.
        decay = 0.0 if name.endswith("bias") else 2.0 * recipe.l2[0 if convolution else 1]
        groups.setdefault(decay, []).append(parameter)
    each: list[dict[str, Any]] = [
        {"params": p, "weight_decay": decay} for decay, p in groups.items()
    ]
    if recipe.nesterov:
        return torch.optim.SGD(each, lr=recipe.rate, momentum=MOMENTUM, nesterov=True)
    return torch.optim.Adam(each, lr=recipe.rate, fused=True)


def _rate(recipe: NetworkRecipe, step: int, steps: int) -> float:
    """Return the learning rate of a step: along a cosine up, then down to zero."""
    if not recipe.falling:
        return recipe.rate
    rising = max(1, round(WARM_UP * steps))
    if step < rising:
        share = 0.5 - 0.5 * math.cos(math.pi * step / rising)
        return recipe.rate * (FIRST_RATE + (1.0 - FIRST_RATE) * share)
    return recipe.rate * (0.5 + 0.5 * math.cos(math.pi * (step - rising) / (steps - rising)))
