"""Effects of events: light and words on the board ("T-SPIN DOUBLE", "+1,200"), sounds.

Settings without motion show the words alone, and nothing flashes.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

import pygame

from tetris.engine import events as happened
from tetris.engine.events import Action, Event
from tetris.engine.moves import Spin
from tetris.kit import theme
from tetris.kit.settings import Look
from tetris.kit.theme import Colour
from tetris.window.scenery import Layout
from tetris.window.tiles import tiles_of

_LOCK_S: Final = 0.16  # how long each lasts, seconds; chosen by eye
_TRAIL_S: Final = 0.30
_TRAIL_ALPHA: Final = 110  # where it is brightest, of 255
_CLEAR_S: Final = 0.36
_APART_S: Final = 0.34  # between flashes: WCAG 2.3.1 allows three in any second
_LASTS_S: Final = 1.4
_HIGH: Final = 0.16  # of the board, above the words on it
_LARGE, _SMALL = 1.9, 1.15  # first line and others, letters
_POP_S: Final = 0.12  # the words come in a little from below
_FADE_FROM: Final = 0.7  # of its time
_MOST: Final = 24  # effects alive at once; a fast player would pile them up

_LINE_SOUNDS: Final = ("lock", "single", "double", "triple", "tetris")
_MOST_COMBO: Final = 5  # no combo sounds higher
_SOUNDS: Final[Mapping[type[Event], str]] = {
    happened.Rotated: "rotate",
    happened.Held: "hold",
    happened.Dropped: "drop",
    happened.LevelUp: "level",
    happened.ToppedOut: "over",
    happened.Finished: "won",
    happened.Undone: "undo",
}

Line = tuple[str, Colour]
Drawing = Callable[[pygame.Surface, Layout, float], None]  # at an age from 0, new, to 1, gone


class Effects:
    """Lights and words alive at present; each is begun by an event and dies of age.

    New words take the place of older ones.
    """

    def __init__(self, look: Look) -> None:
        self._look = look
        self._lights: list[tuple[float, float, Drawing]] = []  # begin and duration, seconds
        self._lit_s = -_APART_S  # when something was lit last
        self._lines: list[Line] = []
        self._said_s = 0.0
        self._words: pygame.Surface | None = None  # picture of the lines

    def show(self, events: Iterable[Event], cell: int, *, paced: bool = False) -> None:
        """Begin what the events call for, on cells of so many pixels.

        Without motion there are words alone. What lights or dims the board begins at most three
        times a second. A new level of a paced game is a faster one, no more.
        """
        for event in events:
            if isinstance(event, happened.Restarted):
                self.clear()
            self._say(event, paced=paced)
            soon = self._lit_s < event.time_s < self._lit_s + _APART_S
            if self._look.settings.motion and not soon:
                lights = [(event.time_s, *each) for each in self._lit(event, cell)]
                self._lights += lights
                self._lit_s = event.time_s if lights else self._lit_s
        del self._lights[:-_MOST]

    def _lit(self, event: Event, cell: int) -> Iterator[tuple[float, Drawing]]:
        """Yield the duration and the drawing of what an event lights or dims."""
        palette = self._look.palette
        match event:
            case happened.Dropped(rows=fallen) if fallen:
                yield _TRAIL_S, _trail(event, cell, self._look)
            case happened.Locked(rows=cleared) if cleared:
                yield _CLEAR_S, _bands(event, palette.background)
            case happened.Locked():
                yield _LOCK_S, _flash(event, cell, palette.flash)

    def _say(self, event: Event, *, paced: bool) -> None:
        """Begin the words that an event calls for."""
        lines: list[Line] = []
        match event:
            case happened.Locked():
                lines = praise(event, self._look)
            case happened.LevelUp(level=level):
                key = "callout.faster" if paced else "callout.level"
                fresh = self._lines if self._said_s == event.time_s else []
                lines = [*fresh, (self._look.words(key, level=level), self._look.palette.good)]
        if lines:
            self._lines, self._said_s, self._words = lines, event.time_s, None

    @property
    def lit(self) -> bool:
        """Whether anything is lit or dimmed at present."""
        return bool(self._lights)

    @property
    def alive(self) -> bool:
        """Whether anything is seen at present."""
        return bool(self._lights or self._lines)

    def clear(self) -> None:
        """Forget all."""
        self._lights.clear()
        self._lines = []

    def draw(self, surface: pygame.Surface, layout: Layout, time_s: float) -> None:
        """Draw what is alive, and forget what is over."""
        self._lights = [each for each in self._lights if time_s - each[0] < each[1]]
        for begin_s, lasts_s, draw in self._lights:
            draw(surface, layout, max(0.0, (time_s - begin_s) / lasts_s))
        age_s = max(0.0, time_s - self._said_s)
        if age_s >= _LASTS_S:
            self._lines = []
        if not self._lines:
            return
        if self._words is None:
            self._words = _drawn(self._lines, layout, self._look.palette.well)
        sunk = 0.0
        if self._look.settings.motion:
            age = age_s / _LASTS_S
            self._words.set_alpha(round(255 * min(1.0, (1 - age) / (1 - _FADE_FROM))))
            sunk = max(0.0, 1 - age_s / _POP_S) * 0.5 * layout.cell
        board = layout.board
        surface.blit(self._words, (board.left, board.top + _HIGH * board.height + sunk))


def _flash(event: happened.Locked, cell: int, colour: Colour) -> Drawing:
    """Return the drawing of a locked piece that is lit for a moment."""
    picture = pygame.Surface((cell, cell), pygame.SRCALPHA)
    inner = (1, 1, cell - 2, cell - 2)
    pygame.draw.rect(picture, colour, inner, border_radius=cell // 7)

    def draw(surface: pygame.Surface, layout: Layout, age: float) -> None:
        picture.set_alpha(round(140 * (1 - age)))
        surface.fblits([(picture, layout.at(x, y)) for x, y in event.piece.cells])

    return draw


def _trail(event: happened.Dropped, cell: int, look: Look) -> Drawing:
    """Return the drawing of light above a dropped piece, brightest where it came to rest."""
    colour = theme.mix(tiles_of(look).colour(event.piece.kind), look.palette.flash, 0.35)
    height = event.rows * cell
    shades = min(height, _TRAIL_ALPHA)  # more could not be told apart
    strip = pygame.Surface((1, shades), pygame.SRCALPHA)
    for row in range(shades):
        strip.set_at((0, row), (*colour, round(_TRAIL_ALPHA * (row / shades) ** 2)))
    strip = pygame.transform.scale(strip, (max(1, cell - 2), height))
    tops = dict(sorted(event.piece.cells))  # the highest cell of each column

    def draw(surface: pygame.Surface, layout: Layout, age: float) -> None:
        strip.set_alpha(round(255 * (1 - age)))
        for x, y in tops.items():
            left, top = layout.at(x, y + event.rows)
            surface.blit(strip, (left + 1, top))

    return draw


def _bands(event: happened.Locked, colour: Colour) -> Drawing:
    """Return the drawing of dark bands where rows were cleared, which close."""

    def draw(surface: pygame.Surface, layout: Layout, age: float) -> None:
        width, height = layout.board.width, layout.cell
        band = pygame.Surface((width, max(1, round(height * (1 - age)))))
        band.fill(colour)
        band.set_alpha(round(200 * (1 - age) ** 1.5))
        for y in event.rows:
            x_px, y_px = layout.at(0, y)
            surface.blit(band, (x_px, y_px + (height - band.get_height()) // 2))

    return draw


# -- words -------------------------------------------------------------------------------------


def _drawn(lines: Iterable[Line], layout: Layout, edge_colour: Colour) -> pygame.Surface:
    """Return a picture of lines below each other, each with an edge that blocks do not hide."""
    wide, edge = layout.board.width, max(1, layout.cell // 12)
    around = [(x, y) for x in (-edge, 0, edge) for y in (-edge, 0, edge) if x or y]
    picture, top = pygame.Surface(layout.board.size, pygame.SRCALPHA), edge
    for row, (words, colour) in enumerate(lines):
        size, room = round(layout.letter * (_SMALL if row else _LARGE)), wide - 4 * edge
        line = theme.fitted(words, size, colour, room)
        shade = theme.fitted(words, size, edge_colour, room)
        left = (wide - line.get_width()) // 2
        picture.blits([(shade, (left + x, top + y)) for x, y in around])
        picture.blit(line, (left, top))
        top += line.get_height()
    return picture


def praise(event: happened.Locked, look: Look) -> list[Line]:
    """Return the lines about a lock, the greatest first, each with its colour."""
    clear, palette, words = event.clear, look.palette, look.words
    lines: list[Line] = []
    if clear.perfect:
        lines.append((words("callout.perfect"), palette.good))
    if clear.name:
        grand = clear.difficult or clear.name.endswith("t-spin")
        key = clear.name.replace(" ", "_").replace("-", "_")
        lines.append((words(f"clears.{key}").upper(), palette.accent if grand else palette.text))
    if clear.b2b:
        lines.append((words("callout.b2b"), palette.warn))
    if clear.combo > 0:
        lines.append((words("callout.combo", count=clear.combo), palette.cool))
    if clear.points:
        lines.append((words.number(clear.points, "+,"), palette.text))
    return lines


# -- sounds ------------------------------------------------------------------------------------


def sounds_of(events: Iterable[Event]) -> Iterable[str]:
    """Return the names of the sounds of a frame's events, each once."""
    heard: dict[str, None] = {}
    for event in events:
        if name := _sound_of(event):
            heard[name] = None
        if isinstance(event, happened.Locked) and event.clear.combo > 0:
            heard[f"combo_{min(_MOST_COMBO, event.clear.combo)}"] = None
    return heard


def _sound_of(event: Event) -> str:
    """Return the name of an event's sound; "" for silent ones."""
    match event:
        case happened.Moved(action=Action.LEFT | Action.RIGHT):
            return "shift"
        case happened.Locked(clear=clear) if clear.perfect:
            return "perfect"
        case happened.Locked(clear=clear) if clear.spin is not Spin.NONE:
            return "spin" if clear.spin is Spin.FULL else "mini"
        case happened.Locked(clear=clear):
            return _LINE_SOUNDS[clear.lines]
    return _SOUNDS.get(type(event), "")
