"""Sparks that fly from cleared rows: many small squares, cheap to draw."""

from collections.abc import Iterable
from math import cos, pi, sin
from typing import Final

import pygame

from tetris.window.layout import Layout
from tetris.window.theme import Colour

_A_CELL: Final = 3  # sparks
_SPEED: Final = 4.2  # cells in a lifetime
_FALL: Final = 3.4  # cells in a lifetime, squared


class Sparks:
    """One burst. Where sparks fly follows from their cells, so a replay shows the same."""

    def __init__(self, cells: Iterable[tuple[int, int, Colour]], size: int) -> None:
        """Begin at cells (x, y), each in its colour, for blocks of `size` pixels."""
        side = max(2, round(size * 0.16))
        self._pictures: dict[Colour, pygame.Surface] = {}
        self._sparks: list[tuple[pygame.Surface, float, float, float, float]] = []
        for x, y, colour in cells:
            picture = self._pictures.get(colour)
            if picture is None:
                picture = self._pictures[colour] = pygame.Surface((side, side))
                picture.fill(colour)
            for number in range(_A_CELL):
                turn = _scattered(x, y, number) * 2 * pi
                speed = _SPEED * (0.35 + 0.65 * _scattered(y, number, x))
                self._sparks.append(
                    (picture, x + 0.4, y - 0.4, cos(turn) * speed, sin(turn) * speed)
                )

    def draw(self, surface: pygame.Surface, layout: Layout, age: float) -> None:
        """Draw the burst at its age, 0 (new) to 1 (gone), inside the board."""
        for picture in self._pictures.values():
            picture.set_alpha(round(255 * (1 - age) ** 1.2))
        gone, sunk, at = age * (2 - age), _FALL * age * age, layout.at
        clip = surface.get_clip()
        surface.set_clip(layout.board)
        surface.fblits(
            [
                (picture, at(x + dx * gone, y + dy * gone - sunk))
                for picture, x, y, dx, dy in self._sparks
            ]
        )
        surface.set_clip(clip)


def _scattered(*numbers: int) -> float:
    """Return a number from 0 to 1 that looks random and is the same every time."""
    mixed = 0x9E3779B9
    for number in numbers:
        mixed = (mixed ^ (number + 0x7F4A7C15)) * 0x85EBCA6B & 0xFFFFFFFF
        mixed ^= mixed >> 13
    return mixed / 0xFFFFFFFF
