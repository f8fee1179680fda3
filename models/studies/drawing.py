"""Style and files of the studies' drawings: reproducible SVG and PNG by matplotlib."""

import io
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from controller import files

CORAL, BLUE, INK, DIM, LINE = "#c2510f", "#1f6fd0", "#1e2535", "#8c96ae", "#dfe3ec"
SERIES: Final = (BLUE, CORAL, "#1b7f4b", "#7a4fb5", "#96640a")  # of several sets in one drawing
DOTS_PER_INCH: Final = 130
STYLE: Final[dict[Any, Any]] = {
    "axes.axisbelow": True,
    "axes.edgecolor": DIM,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.labelcolor": INK,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "grid.color": LINE,
    "grid.linewidth": 0.6,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "savefig.facecolor": "white",
    "svg.hashsalt": "orbtouch",
    "text.color": INK,
    "xtick.color": DIM,
    "xtick.labelcolor": INK,
    "ytick.color": DIM,
    "ytick.labelcolor": INK,
}


def new(width: float, height: float) -> Figure:
    """Return an empty drawing of a size in inches; panels share its room without overlap."""
    with mpl.rc_context(STYLE):
        return Figure(figsize=(width, height), layout="constrained")


def save(figure: Figure, path: Path) -> Path:
    """Write a drawing, complete or not at all, in the format of the path's suffix."""
    drawn, kind = io.BytesIO(), path.suffix.removeprefix(".")
    with mpl.rc_context(STYLE):
        metadata = {"Date": None} if kind == "svg" else None
        figure.savefig(drawn, format=kind, dpi=DOTS_PER_INCH, metadata=metadata)
    files.atomic_write(path, drawn.getvalue())
    return path


def beside(axes: Axes, x: float, y: float, words: str, colour: str) -> None:
    """Write words on the right of a point, such as the end of a line."""
    axes.annotate(words, (x, y), xytext=(6, 0), textcoords="offset points", color=colour,
                  va="center", fontsize=8, annotation_clip=False)  # fmt: skip


def above(axes: Axes, x: float, y: float, words: str, colour: str = INK) -> None:
    """Write words above a point, such as the top of a bar."""
    axes.annotate(words, (x, y), xytext=(0, 3), textcoords="offset points", color=colour,
                  ha="center", fontsize=8)  # fmt: skip


def legend(axes: Axes, words: str, y: float = 0.98) -> None:
    """Explain the lines or bars of a panel in words, at a height of it from 0 to 1."""
    axes.annotate(words, (0.02, y), xycoords="axes fraction", va="top", fontsize=8, color=DIM)
