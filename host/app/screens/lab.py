"""The lab: traces of all taxels, their quality, probabilities, latency, recording, faults."""

from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np
import pygame
from numpy.typing import NDArray

from controller.shared.protocol.messages import Report, StageTime
from controller.shared.protocol.teaching import InjectFault, Record, RecordingStatus
from controller.shared.taxel_measures import noisy
from host.app.lab_data import IMAGE_STEP, NOISE_RATIO, SECONDS, Array, LabData
from host.app.screen import Line, Orb, OrbScreen
from host.ui import naming
from host.ui.sprites import SpriteScale
from tetris.kit.language import Words
from tetris.kit.menu import Item, Menu
from tetris.kit.stage import Stage
from tetris.kit.theme import Colour

# Faults that the virtual orb knows, and the place of each: docs/simulator.md.
FAULTS: Final = {
    **dict.fromkeys(("dead", "leaky"), "taxel"),
    **dict.fromkeys(("open_row", "short_row"), "row"),
    **dict.fromkeys(("open_column", "short_column"), "column"),
    **dict.fromkeys(("air_leak", "temperature", "saturation", "mains", "jitter"), ""),
}
_KINDS: Final = ("", *FAULTS)
# Ages in s, newest last, images of z - 1 and probabilities.
Recent = tuple[NDArray[np.float64], NDArray[np.float32], NDArray[np.float32]]

_FULL: Final = 0.1  # least change of z that fills the height of a trace
_GAP: Final = 4  # design units between two traces
_LETTERS: Final = 18
_LINE: Final = 24


