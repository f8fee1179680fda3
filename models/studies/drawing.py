"""Drawings of studies: several panels in the style of the reports, reproducible as SVG and PNG."""

import io
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from controller import files
from models.reports.drawing import INK, PIXELS_PER_INCH, styled

DOTS_PER_INCH: Final = 130

Panels = NDArray[Any]  # (rows, columns) of Axes


def panels(
    width: float, height: float, columns: int, rows: int = 1, **options: Any
) -> tuple[Figure, Panels]:
    """Return an empty drawing of a size in pixels, and its panels, (rows, columns).

    Args:
        width: Of the drawing.
        height: Of the drawing.
        columns: Panels side by side.
        rows: Panels one below the other.
        options: Of `Figure.subplots`.
    """
    size = (width / PIXELS_PER_INCH, height / PIXELS_PER_INCH)
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


@styled
def save(figure: Figure, path: Path) -> Path:
    """Write a drawing, complete or not at all, in the format of the path's suffix."""
    drawn, kind = io.BytesIO(), path.suffix.removeprefix(".")
    metadata = {"Date": None} if kind == "svg" else None
    figure.savefig(drawn, format=kind, dpi=DOTS_PER_INCH, facecolor="white", metadata=metadata)
    files.atomic_write(path, drawn.getvalue())
    return path


def above(axes: Axes, x: float, y: float, words: str, colour: str = INK) -> None:
    """Write words above a point, such as the top of a bar."""
    axes.annotate(words, (x, y), xytext=(0, 3), textcoords="offset points", color=colour,
                  ha="center", fontsize=10)  # fmt: skip
