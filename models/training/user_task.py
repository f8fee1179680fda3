"""Training task of the user network: the user who made the gesture in a window."""

import math
from collections.abc import Iterator
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from controller.recognition.user_id import evidence
from models.data import splits
from models.data.recipe import Course
from models.results.training import Epoch
from models.training.loop import Watch, fit
from models.training.networks import GestureNet
from models.training.tasks import AT_ONCE, gesture_net
from models.training.user_recipe import Mood
from models.training.user_windows import Index, Touched, mean

RANDOM: Final = 0.1  # share of the windows that are drawn at random; the paper does not say
SPARE: Final = 3  # images before a window, for those that are made slower


class People:
    """What the network learns from gestures, and how well it does on others."""

    def __init__(
        self,
        taught: Touched,
        who: Index,
        outputs: int,
        course: Course,
        mood: Mood,
        random: NDArray[np.bool_] | None = None,
    ) -> None:
        """Join them.

        Args:
            taught: Gestures to learn from.
            who: Output of whoever made each of them, (events,).
            outputs: People, and anybody else.
            course: How.
            mood: How examples are varied.
            random: Windows that are judged by the paper's protocol, and not learned from.
        """
        self.taught, self.course, self.mood = taught, course, mood
        examples = taught.examples
        _, rows, columns = examples.images.shape
        self.net: nn.Module = gesture_net((examples.window, rows, columns), outputs, course)
        self._who = who[taught.event]
        out = np.zeros(len(taught.ends), dtype=np.bool_) if random is None else random
        self._learned, self._drawn = np.flatnonzero(~out), np.flatnonzero(out)
        # People are as probable as each other, however long each of them played.
        count = np.bincount(self._who[self._learned], minlength=outputs).astype(np.float64)
        usual = count[count > 0].mean()
        weights = np.clip(usual / np.maximum(count, 1.0), 0.25, 4.0)
        self._weights = torch.from_numpy(weights.astype(np.float32))

    def steps(self) -> int:
        """Return how many batches an epoch has."""
        return -(-len(self._learned) // self.course.batch)

    def batches(self, rng: np.random.Generator) -> Iterator[Index]:
        """Return one epoch's windows in batches, by their positions."""
        yield from np.array_split(rng.permutation(self._learned), self.steps())

    def loss(self, batch: Index, generator: torch.Generator) -> tuple[Tensor, float]:
        """Return the loss of a batch, and its share of right answers."""
        longer = torch.from_numpy(self.taught.longer(self.taught.ends[batch], SPARE))
        who = torch.from_numpy(self._who[batch])
        logits = self.net(self.mood.vary(longer, self.taught.examples.window, generator))
        right = float((logits.detach().argmax(dim=1) == who).float().mean())
        return nn.functional.cross_entropy(logits, who, self._weights), right

    def check(self) -> tuple[float, float]:
        """Return that nothing is held out here."""
        return math.nan, math.nan

    def random(self) -> float:
        """Return the share of windows at random that are named rightly."""
        if not len(self._drawn):
            return math.nan
        ends = self.taught.ends[self._drawn]
        named = ask(self.net, self.taught, ends).argmax(axis=1)
        return float((named == self._who[self._drawn]).mean())

    def better(self, one: Epoch, other: Epoch) -> bool:
        """Whether an epoch is better than another: nobody knows."""
        return False


def drawn(windows: int, seed: int) -> NDArray[np.bool_]:
    """Return which of so many windows are drawn at random, to be judged by the paper's protocol."""
    out = np.zeros(windows, dtype=np.bool_)
    out[splits.random_windows(windows, RANDOM, np.random.default_rng(seed)).test] = True
    return out


def ask(net: nn.Module, touched: Touched, ends: Index) -> NDArray[np.float32]:
    """Return how probably each of the people made what windows show, (windows, outputs)."""
    answers = []
    with torch.no_grad():
        for start in range(0, len(ends), AT_ONCE):
            windows = touched.examples.windows(ends[start : start + AT_ONCE])
            answers.append(torch.softmax(net(torch.from_numpy(windows)), dim=1).numpy())
    return np.concatenate(answers)


def said(net: nn.Module, touched: Touched) -> NDArray[np.float64]:
    """Return the evidence of each gesture, as the device takes it, (events, outputs)."""
    heard = evidence(ask(net, touched, touched.ends))
    return mean(heard, touched.event, len(touched.label))


def teach(lesson: People, seed: int, watch: Watch) -> GestureNet:
    """Train, and return the network as the device runs it."""
    fit(lesson, lesson.course, seed, None, watch)
    assert isinstance(lesson.net, GestureNet)
    return lesson.net.folded().eval()


def silent(epochs: list[Epoch], done: float) -> None:
    """Watch, and say nothing."""
