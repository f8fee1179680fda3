"""Figures of the report page: training curves, calibration, label lateness, maps, and fronts."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from models.formatting import number, percent
from models.reports.drawing import (
    DIM,
    INK,
    LINE,
    PANEL,
    PAPER,
    PERCENT,
    PLAIN,
    RANDOM,
    TRAIN,
    UNSEEN,
    limits,
    name_point,
    new,
    styled,
    svg,
)
from models.results.evaluation import Point, Tuning
from models.results.training import Epoch, HeldOutScore, SessionRow

SESSIONS_SHOWN: Final = 30  # in the drawing of label lateness; of more, evenly spread ones
ARROWS_SHOWN: Final = 350  # on a map of touches
MAP_PX: Final = 330.0

Touch = tuple[float, float, float, float]  # x, y, error in x, error in y, grid units
Touches = NDArray[np.float64]  # (touches, 4): the same
Grid = tuple[int, int]  # rows and columns of the sensor


@styled
def curves(epochs: Sequence[Epoch], best: int, *, share: bool) -> Markup:
    """Return the score over the epochs: on training examples, on random windows, and unseen.

    Args:
        epochs: The curve.
        best: Number of the epoch that was kept.
        share: Scores are shares; else errors in grid units.
    """
    figure, axes = _over_epochs(
        len(epochs), best, "right windows" if share else "error, grid units"
    )
    numbers = [e.number for e in epochs]
    axes.plot(numbers, [e.random for e in epochs], "--", color=RANDOM, label="at random")
    axes.plot(numbers, [e.train for e in epochs], color=TRAIN, lw=1.5, label="learned")
    axes.plot(numbers, [e.check for e in epochs], color=UNSEEN, label="unseen")
    axes.plot([best], [epochs[best - 1].check], "o", color=UNSEEN, mec=PAPER, ms=9)
    axes.legend()
    every = [value for e in epochs for value in (e.train, e.check, e.random)]
    early = [value for e in epochs[: max(1, len(epochs) // 20)] for value in (e.train, e.check)]
    low, high = limits([v for v in every if v not in early] or every, least=0.04)
    axes.set_ylim(max(0.0, low), min(1.0, high))
    axes.yaxis.set_major_formatter(PERCENT if share else PLAIN)
    return svg(figure, "score over the epochs, on what was learned, at random and unseen")


@styled
def losses(epochs: Sequence[Epoch], best: int) -> Markup:
    """Return the loss over the epochs, on training examples and unseen."""
    figure, axes = _over_epochs(len(epochs), best, "loss")
    numbers = [e.number for e in epochs]
    axes.plot(numbers, [e.loss for e in epochs], color=TRAIN, lw=1.5, label="learned")
    axes.plot(numbers, [e.check_loss for e in epochs], color=UNSEEN, label="unseen")
    axes.legend()
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(10, (1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(PLAIN)
    axes.yaxis.set_minor_formatter(NullFormatter())
    return svg(figure, "loss over the epochs, on what was learned and unseen")


def _over_epochs(epochs: int, best: int, title: str) -> tuple[Figure, Axes]:
    figure, axes = new(470, 290)
    axes.set(title=title, xlabel="epoch", xlim=(1, max(2, epochs)))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    axes.axvline(best, color=DIM, lw=1, ls=":")
    axes.annotate("kept", (best, 1), xycoords=("data", "axes fraction"), xytext=(0, 3),
                  textcoords="offset points", ha="center", color=DIM)  # fmt: skip
    return figure, axes


@styled
def gap(honest: HeldOutScore, *, share: bool) -> Markup:
    """Return the score on unseen sessions above that of the paper's protocol."""
    figure, axes = new(560, 150)
    axes.plot([honest.low, honest.high], [1, 1], color=UNSEEN, lw=4, alpha=0.45)
    for row, value, colour in ((1, honest.unseen, UNSEEN), (0, honest.random, RANDOM)):
        name_point(axes, (value, row), percent(value) if share else number(value), colour)
    known = [honest.unseen, honest.random, honest.low, honest.high]
    low, high = limits(known, least=0.08 if share else 0.05, room=0.25)
    axes.set_xlim(max(0.0, low), min(high, 1.0) if share else high)
    axes.xaxis.set_major_formatter(PERCENT if share else PLAIN)
    _name_rows(axes, ["windows at random", "sessions never seen"])
    axes.set_ylim(-0.6, 1.9)
    for tick, colour in zip(axes.get_yticklabels(), (RANDOM, UNSEEN), strict=True):
        tick.set(color=colour, weight="bold")
    return svg(figure, "the score on unseen sessions and on windows at random")


