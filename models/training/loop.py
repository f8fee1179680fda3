"""One network's training, whatever it learns: seeded, interruptible, the best epoch kept."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from models.data.recipe import Course
from models.results.training import Epoch
from models.training import checkpoint

WARM_UP: Final = 0.1  # share of the steps in which the learning rate rises
FIRST_RATE: Final = 0.04  # share of the highest rate that it begins with
MOMENTUM: Final = 0.9

Watch = Callable[[list[Epoch], float], None]  # epochs so far, and the share done of the next one


class Lesson(Protocol):
    """What one network learns from, and how well it does."""

    net: nn.Module

    def batches(self, rng: np.random.Generator) -> Iterator[NDArray[np.int64]]:
        """Return one epoch's examples in batches, in an order drawn anew."""

    def steps(self) -> int:
        """Return how many batches an epoch has."""

    def loss(self, batch: NDArray[np.int64], generator: torch.Generator) -> tuple[Tensor, float]:
        """Return the loss of a batch, and its mean score."""

    def check(self) -> tuple[float, float]:
        """Return loss and score on what is held out; NaN where nothing is."""

    def random(self) -> float:
        """Return the score by the paper's protocol."""

    def better(self, one: Epoch, other: Epoch) -> bool:
        """Whether an epoch is better than another."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """A trained network's history.

    Attributes:
        epochs: The curve.
        best: Number of the epoch that was kept.
        stopped: Why it ended early; "" where it did not.
    """

    epochs: tuple[Epoch, ...]
    best: int
    stopped: str


def fit(lesson: Lesson, course: Course, seed: int, keep: Path | None, watch: Watch) -> Fitted:
    """Train the lesson's network in place; it ends as it was in the epoch that is kept.

    Args:
        lesson: What it learns.
        course: How.
        seed: Of order and augmentation.
        keep: Where the checkpoint is; what is there is gone on from. None: nowhere.
        watch: Sees the epochs, and from time to time the share done of the present one.
    """
    run = _Run(lesson, course, seed)
    if keep is not None and (found := checkpoint.load(keep)) is not None:
        try:
            run.restore(*found)
        except (KeyError, ValueError, TypeError, AttributeError, RuntimeError, IndexError):
            raise checkpoint.damaged(keep) from None
    while not run.over():
        run.epoch(watch)
        if keep is not None:
            checkpoint.save(keep, *run.state())
    lesson.net.load_state_dict(run.best)
    lesson.net.eval()
    return Fitted(tuple(run.epochs), run.best_epoch, run.stopped)


class _Run:
    """A training under way, and all that it remembers."""

    def __init__(self, lesson: Lesson, course: Course, seed: int) -> None:
        self.lesson, self.course, self.net = lesson, course, lesson.net
        self.device = next(self.net.parameters()).device
        self.rng = np.random.default_rng(seed)
        self.generator = torch.Generator(self.device).manual_seed(seed)
        self.optimizer = _optimizer(self.net, course)
        self.each = lesson.steps()
        self.passes = course.passes(self.each * course.batch)
        self.epochs: list[Epoch] = []
        self.best: dict[str, Tensor] = _copy(self.net)
        self.best_epoch = 0
        self.stopped = ""

    def over(self) -> bool:
        """Whether it has ended."""
        return bool(self.stopped) or len(self.epochs) >= self.passes

    def epoch(self, watch: Watch) -> None:
        """Go through the examples once."""
        self.net.train()
        losses = scores = 0.0
        examples, begun = 0, len(self.epochs) * self.each
        for step, batch in enumerate(self.lesson.batches(self.rng)):
            rate = _rate(self.course, begun + step, self.passes * self.each)
            for group in self.optimizer.param_groups:
                group["lr"] = rate
            with _products("medium" if self.course.coarse else "highest"):
                loss, score = self.lesson.loss(batch, self.generator)
                self.optimizer.zero_grad()
                loss.backward()  # type: ignore[no-untyped-call]
            if self.course.clip:
                nn.utils.clip_grad_norm_(self.net.parameters(), self.course.clip)
            self.optimizer.step()
            losses += float(loss.detach()) * len(batch)
            scores += score * len(batch)
            examples += len(batch)
            watch(self.epochs, (step + 1) / self.each)
        self.net.eval()
        number = len(self.epochs) + 1
        with torch.no_grad():
            check = self.lesson.check()
            this = Epoch(number, losses / examples, scores / examples, *check, self.lesson.random())
        self._note(this)
        self.epochs.append(this)
        watch(self.epochs, 0.0)

    def _note(self, this: Epoch) -> None:
        """Keep the epoch if it is to be kept, and end the training if it has been enough."""
        known = math.isfinite(this.check_loss)
        best = self.epochs[self.best_epoch - 1] if self.best_epoch else None
        if not (self.course.keep_best and known) or best is None or self.lesson.better(this, best):
            self.best, self.best_epoch = _copy(self.net), this.number
        patience = max(4, round(self.course.patience * self.passes))
        waited = this.number - self.best_epoch
        if self.course.patience and waited >= patience and this.number < self.passes:
            self.stopped = (
                f"no better on what is held out for {waited} epochs, so it stopped after "
                f"{this.number} of {self.passes}"
            )

    def state(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return everything remembered."""
        arrays = {
            **checkpoint.pack("net", self.net.state_dict()),
            **checkpoint.pack("best", self.best),
            **checkpoint.pack("optimizer", checkpoint.optimizer_state(self.net, self.optimizer)),
            "generator": self.generator.get_state().numpy(),
        }
        words = {
            "epochs": [asdict(epoch) for epoch in self.epochs],
            "best": self.best_epoch,
            "stopped": self.stopped,
            "rng": self.rng.bit_generator.state,
        }
        return arrays, words

    def restore(self, arrays: dict[str, NDArray[Any]], words: dict[str, Any]) -> None:
        """Go on from what `state` returned."""
        self.net.load_state_dict(checkpoint.unpack("net", arrays))
        self.best = checkpoint.unpack("best", arrays)
        kept = checkpoint.unpack("optimizer", arrays)
        checkpoint.restore_optimizer(self.net, self.optimizer, kept)
        self.generator.set_state(torch.from_numpy(np.array(arrays["generator"])))
        self.rng.bit_generator.state = words["rng"]
        self.epochs = [Epoch(**epoch) for epoch in words["epochs"]]
        self.best_epoch, self.stopped = int(words["best"]), str(words["stopped"])


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


