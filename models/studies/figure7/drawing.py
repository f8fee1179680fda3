"""Figure 7 of the paper, drawn for both recipes: a to f, a picture for each preset."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from controller import files

MEASURED: Final = "figure7.json"  # beside the pictures
CORAL, BLUE, INK, DIM, LINE = "#c2510f", "#1f6fd0", "#1e2535", "#8c96ae", "#dfe3ec"
RECIPES: Final = (("paper", "paper’s recipe", CORAL), ("default", "ours", BLUE))
JUDGED: Final = (("random", "random test", "--"), ("day", "another day", "-"))
# Paper, section 4.2: what it reports, and for how many examples.
PAPER_SHARE: Final = 0.988
PAPER_USERS: Final = 0.976
PAPER_ERROR: Final = 0.09  # "mm", which are grid units (docs/paper.md)
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
    "svg.hashsalt": "orbtouch",
    "savefig.facecolor": "white",
}
Parts = Mapping[str, Mapping[str, Any]]


def draw(found: Mapping[str, Any], folder: Path) -> list[Path]:
    """Draw a picture for each preset.

    Args:
        found: What models/studies/figure7/study.py measured.
        folder: Where they go.
    """
    presets = dict.fromkeys(key.split()[0] for key in found["parts"])
    return [_picture(found, preset, folder) for preset in presets]


def _picture(found: Mapping[str, Any], preset: str, folder: Path) -> Path:
    """Draw the six parts for one preset."""
    parts: Parts = found["parts"]
    path = folder / f"figure7-{preset}.svg"
    with mpl.rc_context(STYLE):
        figure, axes = plt.subplots(3, 2, figsize=(10.4, 10.3))
        for row, network in zip(axes, ("CNN-3D", "users", "CNN-2D"), strict=True):
            own = {name: parts[f"{preset} {name} {network}"] for name, _, _ in RECIPES}
            for panel, over in zip(row, ("epochs", "sizes"), strict=True):
                _panel(panel, own, network, over)
        for panel, letter, words in zip(
            axes.flat,
            "abcdef",
            (
                "gestures, over the epochs",
                "gestures, over what was taught",
                "ten users, over the epochs",
                "ten users, over what was taught",
                "places, over the epochs",
                "places, over what was taught",
            ),
            strict=True,
        ):
            panel.set_title(f"{letter}  {words}")
        figure.tight_layout(w_pad=2.0, h_pad=2.0)
        save(figure, path, metadata={"Date": None})
        plt.close(figure)
    return path


def save(figure: Figure, path: Path, **options: Any) -> None:
    """Write a drawing, complete or not at all; its name says in which format."""
    drawn = io.BytesIO()
    figure.savefig(drawn, format=path.suffix.removeprefix("."), **options)
    files.atomic_write(path, drawn.getvalue())


def _panel(axes: Axes, own: Parts, network: str, over: str) -> None:
    """Draw one part of the figure: both recipes, by the paper's protocol and on another day."""
    share = network != "CNN-2D"
    claim = {"CNN-3D": PAPER_SHARE, "users": PAPER_USERS, "CNN-2D": PAPER_ERROR}[network]
    ends: list[tuple[float, str, str]] = []
    column, right = ("epoch", 1.0) if over == "epochs" else ("examples", 1.0)
    for name, words, colour in RECIPES:
        part = own[name][over]
        x = part[column]
        right = max(right, x[-1])
        axes.fill_between(x, part["random"], part["day"], color=colour, alpha=0.1, lw=0)
        for judged, what, dash in JUDGED:
            axes.plot(x, part[judged], dash, color=colour, lw=1.8)
            ends.append((part[judged][-1], f"{words}, {what}", colour))
    axes.set_xscale("log")
    axes.set_xlim(right=right)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0) if right < 1e5 else (1.0,)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.axhline(claim, color=DIM, lw=1.0, ls=":")
    ends.append((claim, "what the paper reports", DIM))
    if share:
        axes.set_ylim(0.0 if network == "users" else 0.5, 1.0)
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.0f} %"))
        axes.set_ylabel("windows named rightly")
    else:
        axes.set_ylim(0.0, 0.6)
        axes.set_ylabel("error, grid units, mean of the axes")
    axes.set_xlabel(
        "epochs" if over == "epochs" else f"{'windows' if share else 'images'} learned from"
    )
    axes.grid(axis="y", color=LINE, lw=0.6)
    axes.set_axisbelow(True)
    _labels(axes, ends, right)


def _labels(axes: Axes, ends: Sequence[tuple[float, str, str]], right: float) -> None:
    """Write beside the ends of lines, none over another."""
    low, high = axes.get_ylim()
    least = 0.062 * (high - low)
    ordered = sorted((min(max(value, low), high), words, colour) for value, words, colour in ends)
    place: list[float] = []
    for value, _, _ in ordered:
        place.append(max(value, place[-1] + least) if place else value)
    for i in reversed(range(len(place))):  # what was pushed over the top comes down again
        place[i] = min(place[i], high - least * (len(place) - 1 - i))
    for y, (_, words, colour) in zip(place, ordered, strict=True):
        axes.annotate(
            words,
            (right, y),
            xytext=(5, 0),
            textcoords="offset points",
            color=colour,
            va="center",
            fontsize=8,
            annotation_clip=False,
        )
