"""Training tasks of the two networks: windows and their classes, touches and their places."""

from collections.abc import Iterator

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from models.data.augment import Symmetry
from models.data.examples import Examples
from models.data.recipe import Course
from models.data.touch_images import Touches
from models.data.training_split import Parts
from models.results.training import Epoch
from models.training.networks import GestureNet, LocationNet

AT_ONCE = 2000  # windows judged together
Index = NDArray[np.int64]


class Gestures:
    """What CNN-3D learns: the class of the last frame of each window."""

    def __init__(
        self,
        examples: Examples,
        parts: Parts,
        classes: int,
        symmetry: Symmetry,
        course: Course,
        device: torch.device,
        answers: int = 0,
    ) -> None:
        """Join them; `parts` are positions in `examples.ends`.

        Classes from `answers` on are auxiliary (0: none); the others count in the loss as they
        would without them.
        """
        self.examples, self.course, self.symmetry = examples, course, symmetry
        _, rows, columns = examples.images.shape
        self.net: nn.Module = gesture_net((examples.window, rows, columns), classes, course)
        self.net.to(device)
        self._device = device
        self._images = torch.from_numpy(examples.images).to(device)
        self._label = torch.from_numpy(examples.label).to(device)
        self._steps = torch.arange(1 - examples.window, 1, device=device)
        self.ends = {
            "train": examples.ends[parts.train],
            "check": examples.ends[parts.check],
            "random": examples.ends[parts.random],
        }
        label = examples.label[self.ends["train"]]
        self._null = self.ends["train"][label == 0]
        self._touched = self.ends["train"][label != 0]
        self._drawn = round(course.null_share * len(self._null))
        self._weights = _weights(label, classes, course, answers or classes).to(device)

    def steps(self) -> int:
        """Return how many batches an epoch has."""
        return -(-(len(self._touched) + self._drawn) // self.course.batch)

    def batches(self, rng: np.random.Generator) -> Iterator[Index]:
        """Return one epoch's windows in batches, by their last frames."""
        some = rng.choice(self._null, self._drawn, replace=False)
        order = rng.permutation(np.concatenate([self._touched, some]))
        # Of about one size: no layer can be normalised over a single example.
        yield from np.array_split(order, self.steps())

    def loss(self, batch: Index, generator: torch.Generator) -> tuple[Tensor, float]:
        """Return the loss of a batch, and its share of right answers."""
        windows, label = self._cut(batch)
        windows, label = self.course.augmentation.windows(windows, label, self.symmetry, generator)
        logits = self.net(windows)
        right = float((logits.detach().argmax(dim=1) == label).float().mean())
        return nn.functional.cross_entropy(logits, label, self._weights), right

    def check(self) -> tuple[float, float]:
        """Return loss and share of right answers on the windows held out."""
        logits, label = self.logits("check")
        if not len(label):
            return float("nan"), float("nan")
        right = float((logits.argmax(dim=1) == label).float().mean())
        return float(nn.functional.cross_entropy(logits, label)), right

    def random(self) -> float:
        """Return the share of right answers on windows at random."""
        logits, label = self.logits("random")
        return float((logits.argmax(dim=1) == label).float().mean()) if len(label) else np.nan

    def better(self, one: Epoch, other: Epoch) -> bool:
        """Whether an epoch's probabilities are better on what is held out."""
        return one.check_loss < other.check_loss

    def logits(self, part: str) -> tuple[Tensor, Tensor]:
        """Return logits (windows, classes) and classes (windows,) of a part."""
        return self.answers(self.ends[part])

    def answers(self, ends: Index) -> tuple[Tensor, Tensor]:
        """Return logits (windows, classes) and classes (windows,) of windows."""
        with torch.no_grad():
            answers = [
                self.net(self._cut(ends[start : start + AT_ONCE])[0])
                for start in range(0, len(ends), AT_ONCE)
            ]
        label = self._label[torch.from_numpy(ends).to(self._device)]
        empty = self._images.new_zeros((0, len(self._weights)))
        return (torch.cat(answers) if answers else empty), label

    def _cut(self, ends: Index) -> tuple[Tensor, Tensor]:
        """Return windows and their classes."""
        last = torch.from_numpy(ends).to(self._device)
        return self._images[last[:, None] + self._steps], self._label[last]


def gesture_net(shape: tuple[int, int, int], classes: int, course: Course) -> GestureNet:
    """Return CNN-3D as a course wants it, for windows of a shape (window, rows, columns)."""
    return GestureNet(
        *shape,
        classes,
        course.channels,
        course.hidden,
        strides=course.strides,
        normalised=course.normalised,
    )


class Places:
    """What CNN-2D learns: where a touch is."""

    def __init__(
        self,
        touches: Touches,
        parts: Parts,
        symmetry: Symmetry,
        course: Course,
        device: torch.device,
    ) -> None:
        """Join them; `parts` are positions in `touches`."""
        self.touches, self.course, self.symmetry = touches, course, symmetry
        _, rows, columns = touches.images.shape
        self.net: nn.Module = location_net((rows, columns), course).to(device)
        self._device = device
        self._images = torch.from_numpy(touches.images).to(device)
        self._place = torch.from_numpy(touches.place).to(device)
        self.parts = {"train": parts.train, "check": parts.check, "random": parts.random}

    def steps(self) -> int:
        """Return how many batches an epoch has."""
        return -(-len(self.parts["train"]) // self.course.batch)

    def batches(self, rng: np.random.Generator) -> Iterator[Index]:
        """Return one epoch's images in batches."""
        yield from np.array_split(rng.permutation(self.parts["train"]), self.steps())

    def loss(self, batch: Index, generator: torch.Generator) -> tuple[Tensor, float]:
        """Return the loss of a batch, and its mean error, grid units."""
        index = torch.from_numpy(batch).to(self._device)
        images, place = self.course.augmentation.images(
            self._images[index], self._place[index], self.symmetry, generator
        )
        if self.course.label_noise:
            noise = torch.randn(place.shape, generator=generator, device=self._device)
            place = place + self.course.label_noise * noise
        off = self.net(images) - place
        error = float(off.detach().abs().mean())
        if not self.course.robust:
            return off.square().mean(), error
        # Huber: the first and last frames of a touch are faint, and must not rule.
        zero = torch.zeros_like(off)
        return nn.functional.smooth_l1_loss(off, zero, beta=self.course.robust), error

    def check(self) -> tuple[float, float]:
        """Return loss and mean error on what is held out."""
        off = self.errors("check")
        if not len(off):
            return float("nan"), float("nan")
        return float(np.square(off).mean()), float(np.abs(off).mean())

    def random(self) -> float:
        """Return the mean error on images at random."""
        off = self.errors("random")
        return float(np.abs(off).mean()) if len(off) else float("nan")

    def better(self, one: Epoch, other: Epoch) -> bool:
        """Whether an epoch errs less on what is held out."""
        return one.check < other.check

    def errors(self, part: str) -> NDArray[np.float32]:
        """Return how far off the answers to a part are, (images, 2), grid units."""
        index = torch.from_numpy(self.parts[part]).to(self._device)
        with torch.no_grad():
            off = self.net(self._images[index]) - self._place[index]
        return np.asarray(off.cpu().numpy(), dtype=np.float32)


def location_net(shape: tuple[int, int], course: Course) -> LocationNet:
    """Return CNN-2D as a course wants it, for images of a shape (rows, columns)."""
    return LocationNet(
        *shape,
        course.channels,
        course.hidden,
        strides=course.strides,
        normalised=course.normalised,
    )


def _weights(label: Index, classes: int, course: Course, answers: int) -> Tensor:
    """Return what each class counts in the loss: gestures that are rare count more."""
    count = np.bincount(label, minlength=classes).astype(np.float64)
    weights = np.ones(classes)
    made = np.flatnonzero(count[1:]) + 1
    if course.balance and len(made):
        usual = count[made[made < answers]].mean()
        weights[made] = np.clip((usual / count[made]) ** course.balance, 0.5, 4.0)
    return torch.from_numpy(weights.astype(np.float32))
