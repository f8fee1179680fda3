"""Themes: what is to be read can be read, and pieces can be told apart by any eye."""

import itertools
import math

import pygame
import pytest

from tetris.engine.pieces import KINDS
from tetris.kit.theme import PALETTES, Colour, Palette
from tetris.window.tiles import Tiles, colours

THEMES = pytest.mark.parametrize("palette", PALETTES.values(), ids=list(PALETTES))

# Linear RGB as those see it who lack one kind of cone: G. M. Machado, M. M. Oliveira and
# L. A. F. Fernandes, A Physiologically-based Model for Simulation of Color Vision Deficiency,
# IEEE Transactions on Visualization and Computer Graphics, 2009, severity 1.0.
EYES = {
    "protanopia": (
        (0.152286, 1.052583, -0.204868),
        (0.114503, 0.786281, 0.099216),
        (-0.003882, -0.048116, 1.051998),
    ),
    "deuteranopia": (
        (0.367322, 0.860646, -0.227968),
        (0.280085, 0.672501, 0.047413),
        (-0.011820, 0.042940, 0.968881),
    ),
    "tritanopia": (
        (1.255528, -0.076749, -0.178779),
        (-0.078411, 0.930809, 0.147602),
        (0.004733, 0.691367, 0.303900),
    ),
    "all cones": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
}
TOLD_APART = 15.0  # CIE 1976 Lab; 2.3 is just noticed side by side


def linear(colour: Colour) -> tuple[float, ...]:
    shares = [channel / 255 for channel in colour]
    return tuple(s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares)


def luminance(colour: Colour) -> float:
    red, green, blue = linear(colour)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(first: Colour, second: Colour) -> float:
    """Return the contrast of two colours as WCAG 2 counts it, 1 to 21."""
    bright, dark = sorted((luminance(first), luminance(second)), reverse=True)
    return (bright + 0.05) / (dark + 0.05)


def lab(colour: Colour, eye: str) -> tuple[float, float, float]:
    seen = [
        min(1.0, max(0.0, sum(a * b for a, b in zip(row, linear(colour), strict=True))))
        for row in EYES[eye]
    ]
    red, green, blue = seen
    xyz = (
        (0.4124 * red + 0.3576 * green + 0.1805 * blue) / 0.9505,
        0.2126 * red + 0.7152 * green + 0.0722 * blue,
        (0.0193 * red + 0.1192 * green + 0.9505 * blue) / 1.089,
    )
    x, y, z = (t ** (1 / 3) if t > 0.008856 else 7.787 * t + 16 / 116 for t in xyz)
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def apart(first: Colour, second: Colour, eye: str) -> float:
    pairs = zip(lab(first, eye), lab(second, eye), strict=True)
    return math.sqrt(sum((a - b) ** 2 for a, b in pairs))


@THEMES
def test_words_stand_out_from_what_they_stand_on(palette: Palette) -> None:
    for ground in (palette.background, palette.surface, palette.raised):
        assert contrast(palette.text, ground) >= 7
        assert contrast(palette.dim, ground) >= 4.5
        for colour in (palette.accent, palette.cool, palette.good, palette.warn, palette.bad):
            assert contrast(colour, ground) >= 4.5


@THEMES
def test_blocks_stand_out_from_the_empty_board(palette: Palette) -> None:
    for mark in (*KINDS, "#"):
        assert contrast(colours(palette)[mark], palette.well) >= (
            1.6 if palette.name == "light" else 2.5
        )


@pytest.mark.parametrize("eye", EYES)
def test_the_safe_themes_pieces_are_told_apart_by_any_eye(eye: str) -> None:
    safe = colours(PALETTES["safe"])
    distances = {
        f"{a}{b}": round(apart(safe[a], safe[b], eye), 1)
        for a, b in itertools.combinations(KINDS, 2)
    }
    assert min(distances.values()) >= TOLD_APART, distances


@THEMES
def test_patterns_tell_pieces_apart_without_colours(palette: Palette) -> None:
    plain, marked = Tiles(palette), Tiles(palette, patterns=True)
    pictures = set()
    for kind in KINDS:
        before, after = plain.mino(kind, 32), marked.mino(kind, 32)
        changed = pygame.mask.from_threshold(after, (0, 0, 0), (1, 1, 1, 255), before)
        changed.invert()
        pictures.add(tuple(changed.get_at((x, y)) for x in range(32) for y in range(32)))
    assert len(pictures) == len(KINDS)


def test_a_mark_that_is_no_piece_is_drawn_as_garbage() -> None:
    assert Tiles(PALETTES["safe"]).colour("#") == PALETTES["safe"].pieces[-1]


def test_pictures_are_kept_but_not_without_end() -> None:
    tiles = Tiles(PALETTES["safe"])
    assert tiles.mino("T", 20) is tiles.mino("T", 20)
    for size in range(4, 300):
        tiles.ghost("T", size)
    assert tiles.ghost.cache_info().currsize <= 64
