"""Drawings of an information study; each is clear without its caption."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from controller.simulator.orb import PRESETS
from models.reports.drawing import DIM, INK, RANDOM, UNSEEN, above, panels, styled
from models.reports.drawing import SERIES as OTHERS
from models.studies.information import results
from models.studies.information.histogram import (
    BITS,
    PAPER_H_Y,
    PAPER_H_Z,
    PAPER_INFORMATION,
)
from models.studies.information.tables import UNIFORM

# Groups of bars: words, the paper's figure in nats, and key of ours.
PRINTED: Final = (
    ("labels, if equally\nfrequent", UNIFORM, "h_uniform"),
    ("labels, H(y)", PAPER_H_Y, "h_y"),
    ("a sensor’s signal,\nH(z)", PAPER_H_Z, "h_z"),
    ("information about\nthe label, I(z; y)", PAPER_INFORMATION, "information"),
)
CORRECTED: Final = {
    "scaled by\ngesture": "information",
    "one scaling\nfor all": "information_global",
    "bias\nremoved": "information_corrected",
    "labels\nshifted": "null_slow",
    "labels\nshuffled": "null",
}
# Estimates of the information of a window: words, path of the figure, and whether it is a bound.
ESTIMATES: Final = (
    ("one image, neighbours", ("neighbours", "rows", "image", "apart"), False),
    ("window, 3 components, neighbours", ("neighbours", "rows", "3 components", "apart"), False),
    ("window, 20 components, neighbours", ("neighbours", "rows", "20 components", "apart"), False),
    ("the same, neighbours of other days", ("neighbours", "rows", "20 components", "days"), False),
    ("linear classifier", ("classifier", "rows", "linear, rest followed", "scaled"), True),
    ("two layers, fixed baseline", ("classifier", "rows", "mlp, rest first", "scaled"), True),
    ("two layers", ("classifier", "rows", "mlp, rest followed", "scaled"), True),
    ("the bundle that ships", ("classifier", "rows", "the bundle that ships", "scaled"), True),
)

SERIES: Final = (UNSEEN, RANDOM, *OTHERS[1:])  # of several sets in one drawing

Found = Mapping[str, Any]
Series = Sequence[tuple[str, str, Sequence[float]]]  # name, colour, and values


@styled
def draw(found: Found) -> dict[str, Figure]:
    """Return the drawings of all parts that were measured, by name."""
    drawings = {"figure9": figure_9, "information-window": windows, "capacity": capacity}
    made = {name: of(found) for name, of in drawings.items()}
    return {name: figure for name, figure in made.items() if figure is not None}


def figure_9(found: Found) -> Figure | None:
    """Draw figure 9 of the paper beside ours, and the corrections of its information."""
    mean = {
        name: results.value(found, name, "histogram", "mean")
        for name in results.sets_with(found, "histogram")
    }
    if not mean:
        return None
    figure, axes = panels(1100, 440, 2, width_ratios=[1.35, 1])
    left, right = axes[0]

    def ours(keys: Sequence[str]) -> Series:
        return [
            (name, colour, [mean[name][key] for key in keys])
            for colour, name in zip(SERIES, mean, strict=False)
        ]

    theirs = ("the paper, its “bits” read as nats", INK, [paper for _, paper, _ in PRINTED])
    _bars(left, [words for words, _, _ in PRINTED], [theirs, *ours([key for *_, key in PRINTED])])
    left.set_title("section 6 as printed: 25 bins, scaled by gesture")
    left.legend(loc="upper left")
    _bars(right, list(CORRECTED), ours(list(CORRECTED.values())))
    right.set_title("information of a sensor, I(z; y), corrected")
    right.legend(loc="upper right")
    right.axhline(PAPER_INFORMATION, color=INK, lw=1.0, ls=":")
    above(right, len(CORRECTED) - 0.8, PAPER_INFORMATION, "the paper")
    return figure


def _bars(axes: Axes, words: Sequence[str], series: Series) -> None:
    """Draw groups of bars in nats, with bits on the right, and the value on each."""
    width = 0.8 / len(series)
    for number, (name, colour, values) in enumerate(series):
        at = np.arange(len(values)) + (number - (len(series) - 1) / 2) * width
        axes.bar(at, values, width * 0.94, color=colour, label=name)
        for x, value in zip(at, values, strict=True):
            digits = 0 if value < 0.005 else 3 if value < 0.2 else 2
            above(axes, x, value, f"{value:.{digits}f}", colour)
    axes.set_xticks(np.arange(len(words)), words, fontsize=10)
    axes.set_ylabel("nats")
    axes.set_ylim(0, 1.14 * max(max(values) for _, _, values in series))
    bits = axes.secondary_yaxis("right", functions=(lambda v: v * BITS, lambda v: v / BITS))
    bits.set_ylabel("bits")


def windows(found: Found) -> Figure | None:
    """Draw all estimates of the information of a window about its label."""
    names = results.sets_with(found, "classifier")
    if not names:
        return None
    figure, every = panels(550 * len(names), 440, len(names), sharey=True)
    known = [
        (words, path, bound)
        for words, path, bound in ESTIMATES
        if any(results.value(found, name, *path) for name in names)
    ]
    for axes, colour, name in zip(every[0], SERIES, names, strict=False):
        ceiling = results.value(found, name, "classifier", "h_y") * BITS
        for y, (_, path, bound) in enumerate(known):
            if interval := results.value(found, name, *path):
                middle, low, high = (one * BITS for one in interval)
                axes.plot([low, high], [y, y], color=colour, lw=2.5, alpha=0.35)
                axes.plot(middle, y, ">" if bound else "o", color=colour, ms=7)
                above(axes, middle, y - 0.15, f"{middle:.2f}", colour)
        axes.axvline(ceiling, ymax=0.92, color=INK, lw=1.0, ls=":")
        above(axes, ceiling, -0.75, f"entropy H(y): {ceiling:.2f}")
        axes.set_yticks(range(len(known)), [words for words, _, _ in known])
        axes.set_xlim(0, 1.2 * ceiling)
        axes.set_ylim(len(known) - 0.5, -1.2)
        axes.set_xlabel("bits about the label")
        axes.set_title(name)
        axes.grid(axis="x")
        axes.grid(visible=False, axis="y")
    figure.supxlabel("▸ lower bound, on another day    ● estimate", fontsize=11)
    return figure


def capacity(found: Found) -> Figure | None:
    """Draw bits per minute of play, and the channels of larger vocabularies."""
    players, vocabularies = found["games"], results.vocabularies(found)
    count = bool(players) + 2 * bool(vocabularies)
    if not count:
        return None
    figure, axes = panels(400 * count, 420, count)
    if players:
        _players(axes[0, 0], players)
    if vocabularies:
        _vocabularies(axes[0, -2], axes[0, -1], vocabularies)
    return figure


def _players(axes: Axes, players: Mapping[str, Any]) -> None:
    """Draw bits per minute as played and with the fastest use."""
    words = []
    for number, (name, one) in enumerate(players.items()):
        colour = SERIES[number % len(SERIES)] if name != "keyboard" else DIM
        for shift, key, strength in ((-0.2, "played_per_min", 1.0), (0.2, "fastest_per_min", 0.5)):
            axes.bar(number + shift, one[key] * BITS, 0.37, color=colour, alpha=strength)
            above(axes, number + shift, one[key] * BITS, f"{one[key] * BITS:.0f}")
        of_one = f"{one['played'][0] * BITS:.2f} bits\nin {one['mean_s']:.2f} s"
        words.append(f"{'orb, ' if name in PRESETS else ''}{name}\n{of_one}")
    axes.set_xticks(range(len(players)), words, fontsize=10)
    axes.set_xlabel("dark: as the bot plays Tetris; light: commands chosen for speed", fontsize=10)
    axes.set_ylabel("bits per minute")
    axes.set_title("six commands, as played")


def _vocabularies(left: Axes, right: Axes, by_set: Mapping[str, Mapping[int, Any]]) -> None:
    """Draw bits per gesture and per minute by the number of gestures."""
    sizes = sorted({size for own in by_set.values() for size in own})
    left.plot(sizes, np.log2(sizes), ":", color=INK, lw=1.2, label="none confused")
    for colour, (name, own) in zip(SERIES, by_set.items(), strict=False):
        x = sorted(own)
        for axes, key in ((left, "capacity"), (right, "fastest_per_min")):
            y = [own[size][key] * BITS for size in x]
            axes.plot(x, y, color=colour, marker="o", ms=4, label=name)
    labels = max((one["labels"] for own in by_set.values() for one in own.values()), key=len)
    first = ",\n".join(labels[:2])
    words = [f"{size}\n{first if size == 2 else labels[size - 1]}" for size in sizes]
    for axes, title, unit in (
        (left, "a larger vocabulary, gesture by gesture", "bits per gesture"),
        (right, "the same, minute by minute", "bits per minute, fastest use"),
    ):
        axes.set_xticks(sizes, [one.replace("_", "\n") for one in words], fontsize=10)
        axes.set_xlabel("gestures, one more each time")
        axes.set_ylabel(unit)
        axes.set_title(title)
        axes.set_ylim(bottom=0)
        axes.legend()
