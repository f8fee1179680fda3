"""Targets that commands drive: one module each, found by name."""

import importlib
import pkgutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

import pygame

from controller.errors import UserError
from controller.protocol.messages import Message
from host.ui.orb_state import OrbState

if TYPE_CHECKING:
    from host.connection.receiver import Received


@dataclass(frozen=True, slots=True)
class TargetOptions:
    """What a target may want to know when it is made.

    Attributes:
        seed: Which game.
        mapping: The file of keys for commands; the target's own if None.
        backend: What presses keys; "auto": the best there is.
        dry_run: Print what would be pressed.
        profile: The mapping's profile to begin with; "": its first.
    """

    seed: int = 0
    mapping: Path | None = None
    backend: str = "auto"
    dry_run: bool = False
    profile: str = ""


class TargetError(UserError, ValueError):
    """There is no target of that name."""


class Target(Protocol):
    """Something to play with. All times are seconds of one clock that never turns back."""

    @property
    def size(self) -> tuple[int, int]:
        """Its window's first size, pixels."""

    @property
    def orb(self) -> OrbState:
        """What is known of the orb, kept up by `tick`."""

    def handle(self, event: pygame.event.Event, now_s: float) -> None:
        """Take one event of the window: a key, the mouse, a finger, the focus."""

    def tick(self, now_s: float, received: Sequence["Received"]) -> object:
        """Let time pass and take what came over the link, oldest first."""

    def outgoing(self, now_s: float) -> list[Message]:
        """Return what is to be sent to the device now, such as the player's contacts."""

    def draw(self, surface: pygame.Surface) -> None:
        """Draw everything as it was at the last tick."""

    def close(self) -> None:
        """Let go of everything; called once, however the program ends."""


def names() -> tuple[str, ...]:
    """Return the targets there are."""
    found = [module.name for module in pkgutil.iter_modules(__path__)]
    return tuple(sorted(name for name in found if not name.startswith("_")))


def load(name: str, options: TargetOptions | None = None) -> Target:
    """Make a target: `create(options)` of the module of that name.

    Raises:
        TargetError: There is no such module.
        UserError: What the user asks of it is wrong.
        BackendError: It cannot press keys here.
    """
    if name not in names():
        raise TargetError(f"there is no target {name!r}; there are: {', '.join(names())}")
    module = importlib.import_module(f"{__name__}.{name}")
    return cast(Target, module.create(options or TargetOptions()))
