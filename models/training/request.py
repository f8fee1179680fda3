"""Options of a training, and the base class of its plan."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal

import torch

from models.data.load import Choice
from models.data.recipe import RECIPES, Recipe
from models.results.training import Training
from models.results.users import Telling

TaskName = Literal["both", "gesture", "location", "user", ""]
Say = Callable[[str], None]

PLACE_EPOCHS: Final = 4  # epochs of CNN-2D for each of CNN-3D, if a number is given


@dataclass(frozen=True, slots=True)
class Request:
    """Options of `models train`.

    Attributes:
        paths: Recordings: folders and files; for users at least two sessions of each.
        out: The bundle to write.
        task: Networks to train; "": as many of gesture and location as the data allow.
        recipe: "default" or "paper".
        labels: Which labels are learned.
        every: Recordings that fail the check are taken too.
        base: Bundle of the network that is not trained, or that users are added to; None: the one
            that ships.
        split: "session", "user", "time", "site", or "": what fits.
        seed: Of everything random.
        epochs: Of CNN-3D or the user network; 0: the recipe's.
        window: Images in a window; 0: those of a second, for users the bundle's.
        advised: Learning curves are measured for the advice.
        bare: The bundle holds the trained gesture network, as ONNX, and nothing else.
        auxiliary: Recordings with more gestures, which are learned beside the others and are no
            answers of the bundle.
        others: Recordings of users who are not enrolled: strangers.
        gestures: Labels that identify users; (): all.
        mapping: Mapping file whose [users.NAME] the bundle keeps; None: the base's stay.
        command: As it was typed.
    """

    paths: tuple[Path, ...]
    out: Path
    task: TaskName = ""
    recipe: str = "default"
    labels: Choice = "auto"
    every: bool = False
    base: Path | None = None
    split: str = ""
    seed: int = 0
    epochs: int = 0
    window: int = 0
    advised: bool = True
    bare: bool = False
    auxiliary: tuple[Path, ...] = ()
    others: tuple[Path, ...] = ()
    gestures: tuple[str, ...] = ()
    mapping: Path | None = None
    command: str = ""

    def networks(self) -> Recipe:
        """Return the recipe of the networks, with the epochs given."""
        recipe = RECIPES[self.recipe]
        return replace(
            recipe,
            gesture=recipe.gesture.lasting(self.epochs),
            location=recipe.location.lasting(PLACE_EPOCHS * self.epochs),
        )


class Plan(ABC):
    """A training whose options and data fit together."""

    @abstractmethod
    def train(self, device: torch.device, folder: Path, say: Say) -> Training | Telling:
        """Train the networks; write the bundle, its card and its report.

        Args:
            device: Runs PyTorch.
            folder: Holds checkpoints.
            say: Takes lines of progress.
        """
