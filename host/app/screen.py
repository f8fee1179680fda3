"""The window's orb as its screens know it, and the base classes of screens about it."""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any, Final

import pygame

from controller.shared.errors import UserError
from controller.shared.protocol.link_events import Connected, Received
from controller.shared.protocol.messages import Command, Contact, Message, Report
from host.app.lessons import Lessons
from host.connection import bundle_upload
from host.connection.bundle_upload import BundleUpload
from host.targets import Target
from host.ui import sprites
from host.ui.orb_state import OrbState
from tetris.engine.events import Event
from tetris.engine.game import Game
from tetris.kit import theme
from tetris.kit.language import Words
from tetris.kit.menu import Item, Menu, Row
from tetris.kit.menu_view import wrapped
from tetris.kit.stage import PLAY_HZ, Screen, Stage
from tetris.kit.theme import Colour
from tetris.window.effects import sounds_of
from tetris.window.menu_screen import MenuScreen
from tetris.window.view import Figure, GameView

_ICON: Final = 1.1  # of the letters' size
_LETTERS: Final = 44  # of a sentence in a line of a table
_LEAST, _MOST = 0.36, 0.5  # of a game page's width, for the column
_FITS: Final = 250  # design units of a column whose letters are as large as the player wants
_BOARD: Final = 0.97  # of the area's height, a board's width with what stands beside it
_EDGE: Final = 30  # left of letters and above them, design units like all below


class Orb(Target):
    """The orb of the window: its state, and what screens ask of it.

    Attributes:
        ghost: Fingers drawn on the dome that show a gesture; grid units.
        zones: Whether the dome shows which command a press gives where.
        note: A sentence under the dome; "": the usual ones.
        lessons: What it reported about teaching, and the requests about that.
        aims: Whether touches steer pieces by their place, as far as is known.
        screen_touched: Whether fingers on a touch screen have touched it.
        originals: English sentences of which the window says in its language that there are some.
        upload: The installation of a bundle under way, or the last one; None before.
    """

    def __init__(self) -> None:
        super().__init__()
        self.ghost: tuple[Contact, ...] = ()
        self.zones, self.note = False, ""
        self.lessons = Lessons(self.send, first=int(time.time()))  # no example had this number
        self.originals: dict[str, None] = {}
        self.upload: BundleUpload | None = None
        self.aims = self.screen_touched = False
        self._due: list[Message] = []  # for the orb
        self._now_s = self._deaf_until_s = 0.0  # no command is taken before

    @property
    def state(self) -> OrbState:
        """The orb as it is drawn: link, image, labels, history."""
        return self.orb

    @property
    def by_fingers(self) -> bool:
        """Whether fingers touch a virtual orb: on a phone, or on a touch screen."""
        phone = self.phone is not None and self.phone.phone is not None
        return phone or self.screen_touched

    def send(self, message: Message) -> None:
        """Send a message to the orb with the next ones."""
        self._due.append(message)

    def ignore(self, seconds: float) -> None:
        """Take no command for so long: a gesture of the orb's own hand may still be recognised."""
        self._deaf_until_s = self._now_s + seconds

    def install(self, path: Path) -> str:
        """Send the orb a bundle unless one is under way; return why the file cannot be sent."""
        if self.upload is None or self.upload.over:
            try:
                self.upload = bundle_upload.load(path)
            except UserError as error:
                return str(error)
            if self.orb.link == "live" and self.orb.welcome:
                self._upload([Connected(self.orb.welcome)])
        return ""

    def _upload(self, received: list[Received]) -> None:
        """Let an installation go on with what was received."""
        if self.upload is not None and not self.upload.over:
            self.upload.turn(received, self._now_s, self.send)

    def outgoing(self, now_s: float) -> list[Message]:
        """Return the messages for the device: wishes, and contacts on a virtual orb."""
        due, self._due = self._due, []
        return [*due, *super().outgoing(now_s)]


def rows(sentence: str, *, marked: bool = False) -> list[Row]:
    """Return a sentence as lines of a table."""
    return [Row((line,), marked) for line in wrap(sentence, _LETTERS)]


@dataclass(frozen=True, slots=True)
class Line:
    """A paragraph on a page."""

    text: str  # wrapped
    size: int  # of the letters, design units
    colour: Colour  # of the letters, and of the icon
    icon: str = ""  # name of one before the letters; "": none
    after: int = 12  # space below it, design units


