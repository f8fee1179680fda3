"""Unchanging parts of the pictures: cards, headings, the empty well, and the program's name."""

from functools import lru_cache
from typing import Final

import pygame

from tetris.window import theme
from tetris.window.layout import Layout
from tetris.window.theme_choice import ThemeChoice

_LETTERS: Final = (
    ("Z", ("###", ".#.", ".#.", ".#.", ".#.")),
    ("L", ("###", "#..", "##.", "#..", "###")),
    ("O", ("###", ".#.", ".#.", ".#.", ".#.")),
    ("S", ("##.", "#.#", "##.", "#.#", "#.#")),
    ("I", ("#", "#", "#", "#", "#")),
    ("T", (".##", "#..", ".#.", "..#", "##.")),
)
_ROWS: Final = 5
_GAP: Final = 1  # cells between letters
_COLUMNS: Final = sum(len(rows[0]) + _GAP for _, rows in _LETTERS) - _GAP


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
    cell = max(2, min(area.width // _COLUMNS, area.height // _ROWS))
    surface.blit(_logo(cell, look), area)


@lru_cache(maxsize=4)
def _logo(cell: int, look: ThemeChoice) -> pygame.Surface:
    picture = pygame.Surface((_COLUMNS * cell, _ROWS * cell), pygame.SRCALPHA)
    left = 0
    for mark, rows in _LETTERS:
        block = look.tiles.mino(mark, cell)
        for y, row in enumerate(rows):
            for x, filled in enumerate(row):
                if filled == "#":
                    picture.blit(block, ((left + x) * cell, y * cell))
        left += len(rows[0]) + _GAP
    return picture
