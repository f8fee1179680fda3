"""The figures of an information report, as SVG and PNG; each is clear without its caption."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

from controller.simulator.presets import PRESETS
from models.studies.figure7.drawing import BLUE, CORAL, DIM, INK, LINE, STYLE, save
from models.studies.information import scaling
from models.studies.information.histogram import BITS, PAPER_H_Y, PAPER_H_Z, PAPER_INFORMATION
from models.studies.information.results import of_set, sets_of
from models.studies.information.tables import CLASSIFIERS, UNIFORM, sizes_of

GREEN: Final = "#1b7f4b"
COLOURS: Final = (BLUE, CORAL, GREEN, "#7a4fb5", "#96640a")
DOTS_PER_INCH: Final = 130

Found = Mapping[str, Any]


def draw(found: Found, folder: Path) -> list[Path]:
    """Draw what there is; return the SVG files."""
    made = {
        "figure9": figure_9,
        "information-bins": bins,
        "information-window": windows,
        "information-growth": grown,
        "capacity": capacity,
    }
    paths = []
    with mpl.rc_context(STYLE):
        for name, of in made.items():
            figure = of(found)
            if figure is None:
                continue
            path = folder / f"{name}.svg"
            save(figure, path, metadata={"Date": None})
            save(figure, path.with_suffix(".png"), dpi=DOTS_PER_INCH)
            plt.close(figure)
            paths.append(path)
    return paths


def figure_9(found: Found) -> Figure | None:
    """Figure 9 of the paper beside ours, and what becomes of its information."""
    names = _with(found, "histogram")
    if not names:
        return None
    mean = {name: of_set(found, name, "histogram")["mean"] for name in names}
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(11.6, 4.6), gridspec_kw={"width_ratios": [1.35, 1]}
    )
    groups = (
        ("labels, if all were\nas frequent", UNIFORM, "h_uniform"),
        ("labels, H(y)", PAPER_H_Y, "h_y"),
        ("a sensor’s signal,\nH(z)", PAPER_H_Z, "h_z"),
        ("what it says about\nthe label, I(z; y)", PAPER_INFORMATION, "information"),
    )
    series = [("the paper, its “bits” read as nats", INK, [paper for _, paper, _ in groups])]
    for colour, name in zip(COLOURS, names, strict=False):
        series.append((name, colour, [mean[name][key] for _, _, key in groups]))
    _bars(left, [words for words, _, _ in groups], series)
    left.set_title("section 6 as printed: 25 bins, scaled by gesture")
    steps = (
        ("scaled by\ngesture", "information"),
        ("one scaling\nfor all", "information_global"),
        ("bias\ntaken off", "information_corrected"),
        ("labels at\nwrong times", "null_slow"),
        ("labels\nshuffled", "null"),
    )
    series = [
        (name, colour, [mean[name][key] for _, key in steps])
        for colour, name in zip(COLOURS, names, strict=False)
    ]
    _bars(right, [words for words, _ in steps], series, "upper right")
    right.axhline(PAPER_INFORMATION, color=INK, lw=1.0, ls=":")
    right.annotate("the paper", (1.0, PAPER_INFORMATION), xycoords=("axes fraction", "data"),
                   xytext=(-2, 1), textcoords="offset points", ha="right", va="bottom", fontsize=8,
                   color=INK)  # fmt: skip
    right.set_title("what a sensor says, I(z; y), made sound")
    figure.tight_layout(w_pad=2.5)
    return figure


def _bars(
    axes: Axes,
    words: Sequence[str],
    series: Sequence[tuple[str, str, Sequence[float]]],
    place: Literal["upper left", "upper right"] = "upper left",
) -> None:
    """Draw groups of bars in nats, with bits on the right, and the value on each."""
    width = 0.8 / len(series)
    for number, (name, colour, values) in enumerate(series):
        at = np.arange(len(values)) + (number - (len(series) - 1) / 2) * width
        axes.bar(at, values, width * 0.94, color=colour, label=name)
        for x, value in zip(at, values, strict=True):
            axes.annotate(_short(value), (x, value),
                          xytext=(0, 2), textcoords="offset points", ha="center", fontsize=7.5,
                          color=colour)  # fmt: skip
    axes.set_xticks(np.arange(len(words)), words, fontsize=8, color=INK)
    axes.set_ylabel("nats")
    axes.set_ylim(0, 1.14 * max(max(values) for _, _, values in series))
    bits = axes.secondary_yaxis("right", functions=(lambda v: v * BITS, lambda v: v / BITS))
    bits.set_ylabel("bits")
    axes.grid(axis="y", color=LINE, lw=0.6)
    axes.set_axisbelow(True)
    axes.legend(frameon=False, fontsize=8.5, loc=place)


def bins(found: Found) -> Figure | None:
    """What the histogram says by the number of its bins."""
    names = _with(found, "histogram")
    if not names:
        return None
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.0))
    for colour, name in zip(COLOURS, names, strict=False):
        rows = of_set(found, name, "histogram")["bins"]
        x = [row["bins"] for row in rows]

        def of(key: str, rows: Any = rows) -> list[float]:
            return [row[key] * BITS for row in rows]

        left.plot(x, of("h_z"), color=colour, lw=1.8)
        _end(left, x[-1], of("h_z")[-1], name, colour)
        right.plot(x, of("information"), "--", color=colour, lw=1.2)
        right.plot(x, of("corrected"), color=colour, lw=1.8)
        right.plot(x, of("null"), ":", color=colour, lw=1.4)
        _end(right, x[-1], of("corrected")[-1], name, colour)
    left.set_title("a sensor’s entropy H(z): only how fine the bins are")
    right.set_title("what it says about the label, I(z; y)")
    right.annotate(
        "dashed: as counted\nsolid: bias taken off\ndotted: labels shuffled",
        (0.02, 0.97), xycoords="axes fraction", va="top", fontsize=8, color=DIM,
    )  # fmt: skip
    for axes in (left, right):
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(FixedLocator(x))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("bins")
        axes.set_ylabel("bits, mean of the sensors")
        axes.axvline(25, color=LINE, lw=1.0)
        axes.set_ylim(bottom=0)
        axes.grid(axis="y", color=LINE, lw=0.6)
    right.set_ylim(top=right.get_ylim()[1] * 1.3)
    figure.tight_layout(w_pad=3.0)
    return figure


def windows(found: Found) -> Figure | None:
    """All estimates of what a window says about its label."""
    names = _with(found, "classifier")
    if not names:
        return None
    figure, many = plt.subplots(
        1, len(names), figsize=(5.8 * len(names), 4.6), sharey=True, squeeze=False
    )
    for axes, colour, name in zip(many[0], COLOURS, names, strict=False):
        rows = _estimates(found, name)
        ceiling = of_set(found, name, "classifier")["h_y"] * BITS
        for y, (_, figure_, bound) in enumerate(rows):
            value, low, high = (one * BITS for one in figure_)
            axes.plot([low, high], [y, y], color=colour, lw=2.5, alpha=0.35)
            axes.plot(value, y, ">" if bound else "o", color=colour, ms=7)
            axes.annotate(f"{value:.2f}", (value, y), xytext=(0, 7), textcoords="offset points",
                          ha="center", fontsize=8, color=colour)  # fmt: skip
        axes.axvline(ceiling, color=INK, lw=1.0, ls=":")
        axes.annotate(f"H(y), all there is: {ceiling:.2f}", (ceiling, len(rows) - 0.6),
                      xytext=(3, 0), textcoords="offset points", rotation=90, ha="left",
                      va="bottom", fontsize=8, color=INK)  # fmt: skip
        axes.set_yticks(range(len(rows)), [words for words, _, _ in rows], color=INK)
        axes.set_xlim(0, 1.1 * ceiling)
        axes.set_ylim(len(rows) - 0.5, -0.7)
        axes.set_xlabel("bits about the label")
        axes.set_title(name)
        axes.grid(axis="x", color=LINE, lw=0.6)
    many[0][0].annotate("▸ at least so much, on another day    ● estimate", (0, -0.2),
                        xycoords="axes fraction", fontsize=8, color=DIM)  # fmt: skip
    figure.tight_layout()
    return figure


def _estimates(found: Found, name: str) -> list[tuple[str, Sequence[float], bool]]:
    """Return words, figure, and whether it is a bound."""
    rows: list[tuple[str, Sequence[float], bool]] = []
    near = of_set(found, name, "neighbours")
    for key, words in (
        ("image", "one image, neighbours"),
        ("3 components", "window, 3 components, neighbours"),
        ("20 components", "window, 20 components, neighbours"),
    ):
        if near and key in near["rows"]:
            rows.append((words, near["rows"][key]["apart"], False))
    if near and "days" in near["rows"].get("20 components", {}):
        rows.append(("the same, neighbours of other days", near["rows"]["20 components"]["days"],
                     False))  # fmt: skip
    if apart := of_set(found, name, "contrast"):
        rows.append(("InfoNCE", apart["found"], True))
    own = of_set(found, name, "classifier")["rows"]
    short = {
        "linear, rest followed": "linear classifier",
        "mlp, rest first": "two layers, the paper’s rest",
        "mlp, rest followed": "two layers",
        "the bundle that ships": "the bundle that ships",
    }
    for key, _ in CLASSIFIERS:
        if key in own and key in short:
            rows.append((short[key], own[key]["scaled"], True))
    return rows


def grown(found: Found) -> Figure | None:
    """How information grows, a panel for each kind."""
    kinds = [kind for kind in scaling.KINDS if _with(found, f"growth {kind}")]
    if not kinds:
        return None
    titles = {
        "taxels": "taxels", "window": "length of the window, s", "rate": "rate, Hz",
        "bits": "bits of the converter",
    }  # fmt: skip
    figure, many = plt.subplots(
        1, len(kinds), figsize=(3.3 * len(kinds) + 0.9, 3.9), sharey=True, squeeze=False
    )
    for axes, kind in zip(many[0], kinds, strict=True):
        for colour, name in zip(COLOURS, _with(found, f"growth {kind}"), strict=False):
            rows = of_set(found, name, f"growth {kind}")
            x = [row["value"] for row in rows]
            for what, dash in (("gesture", "-"), ("window", "--")):
                value, low, high = BITS * np.array([row[what] for row in rows]).T
                axes.fill_between(x, low, high, color=colour, alpha=0.1, lw=0)
                axes.plot(x, value, dash, color=colour, lw=1.8, marker="o", ms=3.5)
                if kind == kinds[-1]:
                    _end(axes, x[-1], float(value[-1]), f"{name}, {what}", colour)
        if kind != "bits":
            axes.set_xscale("log")
        axes.xaxis.set_major_locator(FixedLocator(x))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel(titles[kind])
        axes.grid(axis="y", color=LINE, lw=0.6)
    many[0][0].set_ylabel("bits, at least, on another day")
    many[0][0].set_ylim(bottom=0)
    figure.tight_layout()
    return figure


def capacity(found: Found) -> Figure | None:
    """Bits per minute of play, and what a larger vocabulary is worth."""
    players, sizes = found["games"], sizes_of(found)
    if not (players or sizes):
        return None
    figure, many = plt.subplots(
        1, bool(players) + 2 * bool(sizes), figsize=(4.1 * (bool(players) + 2 * bool(sizes)), 4.3),
        squeeze=False,
    )  # fmt: skip
    panels = list(many[0])
    if players:
        _players(panels.pop(0), players)
    if sizes:
        _vocabularies(panels[0], panels[1], sizes)
    figure.tight_layout(w_pad=2.0)
    return figure


def _players(axes: Axes, players: Mapping[str, Any]) -> None:
    """Draw bits per minute as played and with the fastest use."""
    for number, (name, one) in enumerate(players.items()):
        colour = COLOURS[number % len(COLOURS)] if name != "keyboard" else DIM
        for shift, key, strength in ((-0.2, "played_per_min", 1.0), (0.2, "fastest_per_min", 0.5)):
            value = one[key] * BITS
            axes.bar(number + shift, value, 0.37, color=colour, alpha=strength)
            axes.annotate(f"{value:.0f}", (number + shift, value), xytext=(0, 2),
                          textcoords="offset points", ha="center", fontsize=8.5)  # fmt: skip
    words = [
        f"{'orb, ' if name in PRESETS else ''}{name}\n"
        f"{one['played'][0] * BITS:.2f} bits\nin {one['mean_s']:.2f} s"
        for name, one in players.items()
    ]
    axes.set_xticks(range(len(players)), words, fontsize=8.5, color=INK)
    axes.annotate("dark: as the bot plays Tetris\nlight: commands chosen for speed", (0.02, 0.98),
                  xycoords="axes fraction", va="top", fontsize=8, color=DIM)  # fmt: skip
    axes.set_ylim(top=axes.get_ylim()[1] * 1.1)
    axes.set_ylabel("bits per minute")
    axes.set_title("six commands, as played")
    axes.grid(axis="y", color=LINE, lw=0.6)
    axes.set_axisbelow(True)


def _vocabularies(left: Axes, right: Axes, sizes: Mapping[str, Mapping[int, Any]]) -> None:
    """Draw bits per gesture and per minute by the number of gestures."""
    every = sorted({size for own in sizes.values() for size in own})
    left.plot(every, np.log2(every), ":", color=INK, lw=1.2)
    _end(left, every[-1], float(np.log2(every[-1])), "none confused", INK)
    for colour, (name, own) in zip(COLOURS, sizes.items(), strict=False):
        x = sorted(own)
        gesture = [own[size]["capacity"] * BITS for size in x]
        minute = [own[size]["fastest_per_min"] * BITS for size in x]
        left.plot(x, gesture, color=colour, lw=1.8, marker="o", ms=4)
        right.plot(x, minute, color=colour, lw=1.8, marker="o", ms=4)
        _end(left, x[-1], gesture[-1], name, colour)
        _end(right, x[-1], minute[-1], name, colour)
    labels = max((one["labels"] for own in sizes.values() for one in own.values()), key=len)
    words = [
        f"{size}\n" + (",\n".join(labels[:2]) if size == 2 else labels[size - 1]) for size in every
    ]
    words = [one.replace("_", "\n") for one in words]
    for axes, title, unit in (
        (left, "a larger vocabulary, gesture by gesture", "bits per gesture"),
        (right, "the same, minute by minute", "bits per minute, fastest use"),
    ):
        axes.set_xticks(every, words, fontsize=7.5, color=INK)
        axes.set_xlabel("gestures, one more each time")
        axes.set_ylabel(unit)
        axes.set_title(title)
        axes.set_ylim(bottom=0)
        axes.grid(axis="y", color=LINE, lw=0.6)


def _end(axes: Axes, x: float, y: float, words: str, colour: str) -> None:
    """Write beside the end of a line."""
    axes.annotate(words, (x, y), xytext=(6, 0), textcoords="offset points", color=colour,
                  va="center", fontsize=8, annotation_clip=False)  # fmt: skip


def _with(found: Found, part: str) -> list[str]:
    return [name for name in sets_of(found) if of_set(found, name, part)]


def _short(nats: float) -> str:
    """Return a value above its bar: three digits of what is small."""
    if nats < 0.005:
        return "0"
    return f"{nats:.3f}" if nats < 0.2 else f"{nats:.2f}"