class LabScreen(OrbScreen):
    """Shows what the orb measures, and asks a virtual one for faults."""

    def __init__(self, stage: Stage, orb: Orb, data: LabData) -> None:
        self.data = data
        self._kind = 0  # place in `_KINDS`
        self._taxel = 0  # row by row
        self._recording = RecordingStatus(False, "")
        super().__init__(stage, orb)
        self.selected = len(self.menu.items) - 1

    def page(self) -> Menu:
        """Return the menu below the traces."""
        words, on = self.words, self._recording.on
        record = partial(self.orb.send, Record(not on))
        hint = naming.said(words, self._recording.text) or words("lab.record_hint")
        items = [self.item("lab.stop" if on else "lab.record", record, hint=hint)]
        if self.orb.virtual:
            items += self._faults(words)
        return Menu("", [*items, self.back_item(hint=words("lab.back_hint"))])

    def _faults(self, words: Words) -> list[Item]:
        kind, hint = _KINDS[self._kind], words("lab.fault_hint")
        value = words(f"fault.{kind or 'none'}")
        items = [self.item("lab.fault", value=value, step=self._turn, hint="")]
        if place := FAULTS.get(kind):
            row, column = divmod(self._taxel, self.data.shape[1])
            value = {"taxel": f"{row}/{column}", "row": f"{row}", "column": f"{column}"}[place]
            items.append(self.item(f"lab.{place}", value=value, step=self._move, hint=hint))
        return items

    def _turn(self, step: int) -> None:
        self._kind = (self._kind + step) % len(_KINDS)
        self._inject()

    def _move(self, step: int) -> None:
        rows, columns = self.data.shape
        stride = columns if FAULTS[_KINDS[self._kind]] == "row" else 1
        self._taxel = (self._taxel + step * stride) % (rows * columns)
        self._inject()

    def _inject(self) -> None:
        row, column = divmod(self._taxel, self.data.shape[1])
        rows, columns = self.data.shape
        kind = _KINDS[self._kind]
        if kind.startswith("short"):  # reaches the next electrode, so the last one cannot begin it
            row, column = min(row, rows - 2), min(column, columns - 2)
        self.orb.send(InjectFault(kind, row, column))

    def recognised(self, command: object, time_s: float) -> bool:
        """Let gestures be looked at only: they do not steer this menu."""
        return True

    def report(self, message: Report, time_s: float) -> None:
        """Take how the recording goes."""
        if isinstance(message, RecordingStatus):
            self._recording = message

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the traces, a column of figures beside or below, and the menu."""
        stage, unit = self._stage, self._stage.unit
        area = stage.area.inflate(-round(24 * unit), -round(16 * unit))
        surface.fill(stage.look.palette.background)
        below = area.copy()
        needed = self._view.height(self.menu, unit) + len(self.menu.items)  # rounded up
        below.height = min(area.height // 2, needed)
        below.bottom = area.bottom
        self._view.draw(surface, below, self.menu, self.selected, unit)
        area.height -= below.height + round(8 * unit)
        pen = SpriteScale(unit, stage.look.palette)
        lines = [Line(text, _LETTERS, pen.palette.dim, after=4) for text in self._sentences()]
        top = self.draw_lines(surface, area, lines, unit)
        area.height, area.top = area.bottom - top, top
        grid = area.copy()
        grid.width = round(area.width * 0.66)
        shares = pygame.Rect(grid.right, area.top, area.width - grid.width, area.height)
        times_s, images, probabilities = self.data.recent(time_s)
        recent = time_s - times_s, images, probabilities
        self._draw_taxels(surface, pen, grid, recent)
        self._draw_shares(surface, pen, shares.inflate(-round(16 * unit), 0), recent)

    def _sentences(self) -> list[str]:
        words, state = self.words, self.orb.state
        if state.link != "live":
            return [words("lab.no_orb")]
        lines = [latency(words, state.hops)] if state.hops else []
        wanted = f"{1000 / state.period_ms if state.period_ms else state.rate_hz:.0f}"
        rate = words.number(state.rate_hz, ".1f")
        return [*lines, words("lab.rate", rate=rate, wanted=wanted, missed=state.missed)]

    def _draw_taxels(
        self, surface: pygame.Surface, pen: SpriteScale, area: pygame.Rect, recent: Recent
    ) -> None:
        """Draw a trace for each taxel as they lie, and a line on their noise."""
        ages_s, images, _ = recent
        words, noise = self.words, self.data.taxel_noise()
        rows, columns = images.shape[1:]
        palette, loud = pen.palette, noisy(noise, NOISE_RATIO, IMAGE_STEP / 2)
        last = pygame.Rect(area.left, area.bottom - pen.px(_LINE), area.width, pen.px(_LINE))
        surface.blit(pen.text(_quality(noise, words), _LETTERS, palette.dim, area.width), last)
        high, wide = (last.top - area.top) / rows, area.width / columns
        full = max(_FULL, float(np.abs(images).max()) if len(images) else 0.0)
        for row, column in np.ndindex(rows, columns):
            left, top = round(area.left + column * wide), round(area.top + row * high)
            cell = pygame.Rect(left, top, round(wide) - pen.px(_GAP), round(high) - pen.px(_GAP))
            colour = palette.warn if loud[row, column] else palette.cool
            pygame.draw.rect(surface, palette.surface, cell, border_radius=pen.px(4))
            pygame.draw.line(surface, palette.line, cell.midleft, (cell.right - 1, cell.centery))
            heights = images[:, row, column] / (2 * full) + 0.5
            trace(surface, cell, ages_s, heights, colour)
            if loud[row, column]:
                pygame.draw.rect(surface, colour, cell, pen.px(1), border_radius=pen.px(4))
                label = pen.text(words("lab.noisy"), _LETTERS, colour, cell.width)
                surface.blit(label, label.get_rect(midbottom=cell.midbottom))

    def _draw_shares(
        self, surface: pygame.Surface, pen: SpriteScale, area: pygame.Rect, recent: Recent
    ) -> None:
        """Draw a strip for each class: its probability over time."""
        ages_s, _, shares = recent
        names = [naming.gesture(self.words, label) for label in self.data.labels]
        high = area.height / max(1, len(names))
        for number, name in enumerate(names):
            top = round(area.top + number * high)
            strip = pygame.Rect(area.left, top, area.width, max(2, round(high) - pen.px(_GAP)))
            pygame.draw.rect(surface, pen.palette.surface, strip, border_radius=pen.px(4))
            label = pen.text(name, _LETTERS, None, strip.width - pen.px(12))
            surface.blit(label, (strip.left + pen.px(6), strip.top + pen.px(2)))
            trace(surface, strip, ages_s, shares[:, number], pen.palette.accent)


def latency(words: Words, hops: Sequence[StageTime]) -> str:
    """Return how long half of the frames take, hop by hop, and the slowest of a hundred."""
    named = [(words(f"lab.hop_{hop.name}"), hop) for hop in hops]
    usual = ", ".join(f"{name} {hop.p50_ms:.0f} ms" for name, hop in named)
    slowest = ", ".join(f"{name} {hop.p99_ms:.0f} ms" for name, hop in named)
    return f"{words('lab.usual', hops=usual)} {words('lab.slowest', hops=slowest)}"


def trace(
    surface: pygame.Surface,
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
        pygame.draw.lines(surface, colour, False, np.column_stack((x, y)).tolist())


def _quality(noise: Array, words: Words) -> str:
    """Return the noise of the median taxel and of the worst one, (rows, columns)."""
    row, column = np.unravel_index(int(noise.argmax()), noise.shape)
    usual, worst = words.number(np.median(noise), ".2%"), words.number(noise.max(), ".2%")
    return words("lab.quality", usual=usual, worst=worst, place=f"{row}/{column}")