def _optimizer(net: nn.Module, course: Course) -> torch.optim.Optimizer:
    """Return the optimiser; L2 is on weights, not on biases: paper, eq. (5) and (6)."""
    groups: dict[float, list[nn.Parameter]] = {}
    for name, parameter in net.named_parameters():
        convolution = parameter.ndim > 2
        # The gradient of l2 |w|² is 2 l2 w; optimisers add weight_decay x w.
        decay = 0.0 if name.endswith("bias") else 2.0 * course.l2[0 if convolution else 1]
        groups.setdefault(decay, []).append(parameter)
    each: list[dict[str, Any]] = [
        {"params": p, "weight_decay": decay} for decay, p in groups.items()
    ]
    if course.nesterov:
        return torch.optim.SGD(each, lr=course.rate, momentum=MOMENTUM, nesterov=True)
    return torch.optim.Adam(each, lr=course.rate, fused=True)


def _rate(course: Course, step: int, steps: int) -> float:
    """Return the learning rate of a step: along a cosine up, then down to zero."""
    if not course.falling:
        return course.rate
    rising = max(1, round(WARM_UP * steps))
    if step < rising:
        share = 0.5 - 0.5 * math.cos(math.pi * step / rising)
        return course.rate * (FIRST_RATE + (1.0 - FIRST_RATE) * share)
    return course.rate * (0.5 + 0.5 * math.cos(math.pi * (step - rising) / (steps - rising)))


def _copy(net: nn.Module) -> dict[str, Tensor]:
    return {name: tensor.detach().clone() for name, tensor in net.state_dict().items()}
