"""Layout of a window of any size: the game, and the panel with header, dome, caption and card."""

from dataclasses import dataclass
from typing import Final

import pygame

from host.ui.dome import PADDING

WIDTH: Final = 350  # design size of a tall panel; any rectangle is filled in proportion
HEIGHT: Final = 600
_WIDE: Final = (620, 380)  # design size of a panel that is wider than high
_TALL: Final = 1.1  # height of a panel, as a share of its width, with the card below the dome
_DOME: Final = 160  # pixels: the dome's least diameter where there is room for it
_SIDE: Final = 0.56  # of a wide panel's width, that the dome takes at most
_LINE: Final = 16  # pixels that a line of the smallest text takes
_COLUMNS: Final = 2  # of rows on a card that is too low for one column
_ROWS: Final = 5  # that the card has room for, so that the dome stays as gestures are taught
_BESIDE: Final = 350 / 600  # width of the panel beside the game, as a share of its height
_WIDEST: Final = 0.36  # of the window's width that it takes
_UPRIGHT: Final = 1.05  # height of a window, as a share of its width, with the panel below the game
_BELOW: Final = 0.42  # of the window's height that it takes there
_GAP: Final = 0.012  # round the panel, as a share of the window's shorter side


@dataclass(frozen=True, slots=True)
class Dock:
    """Rectangles of the game and of the orb's panel, pixels."""

    game: pygame.Rect
    panel: pygame.Rect

    @classmethod
    def of(cls, size: tuple[int, int]) -> "Dock":
        """Return the rectangles in a window of (width, height) pixels."""
        width, height = size
        gap = max(2, round(_GAP * min(size)))
        if height >= _UPRIGHT * width:
            top = round(height * (1 - _BELOW))
            panel = pygame.Rect(gap, top, max(1, width - 2 * gap), max(1, height - top - gap))
            return cls(pygame.Rect(0, 0, width, top), panel)
        wide = round(min(_WIDEST * width, _BESIDE * (height - 2 * gap)))
        panel = pygame.Rect(gap, gap, max(1, wide), max(1, height - 2 * gap))
        left = min(panel.right + gap, width - 1)
        return cls(pygame.Rect(left, 0, max(1, width - left), height), panel)

    def side(self, size: tuple[int, int]) -> pygame.Rect:
        """Return the part of a window of `size` that is not the game's."""
        left, bottom = self.game.left, self.game.bottom
        if left:
            return pygame.Rect(0, 0, left, size[1])
        return pygame.Rect(0, bottom, size[0], size[1] - bottom)


@dataclass(frozen=True, slots=True)
class PanelLayout:
    """Rectangles of the parts of a panel, pixels."""

    factor: float  # pixels to a design unit
    header: pygame.Rect  # name and link of the orb
    dome: pygame.Rect  # square round the dome, with its base and shadow
    radius: int  # of the dome
    caption: pygame.Rect  # two lines of text
    card: pygame.Rect  # the gestures
    rows: tuple[pygame.Rect, ...]  # of the gestures that have room on the card

    @classmethod
    def of(cls, rect: pygame.Rect, gestures: int, scale: float = 1.0) -> "PanelLayout":
        """Lay out a panel for so many gestures; `scale` enlarges text, 1.0 is the usual size."""
        tall = rect.height >= _TALL * rect.width
        width, height = (WIDTH, HEIGHT) if tall else _WIDE
        factor = min(rect.width / width, rect.height / height) * scale
        sizes = _Sizes.of(factor)
        return (_tall if tall else _wide)(rect, max(1, gestures), sizes)


