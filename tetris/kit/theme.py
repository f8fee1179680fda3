"""Colours, themes and fonts that every part of the window shares; themes come from a file."""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from io import BytesIO
from types import MappingProxyType
from typing import Any, Final

import pygame

Colour = tuple[int, int, int]

BLACK: Final[Colour] = (0, 0, 0)
WHITE: Final[Colour] = (255, 255, 255)
_EM: Final = 0.7  # of a size: what its letters measure, from ascender to descender
LEAST_PX: Final = 12  # of a font: smaller letters cannot be read


@lru_cache(maxsize=32)
def font(size: int) -> pygame.font.Font:
    """Return the interface font, at `LEAST_PX` or more; it comes with the program."""
    if not pygame.font.get_init():
        pygame.font.init()
    pygame.register_quit(font.cache_clear)  # pygame.quit() leaves fonts that no longer work
    return pygame.font.Font(BytesIO(font_file()), max(LEAST_PX, round(size * _EM)))


@cache
def font_file() -> bytes:
    """Return the file of the interface font."""
    return (files("assets") / "tetris" / "fonts" / "Inter-SemiBold.otf").read_bytes()


@lru_cache(maxsize=256)
def text(words: str, size: int, colour: Colour) -> pygame.Surface:
    """Return words as a picture; the same picture for the same words, so do not change it."""
    return font(size).render(words, True, colour)


def mix(first: Colour, second: Colour, share: float) -> Colour:
    """Return a colour between two; share 0 is the first, 1 the second."""
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(first, second, strict=True))
    return red, green, blue


def shade(colour: Colour, share: float) -> Colour:
    """Return a colour lightened (share above 0, up to 1) or darkened (below 0, down to -1)."""
    return mix(colour, WHITE if share > 0 else BLACK, abs(share))


@lru_cache(maxsize=256)
def fitted(words: str, size: int, colour: Colour, widest: int) -> pygame.Surface:
    """Return words as a picture, smaller where they would be too wide, and then cut short."""
    least = round(LEAST_PX / _EM)
    while (wide := font(size).size(words)[0]) > widest and size > least:
        size = max(least, min(size - 1, int(size * widest / wide)))
    while len(words) > 1 and font(size).size(words)[0] > widest:
        words = words[:-2].rstrip() + "…"
    return text(words, size, colour)


# -- themes ------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Palette:
    """The colours of a theme, by the name that settings and language files call it."""

    name: str
    background: Colour
    surface: Colour  # cards
    raised: Colour  # what is chosen or nearest on a card
    line: Colour  # edges of cards and of the well
    text: Colour
    dim: Colour  # what is read second
    accent: Colour  # what matters most; grand clears
    cool: Colour  # combos
    good: Colour  # a new level, a perfect clear, a best result
    warn: Colour  # back-to-back, and why a game pauses
    bad: Colour  # danger
    well: Colour  # the empty board
    grid: Colour  # the lines between its cells
    flash: Colour  # what a locking piece and a clear light up in
    pieces: tuple[Colour, ...]  # of the application's blocks, in its order
    edge: Colour | None = None  # around each block
    bevel: float = 1.0  # how far the blocks' edges are lit and shaded, from 0 (flat)
    ghost_alpha: int = 170  # how opaque the ghost's outline is, 0 to 255

    @property
    def track(self) -> Colour:
        """The empty part of a bar."""
        return mix(self.line, self.surface, 0.55 if self.edge else 0.1)


def _load() -> Iterator[Palette]:
    """Yield the themes of the colour file."""
    file = files("assets") / "tetris" / "palettes.toml"
    for name, table in tomllib.loads(file.read_text("utf-8")).items():
        pieces = tuple(map(tuple, table.pop("pieces")))
        values: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in table.items()
        }
        yield Palette(name=name, pieces=pieces, **values)


PALETTES: Final = MappingProxyType({palette.name: palette for palette in _load()})
"""By name, in the order of the menu."""

DARK: Final = PALETTES["dark"]


def draw_bar(surface: pygame.Surface, palette: Palette, place: pygame.Rect, share: float) -> None:
    """Draw a bar, filled from the left by a share from 0 to 1."""
    radius = place.height // 2
    pygame.draw.rect(surface, palette.track, place, border_radius=radius)
    if share > 0:
        filled = place.copy()
        filled.width = max(place.height, round(place.width * min(1.0, share)))
        pygame.draw.rect(surface, palette.accent, filled, border_radius=radius)
