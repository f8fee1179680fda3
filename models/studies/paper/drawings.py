"""Drawings of figures 7 and 9 of the paper, from the results of `study.measure`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from models.reports.figures import (
    DIM,
    INK,
    PERCENT,
    RANDOM,
    UNSEEN,
    above,
    panels,
    save,
    styled,
)
from models.studies.paper.section6 import BITS, PAPER_H_Y, PAPER_H_Z, PAPER_INFORMATION
from models.studies.paper.tables import NETWORKS, UNIFORM, part

# Groups of bars of figure 9: words, the paper's figure in nats, and key of ours.
BARS: Final = (
    ("labels, if equally\nfrequent", UNIFORM, "h_uniform"),
    ("labels, H(y)", PAPER_H_Y, "h_y"),
    ("a sensor’s signal,\nH(z)", PAPER_H_Z, "h_z"),
    ("information about\nthe label, I(z; y)", PAPER_INFORMATION, "information"),
    ("one scaling,\nbias removed", np.nan, "information_corrected"),
    ("labels shifted\nin time", np.nan, "null_slow"),
)
RECIPES: Final = (("paper", "paper’s recipe", RANDOM), ("default", "ours", UNSEEN))
JUDGED: Final = (("random", "random test", "--"), ("day", "another day", "-"))
# Title, the paper's figure (section 4.2), and limits of the axis of each network.
TITLES: Final = {
    "CNN-3D": ("gestures", 0.988, (0.5, 1.0)),
    "users": ("ten users", 0.976, (0.0, 1.0)),
    "CNN-2D": ("places", 0.09, (0.0, 0.6)),
}
OVER: Final = {"epochs": "over the epochs", "sizes": "over the examples"}

Found = Mapping[str, Any]


@styled
def draw(found: Found, folder: Path) -> list[Path]:
    """Draw what was measured: figure 7 of each preset, and figure 9; return the files."""
    paths = []
    for preset in part(found, "figure7 default users"):
        own = {
            (recipe, network): found["parts"].get(f"{preset}|figure7 {recipe} {network}")
            for recipe, *_ in RECIPES
            for network in NETWORKS
        }
        if all(own.values()):
            paths.append(save(_figure7(own), folder / f"figure7-{preset}.svg"))
    if sets := part(found, "section6"):
        paths.append(save(_figure9(sets), folder / "figure9.svg"))
    return paths


def _figure7(own: Mapping[tuple[str, str], Any]) -> Figure:
    """Draw parts a to f of figure 7 for both recipes, by recipe and network."""
    figure, axes = panels(1000, 1000, 2, 3)
    lettered = iter(zip(axes.flat, "abcdef", strict=True))
    for network, (title, *_) in TITLES.items():
        for (over, words), (panel, letter) in zip(OVER.items(), lettered, strict=False):
            panel.set_title(f"{letter}  {title}, {words}")
            _panel(panel, own, network, over)
    figure.legend(handles=panel.lines, loc="outside lower center", ncols=len(panel.lines))
    return figure


def _panel(axes: Axes, own: Mapping[tuple[str, str], Any], network: str, over: str) -> None:
    """Draw one part of the figure: both recipes, by the paper's protocol and on another day."""
    _, claim, limits = TITLES[network]
    column = "epoch" if over == "epochs" else "examples"
    share = network != "CNN-2D"
    right = 1.0
    for name, words, colour in RECIPES:
        curve = own[name, network][over]
        x = curve[column]
        right = max(right, x[-1])
        axes.fill_between(x, curve["random"], curve["day"], color=colour, alpha=0.1, lw=0)
        for judged, what, dash in JUDGED:
            axes.plot(x, curve[judged], dash, color=colour, label=f"{words}, {what}")
    axes.axhline(claim, color=DIM, lw=1.0, ls=":", label="reported in the paper")
    axes.set_xscale("log")
    axes.set_xlim(right=right)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0) if right < 1e5 else (1.0,)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(limits)
    if share:
        axes.yaxis.set_major_formatter(PERCENT)
    axes.set_ylabel("windows recognised" if share else "error, grid units, mean of the axes")
    learned = f"training {'windows' if share else 'images'}"
    axes.set_xlabel("epochs" if over == "epochs" else learned)


def _figure9(sets: Mapping[str, Any]) -> Figure:
    """Draw figure 9 of the paper beside ours, and its information made sound; in nats and bits."""
    figure, ((axes,),) = panels(1100, 440, 1)
    series = [("the paper, its “bits” read as nats", INK, [paper for _, paper, _ in BARS])]
    series += [
        (name, colour, [own[key] for *_, key in BARS])
        for colour, (name, own) in zip((UNSEEN, RANDOM), sets.items(), strict=False)
    ]
    width = 0.8 / len(series)
    for number, (name, colour, values) in enumerate(series):
        at = np.arange(len(values)) + (number - (len(series) - 1) / 2) * width
        axes.bar(at, values, width * 0.94, color=colour, label=name)
        for x, value in zip(at, values, strict=True):
            if np.isfinite(value):
                above(axes, x, value, f"{value:.{3 if value < 0.2 else 2}f}", colour)
    axes.set_xticks(np.arange(len(BARS)), [words for words, *_ in BARS], fontsize=10)
    axes.set_ylabel("nats")
    axes.set_title("section 6: 25 bins, scaled by gesture; on the right one scaling for all")
    bits = axes.secondary_yaxis("right", functions=(lambda v: v * BITS, lambda v: v / BITS))
    bits.set_ylabel("bits")
    axes.legend(loc="upper right")
    return figure
