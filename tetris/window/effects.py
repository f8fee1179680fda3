"""What flashes and fades after an event: locks, clears, drops, and words of praise."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Final

import pygame

from tetris import events as happened
from tetris.events import Event
from tetris.pieces import COLUMNS
from tetris.window import theme
from tetris.window.layout import Layout
from tetris.window.theme import Colour

_LOCK_S: Final = 0.16  # how long each lasts, seconds; chosen by eye
_TRAIL_S: Final = 0.30
_CLEAR_S: Final = 0.40
_WORDS_S: Final = 1.4
_MOST: Final = 24  # effects alive at once; a fast player would pile them up

_Line = tuple[str, Colour]


class Effects:
    """The effects alive at present; each is begun by an event and dies of age."""

    def __init__(self) -> None:
        self._alive: list[_Effect] = []
        self._words: _Words | None = None

    def show(self, events: Iterable[Event], cell: int) -> None:
        """Begin what the events call for, for blocks of `cell` pixels."""
        for event in events:
            match event:
                case happened.Dropped(rows=rows) if rows:
                    self._alive.append(_Trail(event, cell))
                case happened.Locked(rows=rows) if rows:
                    self._alive.append(_Rows(event))
                    self._say(event.time_s, praise(event), cell)
                case happened.Locked():
                    self._alive.append(_Flash(event, cell))
                    self._say(event.time_s, praise(event), cell)
                case happened.LevelUp(level=level):
                    earlier = self._words.lines if self._words else []
                    self._say(event.time_s, [*earlier, (f"LEVEL {level}", theme.GOOD)], cell)
                case happened.Restarted():
                    self.clear()
        del self._alive[:-_MOST]

    def clear(self) -> None:
        """Forget all."""
        self._alive.clear()
        self._words = None

    def draw(self, surface: pygame.Surface, layout: Layout, time_s: float) -> None:
        """Draw what is alive, and forget what is over."""
        self._alive = [effect for effect in self._alive if effect.age(time_s) < 1]
        for effect in self._alive:
            effect.draw(surface, layout, effect.age(time_s))
        if self._words and self._words.age(time_s) < 1:
            self._words.draw(surface, layout, self._words.age(time_s))
        else:
            self._words = None

    def _say(self, time_s: float, lines: list[_Line], cell: int) -> None:
        if lines:
            self._words = _Words(time_s, lines, cell)


def praise(event: happened.Locked) -> list[_Line]:
    """Return the lines to say about a lock, the greatest first, each with its colour."""
    clear = event.clear
    lines: list[_Line] = []
    if clear.perfect:
        lines.append(("PERFECT CLEAR", theme.GOOD))
    if clear.name:
        grand = clear.difficult or clear.name.endswith("t-spin")
        lines.append((clear.name.upper(), theme.ACCENT if grand else theme.TEXT))
    if clear.b2b:
        lines.append(("BACK-TO-BACK", theme.WARN))
    if clear.combo > 0:
        lines.append((f"COMBO ×{clear.combo}", theme.ACCENT_COOL))
    if clear.points:
        lines.append((f"+{clear.points:,}", theme.TEXT))
    return lines


class _Effect(ABC):
    def __init__(self, start_s: float, lasts_s: float) -> None:
        self._start_s, self._lasts_s = start_s, lasts_s

    def age(self, time_s: float) -> float:
        """From 0 (new) to 1 (gone)."""
        return max(0.0, (time_s - self._start_s) / self._lasts_s)

    @abstractmethod
    def draw(self, surface: pygame.Surface, layout: Layout, age: float) -> None:
        """Draw it at its age."""


class _Flash(_Effect):
    """The locked piece, white for a moment."""

    def __init__(self, event: happened.Locked, cell: int) -> None:
        super().__init__(event.time_s, _LOCK_S)
        self._cells = event.piece.cells
        self._picture = pygame.Surface((cell, cell), pygame.SRCALPHA)
        pygame.draw.rect(
            self._picture, theme.WHITE, (1, 1, cell - 2, cell - 2), border_radius=cell // 7
        )

    def draw(self, surface: pygame.Surface, layout: Layout, age: float) -> None:
        self._picture.set_alpha(round(140 * (1 - age)))
        surface.blits([(self._picture, layout.at(x, y)) for x, y in self._cells])


class _Trail(_Effect):
    """Light above a piece that was dropped, brightest where it came to rest."""

    def __init__(self, event: happened.Dropped, cell: int) -> None:
        super().__init__(event.time_s, _TRAIL_S)
        colour = theme.mix(theme.PIECES[event.piece.kind], theme.WHITE, 0.35)
        height = event.rows * cell
        strip = pygame.Surface((max(1, cell - 2), height), pygame.SRCALPHA)
        for row in range(height):
            alpha = round(110 * (row / height) ** 2)
            strip.fill((*colour, alpha), (0, row, strip.get_width(), 1))
        self._strip = strip
        tops = dict(sorted(event.piece.cells))  # the highest cell of each column
        self._tops = [(x, y + event.rows) for x, y in tops.items()]

    def draw(self, surface: pygame.Surface, layout: Layout, age: float) -> None:
        self._strip.set_alpha(round(255 * (1 - age)))
        for x, y in self._tops:
            left, top = layout.at(x, y)
            surface.blit(self._strip, (left + 1, top))


class _Rows(_Effect):
    """A band of light where rows were cleared, closing like an eye."""

    def __init__(self, event: happened.Locked) -> None:
        super().__init__(event.time_s, _CLEAR_S)
        self._rows = event.rows
        self._colour = theme.ACCENT if event.clear.difficult else theme.WHITE

    def draw(self, surface: pygame.Surface, layout: Layout, age: float) -> None:
        left = 1 - age
        width, height = COLUMNS * layout.cell, layout.cell
        band = pygame.Surface((width, max(1, round(height * left))))
        band.fill(theme.mix(theme.WHITE, self._colour, min(1, 2 * age)))
        band.set_alpha(round(230 * left))
        for y in self._rows:
            x_px, y_px = layout.at(0, y)
            surface.blit(band, (x_px, y_px + (height - band.get_height()) // 2))


class _Words(_Effect):
    """Words over the board that rise and fade."""

    def __init__(self, time_s: float, lines: list[_Line], cell: int) -> None:
        super().__init__(time_s, _WORDS_S)
        self.lines = lines
        pictures = [
            _shadowed(words, round(cell * _size(row, colour)), colour, 9 * cell)
            for row, (words, colour) in enumerate(lines)
        ]
        width = max(picture.get_width() for picture in pictures)
        height = sum(picture.get_height() for picture in pictures)
        self._picture = pygame.Surface((width, height), pygame.SRCALPHA)
        top = 0
        for picture in pictures:
            self._picture.blit(picture, ((width - picture.get_width()) // 2, top))
            top += picture.get_height()

    def draw(self, surface: pygame.Surface, layout: Layout, age: float) -> None:
        self._picture.set_alpha(round(255 * min(1.0, (1 - age) * 2.2)))
        centre = layout.board.centerx, layout.board.top + round((6.5 - 2 * age) * layout.cell)
        surface.blit(self._picture, self._picture.get_rect(center=centre))


def _size(row: int, colour: Colour) -> float:
    """Return the height of a line in cells: large for a grand first one."""
    if row:
        return 0.85
    return 1.05 if colour == theme.TEXT else 1.35


def _shadowed(words: str, size: int, colour: Colour, widest: int) -> pygame.Surface:
    """Return words with a soft dark edge, so that they read on any blocks."""
    width = theme.text(words, size, colour).get_width()
    size = min(size, int(size * widest / width))
    front, back = theme.text(words, size, colour), theme.text(words, size, theme.BACKGROUND)
    edge = max(1, size // 14)
    picture = pygame.Surface(
        (front.get_width() + 2 * edge, front.get_height() + 2 * edge), pygame.SRCALPHA
    )
    for dx in (0, edge, 2 * edge):
        for dy in (0, edge, 2 * edge):
            picture.blit(back, (dx, dy))
    picture.blit(front, (edge, edge))
    return picture
