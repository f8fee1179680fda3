"""User identification: a network like CNN-3D learns the user from the windows of a gesture."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from controller.recognition.user_id import evidence
from controller.shared.aliases import Index
from models.data import splits
from models.data.augment import vary_user_windows
from models.data.examples import Examples
from models.data.recipe import USER, VARIED_USER, NetworkRecipe, UserAugmentation
from models.results.training import Epoch
from models.training.loop import Task, batched, fit, fit_shown
from models.training.networks import Network, gesture_net

AFTER: Final = 3  # frames behind a gesture whose windows still show it, as the device uses them
APART: Final = 2  # frames: an unclear edge parts no gesture
RANDOM: Final = 0.1  # share of the windows that are drawn at random; the paper does not say
SPARE: Final = 3  # images before a window, for those that are made slower


@dataclass(frozen=True, slots=True)
class UserGestures:
    """Gestures, the windows that show them, and the users who made them."""

    examples: Examples  # holds the windows
    ends: Index  # last frame of each window, in order, (windows,)
    event: Index  # gesture that each window shows, from 0, (windows,)
    label: Index  # class of each gesture, (events,)
    session: Index  # recording of each gesture, (events,)
    user: Index  # the network's output for the user of each gesture, 0 a stranger, (events,)
    day: Index  # number of that user's session, (events,)

    @classmethod
    def of(
        cls,
        examples: Examples,
        labels: Iterable[int],
        user: Sequence[int] | Index = (),
        day: Sequence[int] | Index = (),
    ) -> "UserGestures":
        """Return the gestures of some classes; user and day of each recording are (recordings,)."""
        ends = examples.ends
        label = examples.label[ends]
        session = examples.session[ends].astype(np.int64)
        wanted = np.flatnonzero(np.isin(label, list(labels)))
        begins = examples.begins(ends[wanted], APART)
        event = np.full(len(ends), -1, dtype=np.int64)
        event[wanted] = np.cumsum(begins) - 1
        first = wanted[begins]
        for _ in range(AFTER):  # the rest that follows belongs to it
            before = event[:-1]
            follows = (
                (event[1:] < 0)
                & (before >= 0)
                & (label[1:] == 0)
                & (np.diff(ends) == 1)
                & (session[1:] == session[:-1])
            )
            event[1:][follows] = before[follows]
        kept = np.flatnonzero(event >= 0)
        order = kept[np.argsort(event[kept], kind="stable")]
        recordings = int(examples.session.max(initial=-1)) + 1
        users, days = (
            np.array(own if len(own) else np.zeros(recordings), dtype=np.int64)[session[first]]
            for own in (user, day)
        )
        return cls(examples, ends[order], event[order], label[first], session[first], users, days)

    def some(self, events: NDArray[np.bool_]) -> "UserGestures":
        """Return the gestures of a mask (events,), renumbered."""
        kept = events[self.event]
        of_events = {
            name: getattr(self, name)[events] for name in ("label", "session", "user", "day")
        }
        number = (np.cumsum(events) - 1).astype(np.int64)
        return replace(self, ends=self.ends[kept], event=number[self.event[kept]], **of_events)

    def longer(self, ends: Index, spare: int) -> NDArray[np.float32]:
        """Return windows with some images before them, (ends, spare + window, rows, columns).

        Images before a recording's first are that one.
        """
        examples = self.examples
        start = np.flatnonzero(np.diff(examples.session, prepend=-1))
        first = start[np.searchsorted(start, ends, side="right") - 1]
        index = ends[:, None] + np.arange(1 - examples.window - spare, 1)
        cut: NDArray[np.float32] = examples.images[np.maximum(index, first[:, None])]
        return cut


class UserTask(Task):
    """Training task of the user network."""

    def __init__(
        self,
        taught: UserGestures,
        outputs: int,
        recipe: NetworkRecipe = USER,
        augmentation: UserAugmentation = VARIED_USER,
        random: NDArray[np.bool_] | None = None,
    ) -> None:
        """Learn from gestures; a mask (windows,) are judged at random, and not learned from."""
        examples = taught.examples
        out = np.zeros(len(taught.ends), dtype=np.bool_) if random is None else random
        shape = (examples.window, *examples.images.shape[1:])
        net, (train, drawn) = gesture_net(shape, outputs, recipe), map(np.flatnonzero, (~out, out))
        super().__init__(net, recipe, train, drawn[:0], drawn)
        self.taught, self.augmentation = taught, augmentation
        self._user = taught.user[taught.event]
        # Users are as probable as each other, however long each of them played.
        count = np.bincount(self._user[self.train], minlength=outputs).astype(np.float64)
        usual = count[count > 0].mean()
        weights = np.clip(usual / np.maximum(count, 1.0), 0.25, 4.0)
        self._weights = torch.from_numpy(weights.astype(np.float32))

    def loss(self, batch: Index, generator: torch.Generator) -> tuple[Tensor, float]:
        """Return the loss of a batch (windows,), and its share of right answers."""
        longer = torch.from_numpy(self.taught.longer(self.taught.ends[batch], SPARE))
        user = torch.from_numpy(self._user[batch])
        window = self.taught.examples.window
        logits = self.net(vary_user_windows(self.augmentation, longer, window, generator))
        right = float((logits.detach().argmax(dim=1) == user).float().mean())
        return nn.functional.cross_entropy(logits, user, self._weights), right

    def judge(self, examples: Index) -> tuple[float, float]:
        """Return the share of windows whose user is named; the loss is not computed."""
        named = probabilities(self.net, self.taught, self.taught.ends[examples]).argmax(axis=1)
        return np.nan, float((named == self._user[examples]).mean())


def train_users(
    taught: UserGestures,
    outputs: int,
    seed: int,
    *,
    recipe: NetworkRecipe = USER,
    augmentation: UserAugmentation = VARIED_USER,
    random: NDArray[np.bool_] | None = None,
    name: str = "",
    folder: Path | None = None,
) -> tuple[Network, float]:
    """Return a user network as the device runs it, and its score on windows at random, (windows,).

    With a name the progress is shown; with a folder there is a checkpoint.
    """
    torch.manual_seed(seed)
    task = UserTask(taught, outputs, recipe, augmentation, random)
    epochs = fit_shown(task, name, _describe, seed, folder) if name else fit(task, seed)
    return task.net.folded().eval(), epochs[-1].random


def random_windows(windows: int, seed: int) -> NDArray[np.bool_]:
    """Return which windows are judged by the paper's protocol, drawn at random, (windows,)."""
    return splits.random_windows(windows, RANDOM, np.random.default_rng(seed))


def probabilities(net: nn.Module, gestures: UserGestures, ends: Index) -> NDArray[np.float32]:
    """Return the probability of each user for windows by their last frames, (windows, outputs)."""
    windows = gestures.examples.windows
    logits = batched(net, lambda some: torch.from_numpy(windows(some)), ends)
    return np.asarray(torch.softmax(logits, dim=1).numpy())


def gesture_evidence(net: nn.Module, gestures: UserGestures) -> NDArray[np.float64]:
    """Return the evidence of each gesture for each user, as on the device, (events, outputs)."""
    found, events = evidence(probabilities(net, gestures, gestures.ends)), len(gestures.label)
    total = np.zeros((events, *found.shape[1:]))
    np.add.at(total, gestures.event, found)
    count = np.bincount(gestures.event, minlength=events)
    return np.asarray(total / np.maximum(count, 1)[:, None])


def _describe(epoch: Epoch) -> str:
    words = f"loss {epoch.loss:.3f}, right {epoch.train:.1%}"
    return words + (f" (windows at random {epoch.random:.1%})" if np.isfinite(epoch.random) else "")
