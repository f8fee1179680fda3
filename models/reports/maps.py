"""The drawings of a report that have the sensor's shape, and the thresholds' front."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from models.reports.svg import Plot, fitted
from models.results.evaluation import Point, Tuning
from models.text import percent, seconds

Touch = tuple[float, float, float, float]  # x, y, error in x, error in y, grid units

ARROWS: Final = 350  # that a map shows
SIDE_PX: Final = 330.0


def errors(touches: Sequence[Touch], rows: int, columns: int) -> str:
    """Return where touches were, and where they were thought to be."""
    plot = _grid(rows, columns)
    for row in range(rows):
        for column in range(columns):
            plot.circle(plot.at((column, row)), 9.0, "site")
    for x, y, off_x, off_y in touches[:: max(1, -(-len(touches) // ARROWS))]:
        plot.path([(x, y), (x + off_x, y + off_y)], "arrow")
        plot.dot((x, y), "foot", 1.8, f"({x:.2f}, {y:.2f}), off by ({off_x:+.2f}, {off_y:+.2f})")
    return plot.svg("touches and how far off each was")


def error_map(touches: Sequence[Touch], rows: int, columns: int) -> str:
    """Return the mean error around each taxel."""
    plot = _grid(rows, columns)
    at = np.array(touches, dtype=np.float64).reshape(-1, 4)
    row = np.clip(np.rint(at[:, 1]), 0, rows - 1).astype(int)
    column = np.clip(np.rint(at[:, 0]), 0, columns - 1).astype(int)
    each = np.abs(at[:, 2:]).mean(axis=1)
    means = {
        (r, c): float(each[here].mean())
        for r in range(rows)
        for c in range(columns)
        if (here := (row == r) & (column == c)).any()
    }
    _tiles(plot, means, lambda v: f"{v:.2f}")
    return plot.svg("mean error around each taxel, grid units")


def taxels(shares: Mapping[tuple[int, int], float], whole: float, rows: int, columns: int) -> str:
    """Return how many gestures are still recognised with each taxel dead.

    Args:
        shares: By row from the top and column from the left.
        whole: The share while nothing is broken; NaN: unknown.
        rows: Of the sensor.
        columns: Of the sensor.
    """
    plot = _grid(rows, columns, axes=False)
    usual = whole if math.isfinite(whole) else 1.0
    lost = {(rows - 1 - row, column): usual - share for (row, column), share in shares.items()}
    _tiles(plot, lost, lambda v: f"{100 * (usual - v):.1f}", least=0.05)
    return plot.svg("events recognised with each taxel dead, per cent")


def missed(found: Tuning) -> str:
    """Return how many events the best choices of thresholds miss, over their latency."""
    return _front(found, "events missed", lambda point: 1.0 - point.recall, percent)


def alarms(found: Tuning) -> str:
    """Return how often the best choices of thresholds answer nothing, over their latency."""
    return _front(
        found, "false alarms per idle minute", lambda point: point.false_alarms_per_min, _short
    )


def _front(
    found: Tuning, title: str, value: Callable[[Point], float], words: Callable[[float], str]
) -> str:
    every = [*found.front, found.before, found.chosen]
    low, high = fitted([value(point) for point in every], least=0.002)
    times = fitted([point.latency_s for point in every], least=0.05)
    plot = Plot((460, 280), times, (max(0.0, low), high), margins=(30, 24, 44, 62))
    plot.axes("median latency, s", title, lambda v: f"{v:.2f}", words)
    for point in found.front:
        plot.dot((point.latency_s, value(point)), "mark train", 3.2, _point(point))
    named = [(found.chosen, "unseen", "chosen")]
    if found.before != found.chosen:
        named.insert(0, (found.before, "random", "before"))
    for point, kind, name in named:
        at = plot.at((point.latency_s, value(point)))
        plot.circle(at, 6.5, f"mark {kind}", f"{name}: {_point(point)}")
        plot.text((at[0], at[1] - 11), name, f"name {kind} mid")
    return plot.svg(f"{title} over latency")


def _short(value: float) -> str:
    return f"{value:.3g}"


def _point(point: Point) -> str:
    return (
        f"smoothing {point.smoothing:g}, on {point.on:g}, off {point.off:g}: recall "
        f"{percent(point.recall)}, {point.false_alarms_per_min:.3f} false alarms per minute, "
        f"{seconds(point.latency_s)}"
    )


def _grid(rows: int, columns: int, *, axes: bool = True) -> Plot:
    """Return an empty drawing of the sensor as its player sees it."""
    unit = SIDE_PX / max(rows, columns)
    size = (columns * unit + 44, rows * unit + 44)
    plot = Plot(size, (-0.5, columns - 0.5), (-0.5, rows - 0.5), margins=(6, 6, 38, 38))
    if axes:
        step = max(1, max(rows, columns) // 8)
        for column in range(0, columns, step):
            plot.text((plot.x(column), plot.y.first + 16), str(column), "tick mid")
        for row in range(0, rows, step):
            plot.text((plot.x.first - 8, plot.y(row) + 4), str(row), "tick end")
        middle = (plot.x.first + plot.x.last) / 2
        plot.text((middle, plot.y.first + 32), "x and y in grid units", "title mid")
    return plot


def _tiles(
    plot: Plot,
    values: Mapping[tuple[int, int], float],
    words: Callable[[float], str],
    least: float = 0.0,
) -> None:
    """Draw a tile for each value, the stronger the larger.

    Args:
        plot: Of the sensor.
        values: By row from below and column.
        words: What is written on a tile.
        least: A value that is as strong as this is not faint, however small the others are.
    """
    wide = abs(plot.x(1) - plot.x(0)) - 3
    tall = abs(plot.y(1) - plot.y(0)) - 3
    high = max([least, *(v for v in values.values() if math.isfinite(v))]) or 1.0
    for (row, column), value in values.items():
        x, y = plot.at((column, row))
        plot.box((x - wide / 2, y - tall / 2), (wide, tall), "tile")
        strength = 0.75 * value / high
        plot.box((x - wide / 2, y - tall / 2), (wide, tall), "heat", strength=max(0.0, strength))
        if wide > 26:
            plot.text((x, y + 4), words(value), "value mid")
