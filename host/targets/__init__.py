"""Targets of commands, found by name: a module each, and two kinds of keys.

Their base class holds the orb's state, and the contacts on a virtual orb.
"""

from __future__ import annotations

import importlib
import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

import pygame

from controller.shared import plugins
from controller.shared.errors import UserError
from controller.shared.protocol.messages import Message
from host.connection.receiver import Connected, Lost, Received, Refused, Stale
from host.phone import page
from host.ui.orb_state import OrbState
from host.ui.pointer_input import DomeArea, PointerInput
from tetris.kit import language

if TYPE_CHECKING:
    from host.phone.server import PhoneServer

# Modules of the targets that have no module of their own name here.
_KEYS: Final = ("keyboard", "gamepad")
_MODULES: Final = {**dict.fromkeys(_KEYS, "host.targets.keys"), "tetris": "host.app.application"}
SIZE: Final = (1280, 720)  # of a window at first; it can be resized


@dataclass(frozen=True, slots=True)
class TargetOptions:
    """Options of all targets."""

    seed: int | None = None  # of a game that begins at once; None: a menu comes first
    sound: bool = True  # whether the game makes sounds
    mapping: Path | None = None  # file of the key mapping; None: the target's own
    backend: str = "auto"  # of key injection; "auto": the best available; "print": none
    profile: str = ""  # the mapping's initial one; "": its first
    demo: int | None = None  # seed of a game that the orb's own hand plays at once; None: none


class Target(ABC):
    """A program driven by commands. All times are seconds of one monotonic clock.

    Attributes:
        windowed: Whether it has a window.
        size: Initial size of the window, pixels.
        orb: State of the orb, updated by `tick`.
        touch: Contacts on a virtual orb.
        phone: Server of the phone that touches it, too; None without one.
        closed: Whether the player has left it, so that the program ends.
        fullscreen: Whether its window fills the screen.
    """

    windowed = True
    size = SIZE
    fullscreen = False

    @property
    def frames_hz(self) -> int:
        """How often there is something new to draw while no key is pressed."""
        return 60

    def __init__(self) -> None:
        self.orb = OrbState()
        self.touch = PointerInput()
        self.phone: PhoneServer | None = None
        self._ends: list[Message] = []  # where fingers were when they left the dome
        self.closed = False

    @abstractmethod
    def tick(self, now_s: float, received: Sequence[Received] = ()) -> object:
        """Advance to the present time and process received events, oldest first."""

    def handle(self, event: pygame.event.Event, now_s: float) -> None:  # noqa: B027
        """Process an event of the window: a key, the mouse, a finger, the focus."""

    def draw(self, surface: pygame.Surface) -> None:  # noqa: B027
        """Draw the state of the last tick."""

    @property
    def words(self) -> language.Words:
        """The language of its texts."""
        return language.load(language.FALLBACK)

    @property
    def profile(self) -> str:
        """The active profile of the key mapping; "" without a mapping."""
        return ""

    def outgoing(self, now_s: float) -> list[Message]:
        """Return the messages for the device: the contacts on a virtual orb, if they changed."""
        if self.phone is not None:
            self.touch.phone, pad = self.phone.contacts, self.touch.pad
            self.phone.pad, self.phone.view = pad, page.view(self.orb, self.words, pad, now_s)
        self.orb.contacts = self.touch.contacts(now_s) if self.virtual else ()
        contacts = self.touch.update(now_s) if self.virtual else None
        ends, self._ends = self._ends, []
        return [*ends, contacts] if contacts else ends

    def close(self) -> None:  # noqa: B027
        """Release held keys; called once, however the program ends."""

    @property
    def virtual(self) -> bool:
        """Whether the orb is connected, and a virtual one, which a mouse can touch."""
        return self.orb.link == "live" and bool(self.orb.welcome and self.orb.welcome.virtual)

    def observe(self, item: Received, now_s: float) -> None:
        """Update the orb's state by a received event; contacts end with the link."""
        self.orb.observe(item, now_s)
        match item:
            case Connected(welcome=welcome):
                self.touch.lift_all()
                self.touch.pad = DomeArea(welcome.rows, welcome.columns, welcome.pitch_mm)
            case Stale() | Lost() | Refused():
                self.touch.lift_all()


def names() -> tuple[str, ...]:
    """Return the names of all targets."""
    found = {module.name for module in pkgutil.iter_modules(__path__)}
    return tuple(sorted(found.difference({"keys"}).union(_MODULES)))


def load(name: str, options: TargetOptions | None = None) -> Target:
    """Make a target: `create(options)` of its module, of keys `create(name, options)`.

    UserError if there is none or of an option, BackendError if it cannot press keys here.
    """
    if name not in names():
        if (found := plugins.find("targets", name)) is not None:
            return cast(Target, found.create(options or TargetOptions()))
        known = ", ".join((*names(), *plugins.names("targets")))
        raise UserError(f"there is no target {name!r}; there are: {known}")
    module = importlib.import_module(_MODULES.get(name, f"{__name__}.{name}"))
    kind = (name,) if name in _KEYS else ()
    return cast(Target, module.create(*kind, options or TargetOptions()))
