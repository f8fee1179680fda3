"""Files of an information study: its drawings and its tables; each drawing is clear by itself."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from controller.simulator.orb import PRESETS
from models.reports.drawing import DIM, INK, RANDOM, SERIES, UNSEEN, above, panels, save, styled
from models.results import storage
from models.studies.information.histogram import BITS, PAPER_H_Y, PAPER_H_Z, PAPER_INFORMATION
from models.studies.information.tables import UNIFORM, part, text, vocabularies

PAGE: Final = "information.md"
# Groups of bars: words, the paper's figure in nats, and key of ours.
BARS: Final = (
    ("labels, if equally\nfrequent", UNIFORM, "h_uniform"),
    ("labels, H(y)", PAPER_H_Y, "h_y"),
    ("a sensor’s signal,\nH(z)", PAPER_H_Z, "h_z"),
    ("information about\nthe label, I(z; y)", PAPER_INFORMATION, "information"),
    ("one scaling,\nbias removed", np.nan, "information_corrected"),
    ("labels shifted\nin time", np.nan, "null_slow"),
)
COLOURS: Final = (UNSEEN, RANDOM, *SERIES[1:])  # of several sets in one drawing

Found = Mapping[str, Any]


def write(folder: Path, found: Found) -> list[Path]:
    """Write the tables as Markdown and the drawings as SVG, and return their paths."""
    paths = [save(figure, folder / f"{name}.svg") for name, figure in draw(found).items()]
    storage.write_text(folder / PAGE, f"{text(found)}\n")
    return [*paths, folder / PAGE]


@styled
def draw(found: Found) -> dict[str, Figure]:
    """Return the drawings of all parts that were measured, by name."""
    drawings = {"figure9": figure_9, "information-window": windows, "capacity": capacity}
    made = {name: of(found) for name, of in drawings.items()}
    return {name: figure for name, figure in made.items() if figure is not None}


def figure_9(found: Found) -> Figure | None:
    """Draw figure 9 of the paper beside ours, and its information made sound; in nats and bits."""
    of = part(found, "histogram")
    if not of:
        return None
    figure, ((axes,),) = panels(1100, 440, 1)
    series = [("the paper, its “bits” read as nats", INK, [paper for _, paper, _ in BARS])]
    series += [
        (name, colour, [own[key] for *_, key in BARS])
        for colour, (name, own) in zip(COLOURS, of.items(), strict=False)
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


def windows(found: Found) -> Figure | None:
    """Draw all estimates of the information of a window about its label."""
    of, near = part(found, "classifier"), part(found, "neighbours")
    if not of:
        return None
    figure, every = panels(550 * len(of), 440, len(of), sharey=True)
    for axes, colour, (name, own) in zip(every[0], COLOURS, of.items(), strict=False):
        estimates = near.get(name, {"rows": {}})["rows"]
        bounds = {words: row["window"] for words, row in own["rows"].items()}
        ceiling = own["h_y"] * BITS
        for y, (words, interval) in enumerate({**estimates, **bounds}.items()):
            middle, low, high = (one * BITS for one in interval)
            axes.plot([low, high], [y, y], color=colour, lw=2.5, alpha=0.35)
            axes.plot(middle, y, ">" if words in bounds else "o", color=colour, ms=7)
            above(axes, middle, y - 0.15, f"{middle:.2f}", colour)
        axes.axvline(ceiling, ymax=0.92, color=INK, lw=1.0, ls=":")
        above(axes, ceiling, -0.75, f"entropy H(y): {ceiling:.2f}")
        axes.set_yticks(range(len(estimates) + len(bounds)), [*estimates, *bounds])
        axes.set_xlim(0, 1.2 * ceiling)
        axes.set_ylim(len(estimates) + len(bounds) - 0.5, -1.2)
        axes.set_xlabel("bits about the label")
        axes.set_title(name)
        axes.grid(axis="x")
        axes.grid(visible=False, axis="y")
    figure.supxlabel("▸ lower bound, on another day    ● estimate", fontsize=11)
    return figure


def capacity(found: Found) -> Figure | None:
    """Draw bits per minute of play, and bits per gesture of larger vocabularies."""
    players, sized = found["games"], vocabularies(found)
    count = bool(players) + bool(sized)
    if not count:
        return None
    figure, axes = panels(550 * count, 420, count)
    if players:
        _players(axes[0, 0], players)
    if sized:
        _vocabularies(axes[0, -1], sized)
    return figure


def _players(axes: Axes, players: Mapping[str, Any]) -> None:
    """Draw bits per minute as played and with the fastest use."""
    words = []
    for number, (name, one) in enumerate(players.items()):
        colour = COLOURS[number % len(COLOURS)] if name != "keyboard" else DIM
        for shift, key, strength in ((-0.2, "played_per_min", 1.0), (0.2, "fastest_per_min", 0.5)):
            axes.bar(number + shift, one[key] * BITS, 0.37, color=colour, alpha=strength)
            above(axes, number + shift, one[key] * BITS, f"{one[key] * BITS:.0f}")
        of_one = f"{one['played'][0] * BITS:.2f} bits\nin {one['mean_s']:.2f} s"
        words.append(f"{'orb, ' if name in PRESETS else ''}{name}\n{of_one}")
    axes.set_xticks(range(len(players)), words, fontsize=10)
    axes.set_xlabel("dark: as the bot plays Tetris; light: commands chosen for speed", fontsize=10)
    axes.set_ylabel("bits per minute")
    axes.set_title("six commands, as played")


def _vocabularies(axes: Axes, sized: Mapping[int, Mapping[str, Any]]) -> None:
    """Draw bits per gesture by the number of gestures."""
    axes.plot(list(sized), np.log2(list(sized)), ":", color=INK, lw=1.2, label="none confused")
    names: Sequence[str] = list(dict.fromkeys(name for own in sized.values() for name in own))
    for colour, name in zip(COLOURS, names, strict=False):
        own = {size: of[name]["capacity"] * BITS for size, of in sized.items() if name in of}
        axes.plot(list(own), list(own.values()), color=colour, marker="o", ms=4, label=name)
    labels = max((one["labels"] for of in sized.values() for one in of.values()), key=len)
    words = [f"{size}\n{labels[size - 1]}".replace("_", "\n") for size in sized]
    axes.set_xticks(list(sized), words, fontsize=10)
    axes.set_xlabel("gestures, one more each time")
    axes.set_ylabel("bits per gesture")
    axes.set_title("a larger vocabulary")
    axes.set_ylim(bottom=0)
    axes.legend()
