"""Small pictures that are drawn once and then only copied: icons, cards and rings.

Shapes are drawn four times as large and scaled down, so that their edges are smooth. What is
returned is shared: blit it, never draw on it.
"""

import math
import tomllib
from collections.abc import Callable, Sequence
from functools import lru_cache
from importlib.resources import files
from typing import Final

import pygame

from tetris.kit import theme
from tetris.kit.menu_view import wrapped
from tetris.kit.theme import Colour, Palette

SMOOTH: Final = 4  # times larger while drawing

_LEAST: Final = 18  # size of the smallest text: letters of 12 pixels

Point = tuple[float, float]
Pen = Callable[..., None]


class SpriteScale:
    """Design units to pixels, and what is drawn in them in the colours of a theme."""

    def __init__(self, factor: float, palette: Palette = theme.DARK) -> None:
        self.factor, self.palette = factor, palette

    def px(self, design: float) -> int:
        """Return a length in whole pixels, at least one."""
        return max(1, round(design * self.factor))

    def size(self, design: float) -> int:
        """Return a size of text that can be read."""
        return max(_LEAST, self.px(design))

    def text(self, words: str, size: int, colour: Colour | None, width: int) -> pygame.Surface:
        """Return a line of text, smaller or cut short where it were wider than so many pixels."""
        return theme.fitted(words, self.size(size), colour or self.palette.text, width)

    def lines(self, words: str, size: int, width: int, most: int) -> list[str]:
        """Return words in at most so many lines for a width in pixels."""
        lines = wrapped(words, self.size(size), width)
        return lines if len(lines) <= most else [*lines[: most - 1], " ".join(lines[most - 1 :])]

    def card(self, surface: pygame.Surface, rect: pygame.Rect) -> None:
        """Draw the plate that a group of things lies on."""
        plate = card(rect.size, self.px(12), self.palette.surface, self.palette.line)
        surface.blit(plate, rect)

    def badge(self, words: str, size: int, colour: Colour, width: int) -> pygame.Surface:
        """Return a word in a frame of its colour, at most so many pixels wide."""
        letters = self.text(words, size, colour, width - self.px(16))
        wide, high = letters.get_width() + self.px(16), letters.get_height() + self.px(6)
        plate = card((wide, high), high // 3, self.palette.surface, colour).copy()
        plate.blit(letters, letters.get_rect(center=plate.get_rect().center))
        return plate


def mix(low: Colour, high: Colour, share: float) -> Colour:
    """Mix two colours in 16 steps, so that the pictures kept stay few."""
    return theme.mix(low, high, round(min(1.0, max(0.0, share)) * 16) / 16)


def in_steps(alpha: float) -> int:
    """Return an opacity, 0 to 255, in steps of 16, for the same reason."""
    return min(255, max(0, round(alpha / 16) * 16))


@lru_cache(maxsize=64)
def card(
    size: tuple[int, int], radius: int, fill: Colour, line: Colour | None = None
) -> pygame.Surface:
    """Return a rectangle with round corners and, if wished, a fine outline."""
    surface = _canvas(size)
    box = surface.get_rect()
    pygame.draw.rect(surface, line or fill, box, border_radius=radius * SMOOTH)
    if line:
        inner = box.inflate(-2 * SMOOTH, -2 * SMOOTH)
        pygame.draw.rect(surface, fill, inner, border_radius=(radius - 1) * SMOOTH)
    return pygame.transform.smoothscale(surface, size)


@lru_cache(maxsize=128)
def ring(
    radius: int, width: float, colour: Colour, alpha: int, fill_alpha: int = 0
) -> pygame.Surface:
    """Return a circle with a filling of its own transparency; width 0 leaves only the filling."""
    side = 2 * radius + 4
    surface = _canvas((side, side))
    centre = (side * SMOOTH / 2, side * SMOOTH / 2)
    if fill_alpha:
        pygame.draw.circle(surface, (*colour, fill_alpha), centre, radius * SMOOTH)
    if width:
        pygame.draw.circle(
            surface, (*colour, alpha), centre, radius * SMOOTH, max(1, round(width * SMOOTH))
        )
    return pygame.transform.smoothscale(surface, (side, side))


@lru_cache(maxsize=16)
def taxels(rows: int, columns: int, step_px: float) -> pygame.Surface:
    """Return the marks of all taxels and the traces that join them, centred on the dome's top."""
    margin = 8
    size = round((columns - 1) * step_px) + 2 * margin, round((rows - 1) * step_px) + 2 * margin
    surface = _canvas(size)
    at = [
        [((margin + c * step_px) * SMOOTH, (margin + r * step_px) * SMOOTH) for c in range(columns)]
        for r in range(rows)
    ]
    for row in range(rows):
        pygame.draw.line(surface, (60, 8, 4, 34), at[row][0], at[row][-1], SMOOTH)
    for column in range(columns):
        pygame.draw.line(surface, (60, 8, 4, 34), at[0][column], at[-1][column], SMOOTH)
    for line in at:
        for point in line:
            pygame.draw.circle(surface, (70, 10, 6, 120), point, 3.2 * SMOOTH)
            pygame.draw.circle(surface, (255, 236, 224, 205), point, 1.9 * SMOOTH)
    return pygame.transform.smoothscale(surface, size)


@lru_cache(maxsize=16)
def rim_arrows(radius: int, colour: Colour, alpha: int) -> pygame.Surface:
    """Return four double arrows along a circle: here one can turn."""
    side = 2 * radius + 24
    surface = _canvas((side, side))
    middle = side / 2
    for towards in (0.0, 90.0, 180.0, 270.0):
        _arc_arrow(
            surface, (*colour, alpha), middle, radius, towards - 11, towards + 11, 2.0, both=True
        )
    return pygame.transform.smoothscale(surface, (side, side))


def has_icon(name: str) -> bool:
    """Return whether a gesture or a command has an icon of its own."""
    return name in _ICONS


@lru_cache(maxsize=256)
def icon(name: str, size: int, colour: Colour) -> pygame.Surface:
    """Return the icon of a gesture or a command; an unknown name gets a dot."""
    surface = _canvas((size, size))
    _ICONS.get(name, _dot)(surface, colour, size * SMOOTH)
    return pygame.transform.smoothscale(surface, (size, size))


def _canvas(size: tuple[int, int]) -> pygame.Surface:
    return pygame.Surface((size[0] * SMOOTH, size[1] * SMOOTH), pygame.SRCALPHA, 32)


def _arc_arrow(
    surface: pygame.Surface,
    colour: tuple[int, ...],
    middle: float,
    radius: float,
    start_deg: float,
    end_deg: float,
    width: float,
    *,
    both: bool = False,
    head: float = 3.2,
) -> None:
    """Draw an arc with an arrow at its end; degrees run counter-clockwise from the right."""

    def at(degrees: float, distance: float) -> Point:
        angle = math.radians(degrees)
        return (
            (middle + distance * math.cos(angle)) * SMOOTH,
            (middle - distance * math.sin(angle)) * SMOOTH,
        )

    steps = max(8, int(abs(end_deg - start_deg) / 3))
    half = width / 2
    line = [start_deg + (end_deg - start_deg) * k / steps for k in range(steps + 1)]
    outer = [at(degrees, radius + half) for degrees in line]
    inner = [at(degrees, radius - half) for degrees in reversed(line)]
    pygame.draw.polygon(surface, colour, outer + inner)
    ends = [(end_deg, math.copysign(1, end_deg - start_deg))]
    if both:
        ends.append((start_deg, -ends[0][1]))
    for degrees, sign in ends:
        tip = degrees + sign * math.degrees(head * width / radius * 0.75)
        wings = [at(degrees, radius + head * width / 2), at(degrees, radius - head * width / 2)]
        pygame.draw.polygon(surface, colour, [at(tip, radius), *wings])


def _shape(polygons: Sequence[Sequence[Point]]) -> Pen:
    """Return a pen for polygons whose points are shares of the icon's side."""

    def draw(surface: pygame.Surface, colour: Colour, side: float) -> None:
        for points in polygons:
            pygame.draw.polygon(surface, colour, [(x * side, y * side) for x, y in points])

    return draw


def _turning(clockwise: bool) -> Pen:
    def draw(surface: pygame.Surface, colour: Colour, side: float) -> None:
        unit = side / SMOOTH
        ends = (215.0, 5.0) if clockwise else (-35.0, 175.0)
        _arc_arrow(surface, colour, unit / 2, unit * 0.34, *ends, unit * 0.12, head=4.4)

    return draw


def _dot(surface: pygame.Surface, colour: Colour, side: float) -> None:
    pygame.draw.circle(surface, colour, (side / 2, side / 2), side * 0.12)


def _press(surface: pygame.Surface, colour: Colour, side: float) -> None:
    middle = (side / 2, side / 2)
    pygame.draw.circle(surface, colour, middle, side * 0.40, max(1, round(side * 0.10)))
    pygame.draw.circle(surface, colour, middle, side * 0.17)


def _null(surface: pygame.Surface, colour: Colour, side: float) -> None:
    middle = (side / 2, side / 2)
    pygame.draw.circle(surface, colour, middle, side * 0.36, max(1, round(side * 0.09)))


_SHAPES: Final = tomllib.loads((files("assets") / "host" / "icons.toml").read_text("utf-8"))
_ICONS: Final[dict[str, Pen]] = {
    "null": _null,
    "press": _press,
    "twist_cw": _turning(True),
    "twist_ccw": _turning(False),
    "rotate_cw": _turning(True),
    "rotate_ccw": _turning(False),
    **{name: _shape(polygons) for name, polygons in _SHAPES.items()},
}