def _name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows 0, 1, ... of a drawing whose values lie along x."""
    axes.set_yticks(range(len(names)), names)
    axes.grid(visible=False, axis="y")
    axes.grid(axis="x")


@styled
def reliability(bins: Sequence[tuple[float, float, int]]) -> Markup:
    """Return the share of right answers over the probability given, (confidence, right, count)."""
    figure, axes = new(360, 320)
    axes.plot([0, 1], [0, 1], "--", color=DIM, lw=1)
    sure, right, amounts = np.array(bins, dtype=np.float64).reshape(-1, 3).T
    axes.plot(sure, right, color=UNSEEN, lw=1.4)
    sizes = np.square(6.0 + 14.0 * np.sqrt(amounts / amounts.max(initial=1.0)))
    axes.scatter(sure, right, sizes, color=UNSEEN, edgecolors=PAPER, zorder=3)
    axes.set(title="how often it was right", xlabel="how sure it was",
             xlim=(-0.03, 1.03), ylim=(-0.03, 1.03))  # fmt: skip
    axes.xaxis.set_major_formatter(PERCENT)
    axes.yaxis.set_major_formatter(PERCENT)
    return svg(figure, "share of right answers over the probability that was given")


@styled
def label_lateness(rows: Sequence[SessionRow]) -> Markup:
    """Return the labels' lateness in each session: the median, its spread, and the truth."""
    known = [(row, row.lateness) for row in rows if row.lateness is not None]
    known = known[:: max(1, -(-len(known) // SESSIONS_SHOWN))]
    figure, axes = new(640, 74 + 34 * len(known))
    for place, (_, late) in enumerate(known):
        for y, colour, value, spread, truth in (
            (place - 0.16, UNSEEN, late.begin_s, late.begin_spread_s, late.true_begin_s),
            (place + 0.16, RANDOM, late.end_s, late.end_spread_s, late.true_end_s),
        ):
            at, half = 1000 * value, 500 * spread
            axes.plot([at - half, at + half], [y, y], color=colour, lw=4, alpha=0.45)
            axes.plot([at], [y], "o", color=colour, mec=PAPER, ms=9)
            axes.plot([1000 * truth], [y], "|", color=INK, ms=12, mew=2)
    axes.axvline(0, color=DIM, lw=1)
    axes.set_xlim(limits([*axes.get_xlim(), 0.0], least=100.0, room=0.0))
    axes.set_xlabel("milliseconds after the touch (left of 0: too early)")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:+.0f}"))
    _name_rows(axes, [_session(row) for row, _ in known])
    axes.set_ylim(len(known) - 0.5, -0.5)
    return svg(figure, "how late labels were, session by session")


def _session(row: SessionRow) -> str:
    if row.user or row.session:
        named = (("user", row.user), ("session", row.session))
        return ", ".join(f"{what} {name}" for what, name in named if name)
    return row.path.rpartition("/")[2].removesuffix(".npz")


@styled
def touch_errors(touches: Sequence[Touch], grid: Grid) -> Markup:
    """Return a map of touches: where each was, and a line to where it was estimated."""
    figure, axes = _map(grid)
    sites = np.argwhere(np.ones(grid)).T[::-1]
    axes.scatter(sites[0], sites[1], s=300, facecolors="none", edgecolors=LINE)
    at = _array(touches)[:: max(1, -(-len(touches) // ARROWS_SHOWN))]
    lines = np.stack([at[:, :2], at[:, :2] + at[:, 2:]], axis=1)
    axes.add_collection(LineCollection(list(lines), colors=RANDOM, linewidths=1.3))
    axes.scatter(at[:, 0], at[:, 1], s=12, color=DIM, lw=0)
    return svg(figure, "touches and how far off each was")


@styled
def error_map(touches: Sequence[Touch], grid: Grid) -> Markup:
    """Return the mean error around each taxel."""
    figure, axes = _map(grid)
    at = _array(touches)
    nearest = np.clip(np.rint(at[:, 1::-1]), 0, np.array(grid) - 1).astype(int)
    errors = np.abs(at[:, 2:]).mean(axis=1)
    means = {
        (row, column): float(errors[here].mean())
        for row, column in np.ndindex(*grid)
        if (here := (nearest == (row, column)).all(axis=1)).any()
    }
    _tiles(axes, means, "{:.2f}".format)
    return svg(figure, "mean error around each taxel, grid units")


@styled
def dead_taxels(shares: Mapping[tuple[int, int], float], whole: float, grid: Grid) -> Markup:
    """Return the share of gestures recognised with each taxel dead.

    Args:
        shares: By row from the top and column from the left.
        whole: The share while nothing is broken; NaN: unknown.
        grid: Rows and columns of the sensor.
    """
    figure, axes = _map(grid)
    usual = whole if math.isfinite(whole) else 1.0
    lost = {(grid[0] - 1 - row, column): usual - one for (row, column), one in shares.items()}
    _tiles(axes, lost, lambda value: f"{100 * (usual - value):.1f}", least=0.05)
    axes.set_axis_off()
    return svg(figure, "events recognised with each taxel dead, per cent")


def _array(touches: Sequence[Touch]) -> Touches:
    return np.array(touches, dtype=np.float64).reshape(-1, 4)


def _map(grid: Grid) -> tuple[Figure, Axes]:
    """Return an empty map of the sensor as its player sees it: row 0 at the bottom."""
    rows, columns = grid
    unit = MAP_PX / max(grid)
    figure, axes = new(columns * unit + 44, rows * unit + 44)
    axes.set(xlim=(-0.5, columns - 0.5), ylim=(-0.5, rows - 0.5), aspect="equal",
             xlabel="x and y in grid units")  # fmt: skip
    axes.grid(visible=False)
    axes.spines["bottom"].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    return figure, axes


def _tiles(
    axes: Axes,
    values: Mapping[tuple[int, int], float],
    words: Callable[[float], str],
    least: float = 0.0,
) -> None:
    """Draw a tile for each value, the darker the larger.

    Args:
        axes: Of the map.
        values: By row from below and column.
        words: Text of a tile; left out where tiles are small.
        least: A value of full strength is at least this.
    """
    high = max([least, *(v for v in values.values() if math.isfinite(v))]) or 1.0
    small = max(axes.get_xlim()[1], axes.get_ylim()[1]) > MAP_PX / 29.0
    for (row, column), value in values.items():
        for colour, strength in ((PANEL, 1.0), (RANDOM, max(0.0, 0.75 * value / high))):
            axes.add_patch(
                FancyBboxPatch((column - 0.42, row - 0.42), 0.84, 0.84, fc=colour, lw=0,
                               boxstyle="round,pad=0,rounding_size=0.05", alpha=strength)
            )  # fmt: skip
        if not small:
            axes.text(column, row, words(value), ha="center", va="center", weight="bold")


def missed(found: Tuning) -> Markup:
    """Return the share of events missed over latency, of the best debounce settings."""
    return _front(found, "events missed", lambda point: 1.0 - point.recall, PERCENT)


def false_alarms(found: Tuning) -> Markup:
    """Return the rate of false alarms over latency, of the best debounce settings."""
    title = "false alarms per idle minute"
    return _front(found, title, lambda point: point.false_alarms_per_min, PLAIN)


@styled
def _front(
    found: Tuning, title: str, value: Callable[[Point], float], words: FuncFormatter
) -> Markup:
    every = [*found.front, found.before, found.chosen]
    times, values = [p.latency_s for p in every], [value(p) for p in every]
    figure, axes = new(460, 280)
    axes.plot(times[:-2], values[:-2], "o", color=TRAIN, mec=PAPER, ms=6, clip_on=False)
    if found.before != found.chosen:
        name_point(axes, (times[-2], values[-2]), "before", RANDOM)
    name_point(axes, (times[-1], values[-1]), "chosen", UNSEEN)
    low, high = limits(values, least=0.002)
    axes.set(title=title, xlabel="median latency, s", xlim=limits(times, least=0.05),
             ylim=(max(0.0, low), high))  # fmt: skip
    axes.yaxis.set_major_formatter(words)
    return svg(figure, f"{title} over latency")