@dataclass(frozen=True, slots=True)
class _Sizes:
    """Heights in pixels that follow from the size of the text."""

    factor: float
    header: int
    caption: int
    row: int
    pad: int  # inside the card

    @classmethod
    def of(cls, factor: float) -> "_Sizes":
        line = max(_LINE, round(_LINE * factor))
        row = max(line + 4, round(34 * factor))
        return cls(factor, line + round(16 * factor), 2 * line + 2, row, max(4, round(8 * factor)))

    def card(self, rows: int) -> int:
        """Return the height of a card with so many rows."""
        return rows * self.row + 2 * self.pad

    @property
    def low(self) -> "_Sizes":
        """The same text with as little space around it as possible."""
        line = (self.caption - 2) // 2
        return _Sizes(self.factor, line + 4, self.caption, line + 4, 4)


def _tall(rect: pygame.Rect, gestures: int, sizes: _Sizes) -> PanelLayout:
    """Stack the parts; the dome takes what the others leave, and they yield to a small one."""
    least = min(rect.width, round(_DOME * (1 + PADDING)) + 2)
    for columns, used in ((1, sizes), (1, sizes.low), (_COLUMNS, sizes.low)):
        lines = -(-_ROWS // columns)
        room = rect.height - used.header - used.caption - used.card(lines)
        if room >= max(least, round(0.7 * rect.width) if used is sizes else 0):
            break
    else:
        lines = max(1, min(lines, lines + (room - least) // used.row))
        room = rect.height - used.header - used.caption - used.card(lines)
    side = max(24, min(rect.width, room))
    total = used.header + side + used.caption + used.card(lines)
    top = rect.top + max(0, (rect.height - total) // 2)
    header = pygame.Rect(rect.left, top, rect.width, used.header)
    dome = pygame.Rect(rect.left + (rect.width - side) // 2, header.bottom, side, side)
    caption = pygame.Rect(rect.left, dome.bottom, rect.width, used.caption)
    card = pygame.Rect(rect.left, caption.bottom, rect.width, used.card(lines))
    return _laid(used, header, dome, caption, card, columns, gestures)


def _wide(rect: pygame.Rect, gestures: int, sizes: _Sizes) -> PanelLayout:
    """Place the dome with its caption at the left, the header and the card at the right."""
    for columns, used in ((1, sizes), (1, sizes.low), (_COLUMNS, sizes.low)):
        lines = -(-_ROWS // columns)
        if rect.height - used.header >= used.card(lines):
            break
    else:
        lines = max(1, (rect.height - used.header - 2 * used.pad) // used.row)
    side = max(24, min(rect.height - used.caption, round(_SIDE * rect.width)))
    top = rect.top + max(0, (rect.height - side - used.caption) // 2)
    dome = pygame.Rect(rect.left, top, side, side)
    caption = pygame.Rect(rect.left, dome.bottom, side, used.caption)
    left = dome.right + used.pad
    high = used.header + used.card(lines)
    top = rect.top + max(0, (rect.height - high) // 2)
    header = pygame.Rect(left, top, rect.right - left, used.header)
    card = pygame.Rect(left, header.bottom, rect.right - left, used.card(lines))
    return _laid(used, header, dome, caption, card, columns, gestures)


def _laid(
    sizes: _Sizes,
    header: pygame.Rect,
    dome: pygame.Rect,
    caption: pygame.Rect,
    card: pygame.Rect,
    least: int,
    gestures: int,
) -> PanelLayout:
    for used, columns in ((sizes, least), (sizes.low, 1), (sizes.low, _COLUMNS)):
        inner = card.inflate(-2 * used.pad, -2 * used.pad)
        lines = max(1, inner.height // used.row)
        if gestures <= lines * columns:
            break
    wide = (inner.width - (columns - 1) * used.pad) // columns
    rows = []
    for number in range(min(gestures, lines * columns)):
        column, line = divmod(number, lines)
        left = inner.left + column * (wide + used.pad)
        rows.append(pygame.Rect(left, inner.top + line * used.row, wide, used.row))
    radius = max(8, int(dome.width / (2 * (1 + PADDING))))
    return PanelLayout(sizes.factor, header, dome, radius, caption, card, tuple(rows))
