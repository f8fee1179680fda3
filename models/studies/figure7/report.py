"""Drawings and tables of figure 7: parts a to f for both recipes, a picture for each preset."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from models.formatting import NONE
from models.reports import markdown
from models.reports.drawing import DIM, PERCENT, RANDOM, UNSEEN, panels, save, styled
from models.reports.tables import Table

MEASURED: Final = "figure7.json"  # beside the pictures
RECIPES: Final = (("paper", "paper’s recipe", RANDOM), ("default", "ours", UNSEEN))
JUDGED: Final = (("random", "random test", "--"), ("day", "another day", "-"))
# Title in the pictures, name in the tables, the paper's figure (section 4.2; its error is in "mm",
# which are grid units: docs/paper.md), and limits of the axis.
NETWORKS: Final = {
    "CNN-3D": ("gestures", "CNN-3D", 0.988, (0.5, 1.0)),
    "users": ("ten users", "ten users", 0.976, (0.0, 1.0)),
    "CNN-2D": ("places", "CNN-2D", 0.09, (0.0, 0.6)),
}
OVER: Final = {"epochs": "over the epochs", "sizes": "over the examples"}

Found = Mapping[str, Any]


@styled
def draw(found: Found, folder: Path) -> list[Path]:
    """Draw a picture of the measured results for each preset, and return their paths."""
    paths = []
    for preset in dict.fromkeys(key.split()[0] for key in found["parts"]):
        figure, axes = panels(1000, 1000, 2, 3)
        lettered = iter(zip(axes.flat, "abcdef", strict=True))
        for network, (title, *_) in NETWORKS.items():
            own = {name: found["parts"][f"{preset} {name} {network}"] for name, *_ in RECIPES}
            for (over, words), (panel, letter) in zip(OVER.items(), lettered, strict=False):
                panel.set_title(f"{letter}  {title}, {words}")
                _panel(panel, own, network, over)
        figure.legend(handles=panel.lines, loc="outside lower center", ncols=len(panel.lines))
        paths.append(save(figure, folder / f"figure7-{preset}.svg"))
    return paths


def _panel(axes: Axes, own: Mapping[str, Found], network: str, over: str) -> None:
    """Draw one part of the figure: both recipes, by the paper's protocol and on another day."""
    *_, claim, limits = NETWORKS[network]
    column = "epoch" if over == "epochs" else "examples"
    share = network != "CNN-2D"
    right = 1.0
    for name, words, colour in RECIPES:
        part = own[name][over]
        x = part[column]
        right = max(right, x[-1])
        axes.fill_between(x, part["random"], part["day"], color=colour, alpha=0.1, lw=0)
        for judged, what, dash in JUDGED:
            axes.plot(x, part[judged], dash, color=colour, label=f"{words}, {what}")
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


def text(found: Found) -> str:
    """Return all tables as Markdown."""
    return f"{markdown.table(ends(found))}\n\n{markdown.table(lateness(found))}"


def ends(found: Found) -> Table:
    """Return the ends of all curves: the paper's protocol and ours, side by side."""
    rows = []
    for key, part in found["parts"].items():
        preset, recipe, network = key.split()
        share = network != "CNN-2D"
        whole = "events" if share else "presses"
        end = {name: values[-1] for name, values in part["sizes"].items()}
        gap = end["random"] - end["day"] if share else end["day"] - end["random"]
        spread = f"{100 * gap:.1f} points" if share else f"{gap:.3f}".replace("-", "−")
        cells = [
            NONE if name not in end else _percent(end[name]) if share else f"{end[name]:.3f}"
            for name in ("random", "day", "people", f"day {whole}", f"people {whole}")
        ]
        ours = "the paper’s" if recipe == "paper" else "ours"
        rows.append([preset, NETWORKS[network][1], ours, *cells[:3], spread, *cells[3:]])
    head = ("orb", "network", "recipe", "random test", "another day", "other people", "gap",
            "whole touches, another day", "other people")  # fmt: skip
    return Table(head, rows)


def lateness(found: Found) -> Table:
    """Return the lateness of the label button, and the effect of the repair."""
    rows = []
    for preset, late in found["labels"].items():
        lags = [late[name] for name in ("begin_s", "true_begin_s", "end_s", "true_end_s")]
        wrong = [_percent(late[name]) for name in ("wrong", "wrong_after")]
        rows.append([preset, *(f"{lag:+.2f} s".replace("-", "−") for lag in lags), *wrong])
    head = ("orb", "down, estimated", "down, truly", "up, estimated", "up, truly",
            "frames labelled wrongly", "after the repair")  # fmt: skip
    return Table(head, rows)


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
