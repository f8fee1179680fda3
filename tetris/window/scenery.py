"""Layout of a game in multiples of one cell; and what never changes: cards, headings, the well."""

from dataclasses import dataclass
from typing import Final

import pygame

from tetris.window import theme
from tetris.window.tiles import ThemeChoice

_LOGO: Final = (
    "ZZZ LLL OOO SS. I .TT",
    ".Z. L.. .O. S.S I T..",
    ".Z. LL. .O. SS. I .T.",
    ".Z. L.. .O. S.S I ..T",
    ".Z. LLL .O. S.S I TT.",
)
_LEAST_COLUMNS: Final = 10  # a board with fewer stands in the middle of so many
_LEAST_ROWS: Final = 20
_SIDE: Final = 4.8  # width of the column on either side, in cells
_GAP: Final = 0.6  # between the board and a side column
_HEAD: Final = 1.3  # above the board, for a piece that is just entering
_FOOT: Final = 0.6
_WIDTH: Final = 2 * (_SIDE + _GAP) + 0.5  # all but the board
_HOLD: Final = 4.4  # heights
_NEXT: Final = 15.7
_LEAST_CELL: Final = 6  # pixels; below, nothing could be told apart


@dataclass(frozen=True, slots=True)
class Layout:
    """Where everything is, in pixels of the window."""

    area: pygame.Rect
    cell: int  # the side of one block
    columns: int
    rows: int  # the visible ones
    board: pygame.Rect
    hold: pygame.Rect  # cards, like the next two
    stats: pygame.Rect
    next: pygame.Rect
    callout: pygame.Rect  # where a clear is named, beside the board so that it hides nothing

    @classmethod
    def inside(
        cls, area: pygame.Rect, columns: int = _LEAST_COLUMNS, rows: int = _LEAST_ROWS
    ) -> "Layout":
        """Fit the largest whole cell size into an area and centre everything in it."""
        wide, high = max(columns, _LEAST_COLUMNS), max(rows, _LEAST_ROWS)
        height = high + _HEAD + _FOOT
        cell = max(_LEAST_CELL, int(min(area.width / (wide + _WIDTH), area.height / height)))
        place = pygame.Rect(0, 0, wide * cell, high * cell)
        place.centerx = area.centerx
        place.top = area.top + round((area.height - height * cell) / 2 + _HEAD * cell)
        board = pygame.Rect(0, 0, columns * cell, rows * cell)
        board.midbottom = place.midbottom
        side, gap = round(_SIDE * cell), round(_GAP * cell)
        left, right = place.left - gap - side, place.right + gap
        hold = pygame.Rect(left, place.top, side, round(_HOLD * cell))
        stats = pygame.Rect(left, hold.bottom + gap, side, place.bottom - hold.bottom - gap)
        following = pygame.Rect(right, place.top, side, round(_NEXT * cell))
        below = following.bottom + gap
        callout = pygame.Rect(right, below, side, place.bottom - below)
        return cls(area.copy(), cell, columns, rows, board, hold, stats, following, callout)

    def at(self, x: float, y: float) -> tuple[int, int]:
        """Return the upper left pixel of a cell of the board."""
        return (
            round(self.board.left + x * self.cell),
            round(self.board.bottom - (y + 1) * self.cell),
        )


def draw_scenery(layout: Layout, look: ThemeChoice) -> pygame.Surface:
    """Return a picture of the layout's area."""
    palette, cell = look.palette, layout.cell
    scenery = pygame.Surface(layout.area.size)
    scenery.fill(palette.background)
    here = -layout.area.left, -layout.area.top
    _draw_well(scenery, layout.board.move(here), layout, look)
    for card in (layout.hold, layout.next, layout.stats):
        draw_card(scenery, card.move(here), cell // 3, look)
    for card, key in ((layout.hold, "view.hold"), (layout.next, "view.next")):
        place = card.move(here)
        size, widest = round(cell * 0.6), card.width - round(1.2 * cell)
        words = theme.fitted(look.words(key), size, palette.dim, widest)
        scenery.blit(words, (place.left + round(0.6 * cell), place.top + round(0.5 * cell)))
    nearest = layout.next.inflate(-round(0.7 * cell), 0)
    nearest.height = round(2.5 * cell)
    nearest.center = layout.next.centerx, slot(layout, 0)
    pygame.draw.rect(scenery, palette.raised, nearest.move(here), border_radius=cell // 3)
    if pygame.display.get_init() and pygame.display.get_surface():
        return scenery.convert()
    return scenery


def slot(layout: Layout, place: int) -> int:
    """Return the y of the middle of a next piece, 0 the nearest."""
    return layout.next.top + round((2.65 + 2.75 * place) * layout.cell)


def draw_card(surface: pygame.Surface, card: pygame.Rect, radius: int, look: ThemeChoice) -> None:
    """Draw a card's face and edge."""
    pygame.draw.rect(surface, look.palette.surface, card, border_radius=radius)
    pygame.draw.rect(surface, look.palette.line, card, 1, border_radius=radius)


def _draw_well(
    scenery: pygame.Surface, well: pygame.Rect, layout: Layout, look: ThemeChoice
) -> None:
    palette, cell = look.palette, layout.cell
    frame = max(2, cell // 12)
    outer = well.inflate(2 * frame, 2 * frame)
    pygame.draw.rect(scenery, palette.line, outer, border_radius=cell // 5)
    scenery.fill(palette.well, well)
    if not look.grid:
        return
    for x in range(1, layout.columns):
        scenery.fill(palette.grid, (well.left + x * cell, well.top, 1, well.height))
    for y in range(1, layout.rows):
        scenery.fill(palette.grid, (well.left, well.top + y * cell, well.width, 1))


def draw_logo(surface: pygame.Surface, area: pygame.Rect, look: ThemeChoice) -> None:
    """Draw the name as large as fits, at the upper left of an area."""
    cell = max(2, min(area.width // len(_LOGO[0]), area.height // len(_LOGO)))
    for y, row in enumerate(_LOGO):
        for x, mark in enumerate(row):
            if mark.isalpha():
                surface.blit(look.tiles.mino(mark, cell), (area.x + x * cell, area.y + y * cell))
