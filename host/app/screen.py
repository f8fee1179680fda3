"""Base class of the screens about the orb."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING, Final, Protocol

from controller.shared.protocol.messages import Command, Contact, Message, Report
from host.app.lessons import Lessons
from host.ui.orb_state import OrbState
from tetris.kit.menu import Menu, Row
from tetris.kit.stage import Stage
from tetris.window.screens.menu_screen import MenuScreen

if TYPE_CHECKING:
    from host.phone.server import PhoneServer

_LETTERS: Final = 44  # of a sentence in a line of a table


class Orb(Protocol):
    """What screens know of the window's orb, and ask it for."""

    ghost: tuple[Contact, ...]  # fingers drawn on the dome that show a gesture; grid units
    zones: bool  # whether the dome shows which command a press gives where
    note: str  # a sentence under the dome; "": the usual ones
    lessons: Lessons  # what it reported about teaching, and the requests about that
    phone: PhoneServer | None  # of the phone that touches a virtual orb

    @property
    def state(self) -> OrbState:
        """The orb as it is drawn: link, image, labels, history."""

    @property
    def virtual(self) -> bool:
        """Whether the orb is connected, and a virtual one, which a mouse can touch."""

    def send(self, message: Message) -> None:
        """Send a message to the orb."""

    def ignore(self, seconds: float) -> None:
        """Take no command for so long: a gesture of the orb's own hand may still be recognised."""


def rows(sentence: str, *, marked: bool = False) -> list[Row]:
    """Return a sentence as lines of a table."""
    return [Row((line,), marked) for line in wrap(sentence, _LETTERS)]


class OrbScreen(MenuScreen):
    """A menu page that takes what the orb recognises and reports before the menu does."""

    def __init__(self, stage: Stage, orb: Orb) -> None:
        self.orb = orb
        super().__init__(stage, self.page, back=self.leave)

    def page(self) -> Menu:
        """Return the menu as things are now."""
        raise NotImplementedError

    def recognised(self, command: Command, time_s: float) -> bool:
        """Take a recognised gesture; return whether it is no step in the menu."""
        return False

    def report(self, message: Report, time_s: float) -> None:
        """Take a report of the orb; those for its picture have been taken already."""

    def leave(self) -> None:
        """Go back, and leave no trace on the dome."""
        self.orb.ghost, self.orb.zones, self.orb.note = (), False, ""
        self._stage.pop()
