"""Layout of a game in multiples of one cell; and what never changes: cards, headings, the well."""

from dataclasses import dataclass
from typing import Final

import pygame

from tetris.kit import theme
from tetris.kit.settings import Look

_LEAST_COLUMNS: Final = 10  # a board with fewer stands in the middle of so many
_LEAST_ROWS: Final = 20
_SIDE: Final = 4.8  # width of the column on either side, in cells
_WIDER_SIDE: Final = 130  # pixels, where a small window has room for them
_GAP: Final = 0.6  # between the board and a side column
_HEAD: Final = 1.3  # above the board, for a piece that is just entering
_FOOT: Final = 0.6
_HOLD: Final = 4.4  # height
_FIRST_SLOT: Final = 2.65  # the middle of the next piece on its card
_SLOT: Final = 2.75  # from one next piece to the one after it
_LEAST_CELL: Final = 6  # pixels; below, nothing could be told apart
_LEAST_LETTER: Final = 16  # pixels
_PREVIEWS: Final = 5
_FIGURES: Final = 5
_FIGURE: Final = 2.55  # height of a number with its label, in letters
_STRIP: Final = 16  # width of the cards above and below a board in a tall area, in cells
PAD: Final = 0.35  # between the edge of a card and its words, in cells
_STRIP_SLOT: Final = 3.5  # from one next piece to the one beside it


@dataclass(frozen=True, slots=True)
class Layout:
    """Where everything is, in pixels of the window."""

    area: pygame.Rect
    cell: int  # the side of one block
    letter: float  # the unit of sizes of text
    columns: int
    rows: int  # the visible ones
    board: pygame.Rect
    hold: pygame.Rect  # cards, like the next two
    stats: pygame.Rect
    next: pygame.Rect
    slots: tuple[tuple[int, int], ...]  # the middles of next pieces, the nearest first
    figures: tuple[pygame.Rect, ...]  # where numbers stand
    tall: bool  # whether the cards are above and below the board

    @classmethod
    def inside(
        cls,
        area: pygame.Rect,
        columns: int = _LEAST_COLUMNS,
        rows: int = _LEAST_ROWS,
        scale: float = 1.0,
    ) -> "Layout":
        """Fit the largest whole cell size into an area and centre everything in it.

        The cards are beside the board, or above and below it where the cells are larger so.
        `scale` is the size of letters, 1.0 the one that suits the cells.
        """
        beside = _beside(area, columns, rows, scale)
        stacked = _stacked(area, columns, rows, scale)
        return stacked if stacked.cell > beside.cell else beside

    @property
    def outer(self) -> pygame.Rect:
        """The smallest rectangle around the board and its cards."""
        return self.board.unionall((self.hold, self.stats, self.next))

    def at(self, x: float, y: float) -> tuple[int, int]:
        """Return the upper left pixel of a cell of the board."""
        return (
            round(self.board.left + x * self.cell),
            round(self.board.bottom - (y + 1) * self.cell),
        )


def _beside(area: pygame.Rect, columns: int, rows: int, scale: float) -> Layout:
    """Lay out a board between two columns of cards."""
    wide, high = max(columns, _LEAST_COLUMNS), max(rows, _LEAST_ROWS)
    height, least_side = high + _HEAD + _FOOT, _SIDE * max(1.0, scale)
    fits = min(area.width / (wide + 2 * (least_side + _GAP) + 0.5), area.height / height)
    cell = max(_LEAST_CELL, int(fits))
    letter, gap = max(_LEAST_LETTER, cell * scale), round(_GAP * cell)
    place = pygame.Rect(0, 0, wide * cell, high * cell)
    place.centerx = area.centerx
    place.top = area.top + round((area.height - height * cell) / 2 + _HEAD * cell)
    room = (area.width - place.width) // 2 - 2 * gap
    side = max(round(least_side * cell), min(room, round(_WIDER_SIDE * scale)))
    board = pygame.Rect(0, 0, columns * cell, rows * cell)
    board.midbottom = place.midbottom
    left, right = place.left - gap - side, place.right + gap
    hold = pygame.Rect(left, place.top, side, round(_HOLD * cell))
    stats = pygame.Rect(left, hold.bottom + gap, side, place.bottom - hold.bottom - gap)
    above = _FIRST_SLOT - _SLOT / 2
    high_px = round((above + _SLOT * _PREVIEWS + 0.7) * cell)
    following = pygame.Rect(right, place.top, side, high_px)
    slots = tuple(
        (following.centerx, following.top + round((_FIRST_SLOT + _SLOT * number) * cell))
        for number in range(_PREVIEWS)
    )
    figures = _figure_column(stats.inflate(-2 * round(PAD * cell), 0), letter)
    cards = hold, stats, following
    return Layout(area.copy(), cell, letter, columns, rows, board, *cards, slots, figures, False)


