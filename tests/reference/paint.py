"""Colours and brushes of the pictures."""

import sys
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

Array = NDArray[np.float64]

CORAL, BLUE, INK, DIM, LINE = "#ff8a5c", "#3b82d6", "#1e2535", "#8c96ae", "#dfe3ec"
SIGNED = LinearSegmentedColormap.from_list(
    "signed", ["#174a8c", BLUE, "#b9d8f5", "#ffffff", "#ffd3c0", CORAL, "#b8431a"]
)
STYLE: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": DIM,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "xtick.color": DIM,
    "ytick.color": DIM,
    "legend.frameon": False,
    "svg.hashsalt": "orbtouch",
    "savefig.dpi": 130,
    "savefig.facecolor": "white",
}


def image(axes: Axes, log_c: Array, limit: float) -> None:
    """A 5 x 5 image with its values in percent of C0."""
    axes.imshow(log_c.reshape(5, 5), cmap=SIGNED, vmin=-limit, vmax=limit)
    for (row, column), value in np.ndenumerate(np.expm1(log_c).reshape(5, 5) * 100):
        ink = "white" if abs(log_c[5 * row + column]) > 0.55 * limit else INK
        axes.text(column, row, f"{value:+.0f}", ha="center", va="center", fontsize=8, color=ink)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)


def save(figure: Figure, path: Path) -> None:
    figure.tight_layout()
    figure.savefig(
        path, bbox_inches="tight", metadata={"Date": None} if path.suffix == ".svg" else None
    )
    plt.close(figure)
    print(path, file=sys.stderr)