class OrbScreen(MenuScreen):
    """A menu page that takes what the orb recognises and reports before the menu does."""

    long_leaves = True  # whether a long pinch leaves it while gestures are no steps

    def __init__(self, stage: Stage, orb: Orb) -> None:
        self.orb = orb
        super().__init__(stage, self.page, back=self.leave)

    @property
    def words(self) -> Words:
        """The texts in the present language."""
        return self._stage.look.words

    def page(self) -> Menu:
        """Return the menu as things are now."""
        raise NotImplementedError

    def item(
        self, key: str, do: Callable[[], None] | None = None, value: str = "", **how: Any
    ) -> Item:
        """Return an item with the words of a key; its hint is KEY_hint unless another is given.

        Of a page's title, TABLE.title, it is TABLE.hint. `how` is as in `Item`.
        """
        table, _, name = key.rpartition(".")
        hint = f"{table}.hint" if name == "title" else f"{key}_hint"
        text = self.words(hint)
        return Item(self.words(key), do, value, **{"hint": "" if text == hint else text, **how})

    def back_item(self, **how: Any) -> Item:
        """Return the item that leaves the page."""
        return self.item("menu.back", self.leave, **how)

    def link_rows(self) -> list[Row]:
        """Return why there is no link, as lines of a table."""
        state = self.orb.state
        return rows(self._stage.told(state.reason) or self.words(f"orbs.link_{state.link}"))

    def opening(self, page: Callable[..., Screen], *rest: Any) -> Callable[[], None]:
        """Return what shows a page about the orb on top of this one; `rest` as it needs."""
        return lambda: self._stage.push(page(self._stage, self.orb, *rest))

    def installation(self) -> tuple[str, float | None]:
        """Return what became of the last installation, or its stage and share; "" without one."""
        upload = self.orb.upload
        if upload is None:
            return "", None
        if upload.over:
            return self._stage.told(bundle_upload.outcome(upload)), None
        return self.words(f"install.{upload.stage}"), upload.offset / upload.size

    def draw_lines(
        self, surface: pygame.Surface, inner: pygame.Rect, lines: Sequence[Line], unit: float
    ) -> int:
        """Draw paragraphs in a rectangle as far as they fit; return where they end."""
        top = inner.top
        for line in lines:
            size, left = max(1, round(line.size * unit)), inner.left
            high = theme.font(size).get_linesize()
            if line.icon:
                side = round(size * _ICON)
                mark = sprites.icon(line.icon, side, line.colour)
                surface.blit(mark, mark.get_rect(midleft=(left, top + high // 2)))
                left += round(1.4 * side)
            room = max(1, inner.right - left)
            for words in wrapped(line.text, size, room):
                picture = theme.fitted(words, size, line.colour, room)
                if top + high <= inner.bottom:
                    surface.blit(picture, (left, top))
                top += high
            top += round(line.after * unit)
        return top

    def recognised(self, command: Command, time_s: float) -> bool:
        """Take a recognised gesture; return whether it is no step in the menu."""
        return False

    def report(self, message: Report, time_s: float) -> None:
        """Take a report of the orb; those for its picture have been taken already."""

    def link_lost(self) -> None:
        """Give up what was under way over the link."""

    def leave(self) -> None:
        """Go back, and leave no trace on the dome."""
        self.orb.ghost, self.orb.zones, self.orb.note = (), False, ""
        self._stage.pop()


class GamePage(OrbScreen):
    """A page with a game: text and items in a column, the game's board beside them.

    Attributes:
        game: The game that is drawn.
    """

    def __init__(self, stage: Stage, orb: Orb, game: Game) -> None:
        """Show a game in the stage; `lines` and `page` say what stands beside it."""
        self.game = game
        self._game_view = GameView(stage.area, look=stage.look, card=bool(self.figures()))
        super().__init__(stage, orb)

    @property
    def frames_hz(self) -> int:
        """As often as a game that is played."""
        return PLAY_HZ

    def lines(self, time_s: float) -> Sequence[Line]:
        """Return the paragraphs of the column, the uppermost first."""
        raise NotImplementedError

    def figures(self) -> Sequence[Figure]:
        """Return the numbers beside the board."""
        return ()

    def show(self, events: Iterable[Event]) -> None:
        """Let what happened in the game be seen and heard."""
        happened = list(events)
        self._game_view.show(happened)
        for sound in sounds_of(happened):
            self._stage.sounds.play(sound, "effects")

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the column and the game."""
        area, scale = self._stage.area, max(1.0, self._stage.settings.scale / 100)
        surface.fill(self._stage.look.palette.background)
        least = min(_MOST, _LEAST * scale) * area.width
        wide = min(max(area.width - _BOARD * area.height, least), _MOST * area.width)
        unit = min(self._stage.unit, wide / _FITS)
        column = pygame.Rect(0, 0, round(wide), area.height)
        beside = pygame.Rect(column.right, 0, area.width - column.right, area.height)
        view = self._game_view
        view.place(beside, self._stage.look)
        view.draw(surface, self.game, time_s, figures=self.figures())
        edge = round(_EDGE * unit)
        column.top = max(edge, view.layout.board.top)
        menu = Menu("", self.menu.items)
        high = self._view.height(menu, unit) + len(menu.items)  # a pixel each for rounding
        items = pygame.Rect(0, 0, column.width, high)
        items.bottom = min(area.bottom - edge // 2, view.layout.board.bottom)
        inner = pygame.Rect(edge, column.top, column.width - edge, items.top - column.top)
        self.draw_lines(surface, inner, self.lines(time_s), unit)
        self._view.draw(surface, items, menu, self.selected, unit)
