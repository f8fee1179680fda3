"""Gesture recognition: CNN-3D learns the class of the last frame of each window."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import torch
from torch import Tensor, nn

from controller.shared.aliases import Index
from models.data.augment import Symmetry, vary_windows
from models.data.examples import Examples
from models.data.load import Data
from models.data.recipe import NetworkRecipe
from models.data.splits import Parts
from models.evaluation import scores
from models.results.training import Epoch, GestureResult
from models.training import transfer
from models.training.loop import AT_ONCE, JUDGED, Task, TrainingJob, batched, fit_shown, spread
from models.training.networks import Network, gesture_net

WINDOWS_HZ: Final = 10.0  # windows of a second that an epoch draws: neighbours are nearly the same


class GestureTask(Task):
    """Training task of CNN-3D; `ends` are last frames: "train", "check" (held out), "random"."""

    def __init__(
        self,
        examples: Examples,
        parts: Parts,
        classes: int,
        symmetry: Symmetry,
        recipe: NetworkRecipe,
        device: torch.device,
        answers: int = 0,
    ) -> None:
        """Join them; parts are positions in `examples.ends`.

        Classes from `answers` on are auxiliary (0: none); the others count in the loss as they do
        without them.
        """
        self.examples, self.symmetry, self._device = examples, symmetry, device
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
        wanted = np.count_nonzero(label) + recipe.null_share * len(self._null)
        share = min(WINDOWS_HZ / examples.rate_hz, recipe.share(wanted))
        self._drawn = round(share * recipe.null_share * len(self._null))
        self._weights = _weights(label, classes, recipe, answers or classes).to(device)
        shape = (examples.window, *examples.images.shape[1:])
        net = gesture_net(shape, classes, recipe).to(device)
        train = self.ends["train"][label != 0]
        super().__init__(net, recipe, train, self.ends["check"], self.ends["random"])
        self._taken = round(share * len(self.train))

    def steps(self) -> int:
        """Return the number of batches of an epoch, which draws some of the windows."""
        return -(-(self._taken + self._drawn) // self.recipe.batch)

    def batches(self, rng: np.random.Generator) -> Iterator[Index]:
        """Yield one epoch's windows in batches, by their last frames, (batch,)."""
        some, touched = rng.choice(self._null, self._drawn, replace=False), self.train
        if self._taken < len(touched):
            touched = rng.choice(touched, self._taken, replace=False)
        order = rng.permutation(np.concatenate([touched, some]))
        yield from np.array_split(order, self.steps())

    def loss(self, batch: Index, generator: torch.Generator) -> tuple[Tensor, float]:
        """Return the loss of a batch (windows,), and its share of right answers."""
        windows, label = self.cut(batch)
        how = self.recipe.augmentation
        windows, label = vary_windows(how, windows, label, self.symmetry, generator)
        logits = self.net(windows)
        right = float((logits.detach().argmax(dim=1) == label).float().mean())
        return nn.functional.cross_entropy(logits, label, self._weights), right

    def judge(self, examples: Index) -> tuple[float, float]:
        """Return loss and share of right answers on some of the windows, by their last frames."""
        logits, label = self.answers(spread(examples, JUDGED))
        right = float((logits.argmax(dim=1) == label).float().mean())
        return float(nn.functional.cross_entropy(logits, label)), right

    def answers(self, ends: Index) -> tuple[Tensor, Tensor]:
        """Return logits (windows, classes) and classes (windows,) by the windows' last frames."""
        label = self._label[torch.from_numpy(ends).to(self._device)]
        return batched(self.net, lambda some: self.cut(some)[0], ends), label

    def cut(self, ends: Index) -> tuple[Tensor, Tensor]:
        """Return windows (batch, window, rows, columns) and their classes (batch,)."""
        last = torch.from_numpy(ends).to(self._device)
        return self._images[last[:, None] + self._steps], self._label[last]


def gesture_task(
    data: Data,
    parts: Parts,
    recipe: NetworkRecipe,
    seed: int,
    device: torch.device,
    answers: int = 0,
) -> GestureTask:
    """Return CNN-3D's task on a data set's examples, its weights drawn by the seed."""
    symmetry = Symmetry.of(data.vocabulary, *data.examples.images.shape[1:])
    torch.manual_seed(seed)
    classes = len(data.vocabulary.labels)
    return GestureTask(data.examples, parts, classes, symmetry, recipe, device, answers)


def train_gestures(job: TrainingJob) -> tuple[GestureResult, Network]:
    """Return CNN-3D's scores and the network as the device runs it, calibrated by its recipe."""
    examples = job.data.examples
    classes = job.answers or len(job.data.vocabulary.labels)
    recipe, parts = job.recipe.gesture, job.split.windows
    task = gesture_task(job.data, parts, recipe, job.seed, job.device, classes)
    if job.start.gesture:
        known = task.ends["train"]
        some = task.cut(known[:: 1 + len(known) // AT_ONCE])[0]
        transfer.begin(task.net, job.start.gesture, some)
    epochs = fit_shown(task, "CNN-3D", _describe, job.seed, job.folder)
    # From here on there are no auxiliary classes, nor their windows.
    ends = {part: every[examples.label[every] < classes] for part, every in task.ends.items()}
    logits, label = (one.cpu().numpy() for one in task.answers(ends["check"]))
    logits = logits[:, :classes]
    random = task.answers(ends["random"])[0][:, :classes].argmax(dim=1).cpu().numpy()
    temperature = scores.temperature(logits, label) if job.recipe.scaled else 1.0
    net = task.net.cpu().folded().narrowed(classes)
    with torch.no_grad():
        for parameter in net.get_submodule("out").parameters():
            parameter.div_(temperature)
    named = logits.argmax(axis=1)
    made, called = scores.events(examples, ends["check"], scores.softmax(logits, temperature))
    right = called == made
    result = GestureResult(
        epochs,
        scores.score_windows(examples, (ends["check"], named), (ends["random"], random)),
        float(right.mean()) if len(right) else np.nan,
        scores.confusion(named, label, classes),
        scores.confusion(called, made, classes),
        scores.calibration(logits, label, temperature),
        net.weights(),
    )
    return result, net.eval()


def _describe(epoch: Epoch) -> str:
    return (
        f"loss {epoch.loss:.3f}, unseen {epoch.check_loss:.3f}, "
        f"right {epoch.check:.1%} (windows at random {epoch.random:.1%})"
    )


def _weights(label: Index, classes: int, recipe: NetworkRecipe, answers: int) -> Tensor:
    """Return each class's weight in the loss, (classes,): rare gestures count more."""
    count = np.bincount(label, minlength=classes).astype(np.float64)
    weights = np.ones(classes)
    made = np.flatnonzero(count[1:]) + 1
    if recipe.balance and len(made):
        usual = count[made[made < answers]].mean()
        weights[made] = np.clip((usual / count[made]) ** recipe.balance, 0.5, 4.0)
    return torch.from_numpy(weights.astype(np.float32))
