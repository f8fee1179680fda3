"""Zones of the dome: which command a located gesture gives where; columns of Aim; pictures."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
import pygame
from numpy.typing import NDArray

from controller.shared.protocol.teaching import CommandRule, GestureInfo
from host.ui import sprites
from host.ui.pointer_input import DomeArea

Rules = tuple[CommandRule, ...]

NONE: Final = ("", "none")  # commands without an effect
_OUTSIDE: Final = -1  # number of a point that no rule fits
_REACH: Final = 0.94  # of the dome's radius, that zones fill
_ICON: Final = 0.24  # size of an icon, as a share of the dome's radius
_LINE, _LIT, _PLATE = 90, 66, 120  # opacity of the lines, of the lit zone, behind an icon
_WHITE: Final = (255, 255, 255)
_SHADE: Final = (40, 10, 8)


@dataclass(frozen=True, slots=True)
class Columns:
    """Columns of a board over the taxels, and those that the piece in play is in."""

    count: int
    left: int = 0
    width: int = 0


def rules_in_use(gestures: Iterable[GestureInfo]) -> Rules:
    """Return the rules of the first gesture whose command depends on its place; () without one."""
    return next((one.rules for one in gestures if len(one.rules) > 1), ())


def zone_at(rules: Sequence[CommandRule], point: tuple[float, float]) -> int | None:
    """Return the number of the rule for a touch at a point, grid units; None if none fits."""
    return next((number for number, rule in enumerate(rules) if fits(rule, *point)), None)


def fits(rule: CommandRule, x: Any, y: Any) -> Any:
    """Return whether a rule is for a point, or an array of points, grid units."""
    return (rule.right_of <= x) & (x < rule.left_of) & (rule.above <= y) & (y < rule.below)


def _numbers(rules: Rules, x: NDArray[Any], y: NDArray[Any]) -> NDArray[np.int8]:
    """Return the number of the rule at each point, as `zone_at`; _OUTSIDE where none fits."""
    found = np.full(np.broadcast(x, y).shape, _OUTSIDE, np.int8)
    for number in reversed(range(len(rules))):
        found[fits(rules[number], x, y)] = number
    return found


@lru_cache(maxsize=16)
def picture(rules: Rules, pad: DomeArea, radius_px: int, lit: int | None) -> pygame.Surface:
    """Return the zones with their commands' icons, over the square round the dome."""
    numbers = _numbers(rules, *_points(pad, radius_px))
    commands = {number: rule.command for number, rule in enumerate(rules)}
    return _drawn(numbers, () if lit is None else (lit,), commands)


@lru_cache(maxsize=32)
def columns_picture(columns: Columns, pad: DomeArea, radius_px: int) -> pygame.Surface:
    """Return the columns, and the place that holds, over the square round the dome.

    The outer columns reach to its rim, as a touch beside the taxels is for the nearest column.
    """
    x, y = _points(pad, radius_px)
    column = np.clip(x * columns.count / max(1, pad.columns - 1), 0, columns.count - 1)
    numbers = np.where(y > pad.rows - 1, np.int8(_OUTSIDE), column.astype(np.int8))
    lit = range(columns.left, columns.left + columns.width)
    return _drawn(numbers, lit, {_OUTSIDE: "hold"})


def _points(pad: DomeArea, radius_px: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return x, (1, side), and y, (side, 1), of the pixels round the dome, grid units."""
    line = ((np.arange(2 * radius_px) + 0.5) / radius_px - 1) * pad.radius
    return pad.centre[0] + line[None, :], pad.centre[1] - line[:, None]


def _drawn(
    numbers: NDArray[np.int8], lit: Sequence[int], commands: Mapping[int, str]
) -> pygame.Surface:
    """Return the picture of zones, (side, side), some of them lit, with icons by number."""
    radius_px = len(numbers) // 2
    line = (np.arange(len(numbers)) + 0.5) / radius_px - 1
    away = np.hypot(line[None, :], line[:, None])
    inside = np.clip((_REACH - away) * radius_px / 2, 0.0, 1.0)
    rgba = np.full((*numbers.shape, 4), 255, np.uint8)
    edges = _edges(numbers, max(1, radius_px // 90))
    rgba[..., 3] = np.where(edges, _LINE, _LIT * np.isin(numbers, lit)) * inside
    surface = pygame.image.frombuffer(rgba.tobytes(), numbers.shape, "RGBA").copy()
    for number, command in commands.items():
        if command not in NONE and (place := _middle(numbers == number, away)):
            _draw_icon(surface, command, place, radius_px, number in lit)
    return surface


def _edges(numbers: NDArray[np.int8], width: int) -> NDArray[np.bool_]:
    """Return where two zones meet, (side, side), a line of `width` pixels to either side."""
    found = np.zeros(numbers.shape, np.bool_)
    for axis in (0, 1):
        meets = np.diff(numbers, axis=axis) != 0
        for shift in range(-width, width):
            part = np.roll(meets, shift, axis)
            found[: part.shape[0], : part.shape[1]] |= part
    return found


def _middle(inside: NDArray[np.bool_], away: NDArray[Any]) -> tuple[int, int] | None:
    """Return the pixel (x, y) of a zone that is nearest to its centroid; None if it has none."""
    rows, columns = np.nonzero(inside & (away < _REACH))
    if not len(rows):
        return None
    nearest = np.argmin((rows - rows.mean()) ** 2 + (columns - columns.mean()) ** 2)
    return int(columns[nearest]), int(rows[nearest])


def _draw_icon(
    surface: pygame.Surface, command: str, place: tuple[int, int], radius_px: int, lit: bool
) -> None:
    size = max(12, round(radius_px * _ICON))
    plate = sprites.ring(round(size * 0.72), 0, _SHADE, 0, _PLATE)
    surface.blit(plate, plate.get_rect(center=place))
    mark = sprites.icon(command, size, _WHITE).copy()
    mark.set_alpha(255 if lit else 200)
    surface.blit(mark, mark.get_rect(center=place))
