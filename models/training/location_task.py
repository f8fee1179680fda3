"""Touch position: CNN-2D learns the place of a touch from its image."""

import sys

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from controller.shared.aliases import Index
from models.data import touch_images
from models.data.augment import Symmetry, vary_images
from models.data.load import Data
from models.data.recipe import NetworkRecipe
from models.data.splits import Parts
from models.data.touch_images import Touches
from models.evaluation import scores
from models.results.training import Epoch, LocationResult
from models.training import transfer
from models.training.loop import AT_ONCE, JUDGED, Task, TrainingJob, fit_shown, spread
from models.training.networks import Network, location_net


class LocationTask(Task):
    """Training task of CNN-2D; `parts` are positions in `touches`."""

    def __init__(
        self,
        touches: Touches,
        parts: Parts,
        symmetry: Symmetry,
        recipe: NetworkRecipe,
        device: torch.device,
    ) -> None:
        inputs, corners = recipe.touch.of(touches.images)
        net = location_net(inputs.shape[1:], recipe).to(device)
        super().__init__(net, recipe, parts.train, parts.check, parts.random)
        self.touches, self.symmetry, self._device = touches, symmetry, device
        self._images = torch.from_numpy(inputs).to(device)
        self._place = torch.from_numpy(touches.place - corners).to(device)  # in the input

    def loss(self, batch: Index, generator: torch.Generator) -> tuple[Tensor, float]:
        """Return the loss of a batch (images,), and its mean error, grid units."""
        index = torch.from_numpy(batch).to(self._device)
        images, place = vary_images(
            self.recipe.augmentation,
            self._images[index],
            self._place[index],
            self.symmetry,
            generator,
        )
        if self.recipe.label_noise:
            noise = torch.randn(place.shape, generator=generator, device=self._device)
            place = place + self.recipe.label_noise * noise
        off = self.net(images) - place
        error = float(off.detach().abs().mean())
        if not self.recipe.robust:
            return off.square().mean(), error
        # Huber: the first and last frames of a touch are faint, and must not rule.
        zero = torch.zeros_like(off)
        return nn.functional.smooth_l1_loss(off, zero, beta=self.recipe.robust), error

    def judge(self, examples: Index) -> tuple[float, float]:
        """Return loss and mean error on some of the images."""
        off = self.errors(spread(examples, JUDGED))
        return float(np.square(off).mean()), float(np.abs(off).mean())

    def errors(self, images: Index) -> NDArray[np.float32]:
        """Return the errors of some of the images, (images, 2), grid units."""
        index = torch.from_numpy(images).to(self._device)
        with torch.no_grad():
            off = self.net(self._images[index]) - self._place[index]
        return np.asarray(off.cpu().numpy(), dtype=np.float32)

    def half_strength(self) -> float:
        """Return the mean distance that held-out places move at half their strength, grid units."""
        index = self.check
        inputs, corners = self.recipe.touch.of(0.5 + 0.5 * self.touches.images[index])
        with torch.no_grad():
            places = self.net(torch.from_numpy(inputs).to(self._device)).cpu().numpy() + corners
        moved = places - self.touches.place[index] - self.errors(index)
        return _mean(np.hypot(moved[:, 0], moved[:, 1]))


def location_task(
    data: Data,
    found: Touches,
    parts: Parts,
    recipe: NetworkRecipe,
    seed: int,
    device: torch.device,
) -> LocationTask:
    """Return CNN-2D's task on images of touches, its weights drawn by the seed."""
    # Only located gestures have a place; turned and mirrored as the strictest of them allows.
    located = [data.vocabulary.labels.index(name) for name in data.vocabulary.located]
    whole = Symmetry.of(data.vocabulary, *data.examples.images.shape[1:])
    torch.manual_seed(seed)
    return LocationTask(found, parts, whole.common(located), recipe, device)


def train_locations(job: TrainingJob, found: Touches) -> tuple[LocationResult, Network]:
    """Return CNN-2D's scores on images of touches, and the network as the device runs it."""
    data = job.data
    parts = touch_images.split_touches(job.split, data.examples, found, job.seed)
    if parts.words:
        print(parts.words, file=sys.stderr)
    task = location_task(data, found, parts, job.recipe.location, job.seed, job.device)
    if job.start.location:
        inputs, _ = job.recipe.location.touch.of(found.images[:AT_ONCE])
        transfer.begin(task.net, job.start.location, torch.from_numpy(inputs))
    epochs = fit_shown(task, "CNN-2D", _describe, job.seed, job.folder)
    off = task.errors(parts.check)
    last = found.last[parts.check]
    place, error = found.place[parts.check][last], off[last]
    away = scores.between_taxels(place.astype(np.float64))
    each = np.abs(error).mean(axis=1)
    session = data.examples.session[found.frame[parts.check]]
    scored = scores.score_errors(session, off, task.errors(parts.random))
    net = task.net.cpu().folded()
    result = LocationResult(
        epochs,
        scored,
        tuple(tuple(row) for row in np.hstack([place, error]).astype(float).tolist()),
        _mean(each[~away]),
        _mean(each[away]),
        net.weights(),
        parts.words,
        scores.position_spread(found.blur[parts.check], off.astype(np.float64)),
        task.half_strength(),
    )
    return result, net.eval()


def _describe(epoch: Epoch) -> str:
    return (
        f"error {epoch.train:.3f}, unseen {epoch.check:.3f} grid units "
        f"(images at random {epoch.random:.3f})"
    )


def _mean(values: NDArray[np.floating]) -> float:
    return float(values.mean()) if len(values) else np.nan
