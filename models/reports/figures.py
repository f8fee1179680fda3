"""Figures of a training, and the style of all drawings: reproducible SVG."""

import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from controller.shared import files
from models.results.training import Epoch, Training

INK: Final = "#1e2535"
DIM: Final = "#5d6880"
LINE: Final = "#dfe3ec"
UNSEEN: Final = "#1f6fd0"
RANDOM: Final = "#c2510f"
TRAIN: Final = "#7b869c"
PIXELS_PER_INCH: Final = 72  # one pixel is one point of the drawing
PERCENT: Final = FuncFormatter(lambda value, _: f"{100 * value:.3g} %")
PLAIN: Final = FuncFormatter(lambda value, _: f"{value:.3g}")

# Decorator of functions that draw.
styled: Final = mpl.rc_context(fname=str(Path(__file__).with_suffix(".mplstyle")))
ARROWS_SHOWN: Final = 350  # on a map of touches
MAP_PX: Final = 330.0

Panels = NDArray[Any]  # (rows, columns) of Axes
Touch = tuple[float, float, float, float]  # x, y, error in x, error in y, grid units
Grid = tuple[int, int]  # rows and columns of the sensor


def new(width: float, height: float) -> tuple[Figure, Axes]:
    """Return an empty drawing of a size in pixels, and its axes."""
    figure, axes = panels(width, height, 1)
    return figure, axes[0, 0]


def panels(width: float, height: float, columns: int, rows: int = 1) -> tuple[Figure, Panels]:
    """Return an empty drawing of a size in pixels, and its panels, (rows, columns)."""
    size = (width / PIXELS_PER_INCH, height / PIXELS_PER_INCH)
    figure = Figure(figsize=size, dpi=PIXELS_PER_INCH, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


@styled
def save(figure: Figure, path: Path) -> Path:
    """Write a drawing, complete or not at all, in the format of the path's suffix."""
    drawn, kind = io.BytesIO(), path.suffix.removeprefix(".")
    metadata = {"Date": None} if kind == "svg" else None
    figure.savefig(drawn, format=kind, facecolor="white", metadata=metadata)
    files.atomic_write(path, drawn.getvalue())
    return path


def draw_training(found: Training, beside: Path) -> list[Path]:
    """Draw a training's figures as NAME-WHAT.svg beside the file NAME.orb; return the paths."""
    drawn: dict[str, Figure] = {}
    if (gesture := found.gesture) is not None:
        drawn["gestures"] = curves(gesture.epochs, share=True)
        drawn["calibration"] = reliability(gesture.calibration.bins)
    if (location := found.location) is not None:
        drawn["places"] = curves(location.epochs, share=False)
        drawn["touches"] = touch_errors(location.touches, (found.rows, found.columns))
    return [save(one, beside.with_name(f"{beside.stem}-{name}.svg")) for name, one in drawn.items()]


def limits(values: Iterable[float], least: float) -> tuple[float, float]:
    """Return the limits of an axis of a least length around finite values, with room beside."""
    known = [value for value in values if math.isfinite(value)] or [0.0, 1.0]
    low, high = min(known), max(known)
    spare = max(least - (high - low), 0.0) / 2.0 + 0.06 * max(high - low, least)
    return low - spare, high + spare


def above(axes: Axes, x: float, y: float, words: str, colour: str = INK) -> None:
    """Write words above a point, such as the top of a bar."""
    axes.annotate(
        words,
        (x, y),
        xytext=(0, 3),
        textcoords="offset points",
        color=colour,
        ha="center",
        fontsize=10,
    )


@styled
def curves(epochs: Sequence[Epoch], *, share: bool) -> Figure:
    """Draw scores over the epochs, as shares or errors in grid units."""
    figure, axes = new(470, 290)
    title = "right windows" if share else "error, grid units"
    axes.set(title=title, xlabel="epoch", xlim=(1, max(2, len(epochs))))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    numbers = [e.number for e in epochs]
    axes.plot(numbers, [e.random for e in epochs], "--", color=RANDOM, label="at random")
    axes.plot(numbers, [e.train for e in epochs], color=TRAIN, lw=1.5, label="learned")
    axes.plot(numbers, [e.check for e in epochs], color=UNSEEN, label="unseen")
    axes.legend()
    every = [value for e in epochs for value in (e.train, e.check, e.random)]
    early = [value for e in epochs[: max(1, len(epochs) // 20)] for value in (e.train, e.check)]
    low, high = limits([v for v in every if v not in early] or every, least=0.04)
    axes.set_ylim(max(0.0, low), min(1.0, high))
    axes.yaxis.set_major_formatter(PERCENT if share else PLAIN)
    return figure


@styled
def reliability(bins: Sequence[tuple[float, float, int]]) -> Figure:
    """Draw the share of right answers over the probability given, (confidence, right, count)."""
    figure, axes = new(360, 320)
    axes.plot([0, 1], [0, 1], "--", color=DIM, lw=1)
    sure, right, amounts = np.array(bins, dtype=np.float64).reshape(-1, 3).T
    axes.plot(sure, right, color=UNSEEN, lw=1.4)
    sizes = np.square(6.0 + 14.0 * np.sqrt(amounts / amounts.max(initial=1.0)))
    axes.scatter(sure, right, sizes, color=UNSEEN, edgecolors="white", zorder=3)
    axes.set(
        title="how often it was right",
        xlabel="how sure it was",
        xlim=(-0.03, 1.03),
        ylim=(-0.03, 1.03),
    )
    axes.xaxis.set_major_formatter(PERCENT)
    axes.yaxis.set_major_formatter(PERCENT)
    return figure


@styled
def touch_errors(touches: Sequence[Touch], grid: Grid) -> Figure:
    """Draw a map of touches: where each was, and a line to where it was estimated."""
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
    return figure
