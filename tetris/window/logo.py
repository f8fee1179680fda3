"""The program's name, built of blocks."""

from functools import lru_cache
from typing import Final

import pygame

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
