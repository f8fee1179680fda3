"""Curves of a sweep: the score over each axis of numbers, with its intervals."""

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from models.reports import drawing
from models.reports.drawing import styled
from models.studies.sweep import figures
from models.studies.sweep.figures import Measure, Point

FAR: Final = 8.0  # ratio of an axis's largest value to its smallest, from which it is logarithmic
LINES: Final = 10  # in a legend


def save(points: Sequence[Point], axes: Sequence[str], measure: Measure, path: Path) -> Path:
    """Draw the score over each axis into a file, and return its path."""
    return drawing.save(draw(points, axes, measure), path)


@styled
def draw(points: Sequence[Point], axes: Sequence[str], measure: Measure) -> Figure:
    """Return a drawing of the score over each axis, a line for each place on the others."""
    figure, panels = drawing.panels(640.0, 290.0 * len(axes), 1, len(axes))
    for axis, panel in zip(axes, panels[:, 0], strict=True):
        _draw(panel, points, axis)
        panel.set_ylabel(measure.words)
    return figure


def _draw(panel: Axes, points: Sequence[Point], axis: str) -> None:
    """Draw the scores over an axis, with their intervals."""
    lines: dict[str, list[Point]] = {}
    for point in sorted(points, key=lambda point: point.amount(axis)):
        others = {key: value for key, value in point.at.items() if key != axis}
        lines.setdefault(figures.title(others), []).append(point)
    for (name, line), marker in zip(lines.items(), cycle("os^Dv"), strict=False):
        x, own = [point.amount(axis) for point in line], [point.figure for point in line]
        down, up = [one.value - one.low for one in own], [one.high - one.value for one in own]
        y = [one.value for one in own]
        panel.errorbar(x, y, (down, up), marker=marker, capsize=3.0, label=name)
    amounts = [point.amount(axis) for point in points]
    if min(amounts) > 0.0 and max(amounts) / min(amounts) >= FAR:
        panel.set_xscale("log")
    panel.set_xlabel(axis)
    if 1 < len(lines) <= LINES:
        panel.legend()
