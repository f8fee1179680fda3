"""Drawing of the lab: small multiples of the taxels' traces, and strips of probabilities."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pygame
from numpy.typing import NDArray

from host.app.lab_data import SECONDS, Quality
from tetris.kit import theme
from tetris.kit.language import Words
from tetris.kit.menu_view import wrapped
from tetris.kit.theme import Colour, Palette

Recent = tuple[NDArray[np.float64], NDArray[np.float32], NDArray[np.float32]]

_FULL: Final = 0.1  # least change of z that fills the height of a trace
_GAP: Final = 4  # design units between two traces
_LETTERS: Final = 18
_LINE: Final = 24


@dataclass(frozen=True, slots=True)
class Pen:
    """A surface, its colours, and the pixels of a design unit."""

    surface: pygame.Surface
    palette: Palette
    unit: float

    def px(self, units: float) -> int:
        """Return design units as pixels, 1 at least."""
        return max(1, round(units * self.unit))

    def words(self, words: str, colour: Colour, widest: int) -> pygame.Surface:
        """Return words as a picture."""
        return theme.fitted(words, self.px(_LETTERS), colour, max(1, widest))

    def sentences(self, area: pygame.Rect, lines: Sequence[str]) -> int:
        """Draw sentences at the top of an area; return where they end."""
        top = area.top
        for sentence in lines:
            for line in wrapped(sentence, self.px(_LETTERS), area.width):
                self.surface.blit(
                    theme.text(line, self.px(_LETTERS), self.palette.dim), (area.left, top)
                )
                top += self.px(_LINE)
        return top + self.px(_GAP)

    def trace(
        self,
        area: pygame.Rect,
        ages_s: NDArray[np.float64],
        heights: NDArray[np.floating],
        colour: Colour,
    ) -> None:
        """Draw values against time: the newest at the right.

        `ages_s` are seconds, (n,), oldest first; `heights` (n,) from 0, the bottom, to 1.
        """
        stride = max(1, 2 * len(ages_s) // max(1, area.width))
        x = area.right - 1 - ages_s[::stride] / SECONDS * (area.width - 1)
        y = area.bottom - 1 - np.clip(heights[::stride], 0.0, 1.0) * (area.height - 1)
        if len(x) > 1:
            pygame.draw.lines(self.surface, colour, False, np.column_stack((x, y)).tolist())


def taxels(
    pen: Pen, area: pygame.Rect, recent: Recent, quality: Quality, now_s: float, words: Words
) -> None:
    """Draw a trace for each taxel, in rows and columns as they lie, and a line on their quality."""
    times_s, images, _ = recent
    rows, columns = images.shape[1:]
    last = pygame.Rect(area.left, area.bottom - pen.px(_LINE), area.width, pen.px(_LINE))
    line = pen.words(_quality(quality, words), pen.palette.dim, area.width)
    pen.surface.blit(line, last)
    high, wide = (last.top - area.top) / rows, area.width / columns
    full = max(_FULL, float(np.abs(images).max()) if len(images) else 0.0)
    ages_s = now_s - times_s
    for row, column in np.ndindex(rows, columns):
        left, top = round(area.left + column * wide), round(area.top + row * high)
        cell = pygame.Rect(left, top, round(wide) - pen.px(_GAP), round(high) - pen.px(_GAP))
        heights = images[:, row, column] / (2 * full) + 0.5
        _cell(pen, cell, ages_s, heights, bool(quality.noisy[row, column]), words)


def _cell(
    pen: Pen,
    cell: pygame.Rect,
    ages_s: NDArray[np.float64],
    heights: NDArray[np.floating],
    loud: bool,
    words: Words,
) -> None:
    """Draw the trace of a taxel; a `loud` one is marked as noisy."""
    palette = pen.palette
    colour = palette.warn if loud else palette.cool
    pygame.draw.rect(pen.surface, palette.surface, cell, border_radius=pen.px(4))
    pygame.draw.line(pen.surface, palette.line, cell.midleft, (cell.right - 1, cell.centery))
    pen.trace(cell, ages_s, heights, colour)
    if loud:
        pygame.draw.rect(pen.surface, colour, cell, pen.px(1), border_radius=pen.px(4))
        label = pen.words(words("lab.noisy"), colour, cell.width)
        pen.surface.blit(label, label.get_rect(midbottom=cell.midbottom))


def _quality(quality: Quality, words: Words) -> str:
    """Return the noise of the median taxel and of the worst one."""
    worst = np.unravel_index(int(quality.level.argmax()), quality.level.shape)
    return words(
        "lab.quality",
        usual=f"{100 * quality.usual:.2f}",
        worst=f"{100 * float(quality.level[worst]):.2f}",
        place=f"{int(worst[0])}/{int(worst[1])}",
    )


def probabilities(
    pen: Pen, area: pygame.Rect, recent: Recent, now_s: float, names: Sequence[str]
) -> None:
    """Draw a strip for each class: its probability over time."""
    times_s, _, shares = recent
    high = area.height / max(1, len(names))
    ages_s = now_s - times_s
    for number, name in enumerate(names):
        top = round(area.top + number * high)
        strip = pygame.Rect(area.left, top, area.width, max(2, round(high) - pen.px(_GAP)))
        pygame.draw.rect(pen.surface, pen.palette.surface, strip, border_radius=pen.px(4))
        label = pen.words(name, pen.palette.text, strip.width - pen.px(12))
        pen.surface.blit(label, (strip.left + pen.px(6), strip.top + pen.px(2)))
        pen.trace(strip, ages_s, shares[:, number], pen.palette.accent)