def _figure_column(card: pygame.Rect, letter: float) -> tuple[pygame.Rect, ...]:
    """Return places for numbers below each other, as many as have room on a card."""
    high = _FIGURE * letter
    count = max(0, min(_FIGURES, int((card.height + 1) / high)))
    tops = [round(card.top + number * high) for number in range(count)]
    return tuple(pygame.Rect(card.left, top, card.width, round(high)) for top in tops)


def _stacked(area: pygame.Rect, columns: int, rows: int, scale: float) -> Layout:
    """Lay out a board between a strip of pieces above it and one of figures below it."""
    wide, high = max(columns, _LEAST_COLUMNS), max(rows, _LEAST_ROWS)
    strip = 1.2 * scale + 2.3
    height = strip + _HEAD + high + 0.2 + 2.9 * scale + 2 * _FOOT
    cell = max(_LEAST_CELL, int(min(area.width / (wide + 2 * _GAP), area.height / height)))
    letter, gap = max(_LEAST_LETTER, cell * scale), round(_GAP * cell)
    width = min(area.width - 2 * gap, _STRIP * cell)
    left, top = area.centerx - width // 2, area.top + round((area.height - height * cell) / 2) + gap
    hold = pygame.Rect(left, top, round(4.6 * cell), round(strip * cell))
    right = hold.right + gap // 2
    following = pygame.Rect(right, top, left + width - right, hold.height)
    board = pygame.Rect(0, 0, columns * cell, rows * cell)
    board.midbottom = area.centerx, hold.bottom + round((_HEAD + high) * cell)
    stats = pygame.Rect(left, board.bottom + round(0.2 * cell), width, round(2.9 * letter))
    count = max(1, min(_PREVIEWS, int((following.width - 0.3 * cell) / (_STRIP_SLOT * cell))))
    step = following.width / count
    middle = top + round((1.2 * scale + 1.1) * cell)
    slots = tuple((round(following.left + (each + 0.5) * step), middle) for each in range(count))
    number = max(1, min(_FIGURES, int(width / (3.4 * letter))))
    pad, one = round(0.5 * cell), width // number
    figures = tuple(
        pygame.Rect(left + pad + one * place, stats.top, one - pad, round(2.5 * letter))
        for place in range(number)
    )
    cards = hold, stats, following
    return Layout(area.copy(), cell, letter, columns, rows, board, *cards, slots, figures, True)


def draw_scenery(layout: Layout, look: Look) -> pygame.Surface:
    """Return a picture of the layout's area."""
    palette, cell = look.palette, layout.cell
    scenery = pygame.Surface(layout.area.size)
    scenery.fill(palette.background)
    here = -layout.area.left, -layout.area.top
    _draw_well(scenery, layout.board.move(here), layout, look)
    for card in (layout.hold, layout.next, layout.stats):
        if card.width:
            draw_card(scenery, card.move(here), cell // 3, look)
    pad, letter = round(PAD * cell), layout.letter
    for card, key in ((layout.hold, "view.hold"), (layout.next, "view.next")):
        place = card.move(here)
        words = theme.fitted(
            look.words(key), round(letter * 0.6), palette.dim, max(1, card.width - 2 * pad)
        )
        scenery.blit(words, (place.left + pad, place.top + round(0.4 * cell)))
    nearest = pygame.Rect(0, 0, round(4.1 * cell), round((1.9 if layout.tall else 2.5) * cell))
    room = 2 * (layout.slots[0][0] - layout.next.left) - round(0.4 * cell)
    nearest.width = min(nearest.width, room)
    nearest.center = layout.slots[0]
    pygame.draw.rect(scenery, palette.raised, nearest.move(here), border_radius=cell // 3)
    if pygame.display.get_init() and pygame.display.get_surface():
        return scenery.convert()
    return scenery


def draw_card(surface: pygame.Surface, card: pygame.Rect, radius: int, look: Look) -> None:
    """Draw a card's face and edge."""
    pygame.draw.rect(surface, look.palette.surface, card, border_radius=radius)
    pygame.draw.rect(surface, look.palette.line, card, 1, border_radius=radius)


def _draw_well(scenery: pygame.Surface, well: pygame.Rect, layout: Layout, look: Look) -> None:
    palette, cell = look.palette, layout.cell
    frame = max(2, cell // 12)
    outer = well.inflate(2 * frame, 2 * frame)
    pygame.draw.rect(scenery, palette.line, outer, border_radius=cell // 5)
    scenery.fill(palette.well, well)
    if not look.settings.grid:
        return
    for x in range(1, layout.columns):
        scenery.fill(palette.grid, (well.left + x * cell, well.top, 1, well.height))
    for y in range(1, layout.rows):
        scenery.fill(palette.grid, (well.left, well.top + y * cell, well.width, 1))
