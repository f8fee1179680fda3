"""Figures of the report page: training curves, calibration, and a map of touches."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from markupsafe import Markup
from matplotlib.collections import LineCollection
from matplotlib.ticker import MaxNLocator

from models.reports.drawing import (
    DIM,
    LINE,
    PAPER,
    PERCENT,
    PLAIN,
    RANDOM,
    TRAIN,
    UNSEEN,
    limits,
    new,
    styled,
    svg,
)
from models.results.training import Epoch

ARROWS_SHOWN: Final = 350  # on a map of touches
MAP_PX: Final = 330.0

Touch = tuple[float, float, float, float]  # x, y, error in x, error in y, grid units
Grid = tuple[int, int]  # rows and columns of the sensor


@styled
def curves(epochs: Sequence[Epoch], best: int, *, share: bool) -> Markup:
    """Return scores over the epochs, as shares or errors in grid units, and the epoch kept."""
    figure, axes = new(470, 290)
    title = "right windows" if share else "error, grid units"
    axes.set(title=title, xlabel="epoch", xlim=(1, max(2, len(epochs))))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    axes.axvline(best, color=DIM, lw=1, ls=":")
    axes.text(best, 1.01, "kept", transform=axes.get_xaxis_transform(), ha="center", color=DIM)
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
def reliability(bins: Sequence[tuple[float, float, int]]) -> Markup:
    """Return the share of right answers over the probability given, (confidence, right, count)."""
    figure, axes = new(360, 320)
    axes.plot([0, 1], [0, 1], "--", color=DIM, lw=1)
    sure, right, amounts = np.array(bins, dtype=np.float64).reshape(-1, 3).T
    axes.plot(sure, right, color=UNSEEN, lw=1.4)
    sizes = np.square(6.0 + 14.0 * np.sqrt(amounts / amounts.max(initial=1.0)))
    axes.scatter(sure, right, sizes, color=UNSEEN, edgecolors=PAPER, zorder=3)
    axes.set(
        title="how often it was right",
        xlabel="how sure it was",
        xlim=(-0.03, 1.03),
        ylim=(-0.03, 1.03),
    )
    axes.xaxis.set_major_formatter(PERCENT)
    axes.yaxis.set_major_formatter(PERCENT)
    return svg(figure, "share of right answers over the probability that was given")


@styled
def touch_errors(touches: Sequence[Touch], grid: Grid) -> Markup:
    """Return a map of touches: where each was, and a line to where it was estimated."""
    rows, columns = grid  # row 0 is at the bottom, as the player sees the sensor
    unit = MAP_PX / max(grid)
    figure, axes = new(columns * unit + 44, rows * unit + 44)
    axes.set(
        xlim=(-0.5, columns - 0.5),
        ylim=(-0.5, rows - 0.5),
        aspect="equal",
        xlabel="x and y in grid units",
    )
    axes.grid(visible=False)
    axes.spines["bottom"].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    sites = np.argwhere(np.ones(grid)).T[::-1]
    axes.scatter(sites[0], sites[1], s=300, facecolors="none", edgecolors=LINE)
    at = np.array(touches, dtype=np.float64).reshape(-1, 4)
    at = at[:: max(1, -(-len(touches) // ARROWS_SHOWN))]
    lines = np.stack([at[:, :2], at[:, :2] + at[:, 2:]], axis=1)
    axes.add_collection(LineCollection(list(lines), colors=RANDOM, linewidths=1.3))
    axes.scatter(at[:, 0], at[:, 1], s=12, color=DIM, lw=0)
    return svg(figure, "touches and how far off each was")
