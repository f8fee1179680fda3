"""The lab: traces of all taxels, their quality, probabilities, latency, recording, faults."""

from collections.abc import Sequence
from functools import partial
from typing import Final

import pygame

from controller.shared.protocol.messages import Report, StageTime
from controller.shared.protocol.teaching import InjectFault, Record, RecordingStatus
from host.app import lab_view
from host.app.lab_data import LabData
from host.app.screen import Orb, OrbScreen
from host.ui import naming
from tetris.kit.language import Words
from tetris.kit.menu import Item, Menu
from tetris.kit.stage import Stage

# Faults that the virtual orb knows, and the place of each: docs/simulator.md.
FAULTS: Final = {
    "dead": "taxel",
    "leaky": "taxel",
    "open_row": "row",
    "open_column": "column",
    "short_row": "row",
    "short_column": "column",
    "air_leak": "",
    "temperature": "",
    "saturation": "",
    "mains": "",
    "jitter": "",
}
_KINDS: Final = ("", *FAULTS)


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
        pen = lab_view.Pen(surface, stage.look.palette, unit)
        top = pen.sentences(area, self._sentences())
        area.height, area.top = area.bottom - top, top
        grid = area.copy()
        grid.width = round(area.width * 0.66)
        shares = pygame.Rect(grid.right, area.top, area.width - grid.width, area.height)
        recent = self.data.recent(time_s)
        lab_view.taxels(pen, grid, recent, self.data.quality(), time_s, self.words)
        names = [naming.gesture(self.words, label) for label in self.data.labels]
        lab_view.probabilities(pen, shares.inflate(-round(16 * unit), 0), recent, time_s, names)

    def _sentences(self) -> list[str]:
        words, state = self.words, self.orb.state
        if state.link != "live":
            return [words("lab.no_orb")]
        lines = []
        if state.hops:
            lines.append(f"{latency(words, state.hops)} {slowest(words, state.hops)}")
        every = f"{1000 / state.period_ms:.0f}" if state.period_ms else f"{state.rate_hz:.0f}"
        rate = f"{state.rate_hz:.1f}"
        lines.append(words("lab.rate", rate=rate, wanted=every, missed=state.missed))
        return lines


def latency(words: Words, hops: Sequence[StageTime]) -> str:
    """Return how long half of the frames take, hop by hop."""
    return words("lab.usual", hops=_listed(words, [(hop.name, hop.p50_ms) for hop in hops]))


def slowest(words: Words, hops: Sequence[StageTime]) -> str:
    """Return how long the slowest of a hundred frames takes, hop by hop."""
    return words("lab.slowest", hops=_listed(words, [(hop.name, hop.p99_ms) for hop in hops]))


def _listed(words: Words, values: Sequence[tuple[str, float]]) -> str:
    return ", ".join(f"{words(f'lab.hop_{name}')} {value:.0f} ms" for name, value in values)
