"""Drawings in one style, as SVG elements of report pages and as files, reproducible.

A drawing on a page follows it into dark mode: draw in `COLOURS`, and `svg` puts the style sheet's
variables in their place.
"""

import io
import math
import re
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from controller.shared import files

# Variables of style.css and their values on light paper.
COLOURS: Final = {
    "ink": "#1e2535",
    "dim": "#5d6880",
    "line": "#dfe3ec",
    "panel": "#f5f7fb",
    "paper": "#ffffff",
    "unseen": "#1f6fd0",
    "random": "#c2510f",
    "train": "#7b869c",
    "good": "#1b7f4b",
    "doubtful": "#96640a",
    "violet": "#8a3fb0",
    "pink": "#b8336a",
    "teal": "#0f7f8c",
}
INK, DIM, LINE, PANEL, PAPER = (COLOURS[it] for it in ("ink", "dim", "line", "panel", "paper"))
UNSEEN, RANDOM, TRAIN = (COLOURS[it] for it in ("unseen", "random", "train"))
STYLE: Final[dict[Any, Any]] = {
    "axes.axisbelow": True,
    "axes.edgecolor": DIM,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.labelcolor": DIM,
    "axes.linewidth": 1.0,
    "axes.spines.left": False,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlecolor": DIM,
    "axes.titlelocation": "left",
    "axes.titlesize": 12,
    "font.size": 12,
    "grid.color": LINE,
    "legend.frameon": False,
    "legend.labelcolor": "linecolor",
    "lines.linewidth": 2.2,
    "svg.fonttype": "none",
    "svg.hashsalt": "orbtouch",
    "text.color": INK,
    "text.parse_math": False,  # names of users and sessions are shown as they are
    "xtick.color": DIM,
    "xtick.major.size": 0,
    "xtick.minor.size": 0,
    "ytick.color": DIM,
    "ytick.major.size": 0,
    "ytick.minor.size": 0,
}
PIXELS_PER_INCH: Final = 72  # one pixel of the page is one point of the drawing
PERCENT: Final = FuncFormatter(lambda value, _: f"{100 * value:.3g} %")
PLAIN: Final = FuncFormatter(lambda value, _: f"{value:.3g}")

Panels = NDArray[Any]  # (rows, columns) of Axes

styled: Final = mpl.rc_context(STYLE)  # decorator of functions that draw


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


def svg(figure: Figure, alternative: str) -> Markup:
    """Return a drawing in `COLOURS` as an SVG element, with its content in words."""
    buffer = io.StringIO()
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", "Glyph .* missing", UserWarning
        )  # the page has other fonts
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    width, height = figure.get_size_inches() * PIXELS_PER_INCH
    _, _, inside = buffer.getvalue().partition("<svg ")[2].partition(">")
    inside = re.sub(r"<metadata>.*?</metadata>|<defs>\s*<style.*?</defs>", "", inside, flags=re.S)
    inside = re.sub(r' id="[\w.]+_\d+"|font-family: [^;"]*;? ?', "", inside)
    inside = re.sub(r"\s+", " ", inside).replace("xlink:href", "href")
    for name, colour in COLOURS.items():
        inside = inside.replace(colour, f"var(--{name})")
    return Markup(  # matplotlib escaped the texts inside
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
        f'style="max-width:{width:.0f}px" aria-label="{escape(alternative)}">{inside}'
    )


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
