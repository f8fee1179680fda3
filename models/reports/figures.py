"""Figures of reports: matplotlib drawings as SVG inside the page, in the page's colours.

`styled`, `new` and `svg` serve every report: draw on the axes in the colours below, and the drawing
follows the page into dark mode, since the style sheet's variables take the place of the colours.
"""

import io
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from models.formatting import number, percent
from models.results.evaluation import Point, Tuning
from models.results.training import Epoch, Honesty, SessionRow

# Variables of style.css and their values on light paper.
COLOURS: Final = {
    "ink": "#1e2535", "dim": "#5d6880", "line": "#dfe3ec", "panel": "#f5f7fb", "paper": "#ffffff",
    "unseen": "#1f6fd0", "random": "#c2510f", "train": "#7b869c", "good": "#1b7f4b",
    "doubtful": "#96640a", "violet": "#8a3fb0", "pink": "#b8336a", "teal": "#0f7f8c",
}  # fmt: skip
INK, DIM, LINE, PANEL, PAPER = (COLOURS[it] for it in ("ink", "dim", "line", "panel", "paper"))
UNSEEN, RANDOM, TRAIN = (COLOURS[it] for it in ("unseen", "random", "train"))
# Of many lines in one drawing.
SERIES: Final = tuple(
    COLOURS[it] for it in ("unseen", "good", "violet", "doubtful", "pink", "teal", "random")
)
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
    "xtick.color": DIM,
    "xtick.major.size": 0,
    "xtick.minor.size": 0,
    "ytick.color": DIM,
    "ytick.major.size": 0,
    "ytick.minor.size": 0,
}
PIXELS_PER_INCH: Final = 72  # one pixel of the page is one point of the drawing
SESSIONS_SHOWN: Final = 30  # in the drawing of label lateness; of more, evenly spread ones
ARROWS_SHOWN: Final = 350  # on a map of touches
MAP_PX: Final = 330.0

Touch = tuple[float, float, float, float]  # x, y, error in x, error in y, grid units
Grid = tuple[int, int]  # rows and columns of the sensor


# Decorator of functions that draw.
styled: Final = mpl.rc_context(STYLE)


def new(width: float, height: float) -> tuple[Figure, Axes]:
    """Return an empty drawing of a size in pixels, and its axes."""
    size = (width / PIXELS_PER_INCH, height / PIXELS_PER_INCH)
    figure = Figure(figsize=size, dpi=PIXELS_PER_INCH, layout="constrained")
    return figure, figure.add_subplot()


def svg(figure: Figure, alternative: str) -> Markup:
    """Return a drawing as an SVG element in the colours of the page.

    Args:
        figure: Drawn in `COLOURS`.
        alternative: Its content, for screen readers.
    """
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    width, height = figure.get_size_inches() * PIXELS_PER_INCH
    _, _, inside = buffer.getvalue().partition("<svg ")[2].partition(">")
    inside = re.sub(r"<metadata>.*?</metadata>|<defs>\s*<style.*?</defs>", "", inside, flags=re.S)
    inside = re.sub(r' id="[A-Za-z.]+\d*_\d+"|font-family: [^;"]*;? ?', "", inside)
    inside = re.sub(r"\s+", " ", inside).replace("xlink:href", "href")
    for name, colour in COLOURS.items():
        inside = inside.replace(colour, f"var(--{name})")
    return Markup(  # the texts inside were escaped by matplotlib
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
        f'style="max-width:{width:.0f}px" aria-label="{escape(alternative)}">{inside}'
    )


def limits(
    values: Iterable[float], *, least: float = 0.0, room: float = 0.06
) -> tuple[float, float]:
    """Return the limits of an axis around all finite values.

    Args:
        values: Values to show.
        least: Smallest length of the axis.
        room: Left at either end, as a share of the length.
    """
    known = [value for value in values if math.isfinite(value)] or [0.0, 1.0]
    low, high = min(known), max(known)
    spare = max(least - (high - low), 0.0) / 2.0 + room * max(high - low, least)
    return low - spare, high + spare


@styled
def curves(epochs: Sequence[Epoch], best: int, *, share: bool) -> Markup:
    """Return the score over the epochs: on training examples, on random windows, and unseen.

    Args:
        epochs: The curve.
        best: Number of the epoch that was kept.
        share: Scores are shares; else errors in grid units.
    """
    every = [value for e in epochs for value in (e.train, e.check, e.random)]
    early = [value for e in epochs[: max(1, len(epochs) // 20)] for value in (e.train, e.check)]
    low, high = limits([v for v in every if v not in early] or every, least=0.04)
    figure, axes = _over_epochs(epochs, best, "right windows" if share else "error, grid units")
    numbers = [e.number for e in epochs]
    axes.plot(numbers, [e.random for e in epochs], "--", color=RANDOM, label="at random")
    axes.plot(numbers, [e.train for e in epochs], color=TRAIN, lw=1.5, label="learned")
    axes.plot(numbers, [e.check for e in epochs], color=UNSEEN, label="unseen")
    axes.plot([best], [epochs[best - 1].check], "o", color=UNSEEN, mec=PAPER, ms=9)
    axes.set_ylim(max(0.0, low), min(1.0, high))
    axes.yaxis.set_major_formatter(_percents if share else _plain)
    axes.legend()
    return svg(figure, "score over the epochs, on what was learned, at random and unseen")


@styled
def losses(epochs: Sequence[Epoch], best: int) -> Markup:
    """Return the loss over the epochs, on training examples and unseen."""
    figure, axes = _over_epochs(epochs, best, "loss")
    numbers = [e.number for e in epochs]
    axes.plot(numbers, [e.loss for e in epochs], color=TRAIN, lw=1.5, label="learned")
    axes.plot(numbers, [e.check_loss for e in epochs], color=UNSEEN, label="unseen")
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(10, (1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(_plain)
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.legend()
    return svg(figure, "loss over the epochs, on what was learned and unseen")


def _over_epochs(epochs: Sequence[Epoch], best: int, title: str) -> tuple[Figure, Axes]:
    figure, axes = new(470, 290)
    axes.set_title(title)
    axes.set_xlabel("epoch")
    axes.set_xlim(1, max(2, len(epochs)))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    axes.axvline(best, color=DIM, lw=1, ls=":")
    axes.annotate("kept", (best, 1), xycoords=("data", "axes fraction"), xytext=(0, 3),
                  textcoords="offset points", ha="center", color=DIM)  # fmt: skip
    return figure, axes


@styled
def gap(honest: Honesty, *, share: bool) -> Markup:
    """Return the score on unseen sessions above that of the paper's protocol."""
    known = [honest.unseen, honest.random, honest.low, honest.high]
    low, high = limits(known, least=0.08 if share else 0.05, room=0.25)
    figure, axes = new(560, 150)
    rows = ((1, honest.unseen, "sessions never seen", UNSEEN),
            (0, honest.random, "windows at random", RANDOM))  # fmt: skip
    if math.isfinite(honest.low):
        axes.plot([honest.low, honest.high], [1, 1], color=UNSEEN, lw=4, alpha=0.45)
    for row, value, _, colour in rows:
        axes.plot([value], [row], "o", color=colour, mec=PAPER, ms=13)
        if math.isfinite(value):
            said = percent(value) if share else number(value)
            axes.annotate(said, (value, row), xytext=(0, 10), textcoords="offset points",
                          ha="center", weight="bold", color=colour)  # fmt: skip
    axes.set_xlim(max(0.0, low), min(high, 1.0) if share else high)
    axes.set_ylim(-0.6, 1.9)
    axes.grid(axis="x")
    axes.grid(visible=False, axis="y")
    axes.xaxis.set_major_formatter(_percents if share else _plain)
    axes.set_yticks([row for row, *_ in rows], [name for _, _, name, _ in rows], weight="bold")
    for tick, (*_, colour) in zip(axes.get_yticklabels(), rows, strict=True):
        tick.set_color(colour)
    return svg(figure, "the score on unseen sessions and on windows at random")


@styled
def reliability(bins: Sequence[tuple[float, float, int]]) -> Markup:
    """Return the share of right answers over the probability given, (confidence, right, count)."""
    figure, axes = new(360, 320)
    axes.plot([0, 1], [0, 1], "--", color=DIM, lw=1)
    sure, right, amounts = np.array(bins, dtype=np.float64).reshape(-1, 3).T
    axes.plot(sure, right, color=UNSEEN, lw=1.4)
    sizes = (2 * (3.0 + 7.0 * np.sqrt(amounts / max(amounts, default=1)))) ** 2
    axes.scatter(sure, right, sizes, color=UNSEEN, edgecolors=PAPER, zorder=3)
    axes.set_xlim(-0.03, 1.03)
    axes.set_ylim(-0.03, 1.03)
    axes.set_title("how often it was right")
    axes.set_xlabel("how sure it was")
    axes.xaxis.set_major_formatter(_percents)
    axes.yaxis.set_major_formatter(_percents)
    return svg(figure, "share of right answers over the probability that was given")


@styled
def examples_curve(curve: Sequence[tuple[float, float]]) -> Markup:
    """Return a small drawing of errors over the number of examples; "" of fewer than two."""
    if len(curve) < 2:
        return Markup("")
    figure, axes = new(96, 28)
    examples, errors = zip(*curve, strict=True)
    axes.plot(examples, errors, "o-", color=UNSEEN, lw=1.4, ms=4, clip_on=False)
    axes.set_xlim(0, examples[-1])
    axes.set_ylim(0, max(0.05, *errors))
    axes.set_xticks([])
    axes.set_yticks([])
    return svg(figure, f"errors fall from {percent(errors[0])} to {percent(errors[-1])}")


@styled
def label_lateness(rows: Sequence[SessionRow]) -> Markup:
    """Return the labels' lateness in each session: the median, its spread, and the truth."""
    known = [row for row in rows if row.lateness is not None]
    known = known[:: max(1, -(-len(known) // SESSIONS_SHOWN))]
    figure, axes = new(640, 74 + 34 * len(known))
    for place, row in enumerate(known):
        late = row.lateness
        assert late is not None
        for offset, colour, value, spread, truth in (
            (-0.16, UNSEEN, late.begin_s, late.begin_spread_s, late.true_begin_s),
            (0.16, RANDOM, late.end_s, late.end_spread_s, late.true_end_s),
        ):
            at, y = 1000 * value, place + offset
            half = 500 * spread
            axes.plot([at - half, at + half], [y, y], color=colour, lw=4, alpha=0.45)
            axes.plot([at], [y], "o", color=colour, mec=PAPER, ms=9)
            axes.plot([1000 * truth], [y], "|", color=INK, ms=12, mew=2)
    axes.axvline(0, color=DIM, lw=1)
    axes.set_ylim(len(known) - 0.5, -0.5)
    axes.set_yticks(range(len(known)), [_session(row) for row in known])
    low, high = axes.get_xlim()
    axes.set_xlim(limits([low, high, 0.0], least=100.0, room=0.0))
    axes.grid(axis="x")
    axes.grid(visible=False, axis="y")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:+.0f}"))
    axes.set_xlabel("milliseconds after the touch (left of 0: too early)")
    return svg(figure, "how late labels were, session by session")


def _session(row: SessionRow) -> str:
    if row.user or row.session:
        named = (("user", row.user), ("session", row.session))
        return ", ".join(f"{what} {name}" for what, name in named if name)
    return row.path.rpartition("/")[2].removesuffix(".npz")


@styled
def touch_errors(touches: Sequence[Touch], grid: Grid) -> Markup:
    """Return a map of touches: where each was, and a line to where it was estimated."""
    figure, axes = _map(grid)
    rows, columns = grid
    sites = np.stack(np.meshgrid(range(columns), range(rows)), axis=-1).reshape(-1, 2)
    axes.scatter(*sites.T, 300, facecolors="none", edgecolors=LINE)
    at = _touches(touches)[:: max(1, -(-len(touches) // ARROWS_SHOWN))]
    lines = np.stack([at[:, :2], at[:, :2] + at[:, 2:]], axis=1)
    axes.add_collection(LineCollection(list(lines), colors=RANDOM, linewidths=1.3))
    axes.scatter(*at[:, :2].T, 12, color=DIM, lw=0)
    return svg(figure, "touches and how far off each was")


@styled
def error_map(touches: Sequence[Touch], grid: Grid) -> Markup:
    """Return the mean error around each taxel."""
    figure, axes = _map(grid)
    at = _touches(touches)
    nearest = np.clip(np.rint(at[:, 1::-1]), 0, np.array(grid) - 1).astype(int)
    errors = np.abs(at[:, 2:]).mean(axis=1)
    means = {
        (row, column): float(errors[here].mean())
        for row, column in np.ndindex(*grid)
        if (here := (nearest == (row, column)).all(axis=1)).any()
    }
    _tiles(axes, means, "{:.2f}".format)
    return svg(figure, "mean error around each taxel, grid units")


@styled
def dead_taxels(shares: Mapping[tuple[int, int], float], whole: float, grid: Grid) -> Markup:
    """Return the share of gestures recognised with each taxel dead.

    Args:
        shares: By row from the top and column from the left.
        whole: The share while nothing is broken; NaN: unknown.
        grid: Rows and columns of the sensor.
    """
    figure, axes = _map(grid)
    usual = whole if math.isfinite(whole) else 1.0
    lost = {(grid[0] - 1 - row, column): usual - one for (row, column), one in shares.items()}
    _tiles(axes, lost, lambda value: f"{100 * (usual - value):.1f}", least=0.05)
    axes.set_axis_off()
    return svg(figure, "events recognised with each taxel dead, per cent")


def _touches(touches: Sequence[Touch]) -> NDArray[np.float64]:
    """Return touches as an array, (touches, 4)."""
    return np.array(touches, dtype=np.float64).reshape(-1, 4)


def _map(grid: Grid) -> tuple[Figure, Axes]:
    """Return an empty map of the sensor as its player sees it: row 0 at the bottom."""
    rows, columns = grid
    unit = MAP_PX / max(grid)
    figure, axes = new(columns * unit + 44, rows * unit + 44)
    axes.set_xlim(-0.5, columns - 0.5)
    axes.set_ylim(-0.5, rows - 0.5)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.spines["bottom"].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    axes.set_xlabel("x and y in grid units")
    return figure, axes


def _tiles(
    axes: Axes,
    values: Mapping[tuple[int, int], float],
    words: Callable[[float], str],
    least: float = 0.0,
) -> None:
    """Draw a tile for each value, the darker the larger.

    Args:
        axes: Of the map.
        values: By row from below and column.
        words: Text of a tile; left out where tiles are small.
        least: A value of full strength is at least this.
    """
    high = max([least, *(v for v in values.values() if math.isfinite(v))]) or 1.0
    small = max(axes.get_xlim()[1], axes.get_ylim()[1]) > MAP_PX / 29.0
    for (row, column), value in values.items():
        for colour, strength in ((PANEL, 1.0), (RANDOM, max(0.0, 0.75 * value / high))):
            axes.add_patch(
                FancyBboxPatch((column - 0.42, row - 0.42), 0.84, 0.84, fc=colour, lw=0,
                               boxstyle="round,pad=0,rounding_size=0.05", alpha=strength)
            )  # fmt: skip
        if not small:
            axes.text(column, row, words(value), ha="center", va="center", weight="bold")


@styled
def missed(found: Tuning) -> Markup:
    """Return the share of events missed over latency, of the best debounce settings."""
    return _front(found, "events missed", lambda point: 1.0 - point.recall, _percents)


@styled
def false_alarms(found: Tuning) -> Markup:
    """Return the rate of false alarms over latency, of the best debounce settings."""
    title = "false alarms per idle minute"
    return _front(found, title, lambda point: point.false_alarms_per_min, _plain)


def _front(
    found: Tuning, title: str, value: Callable[[Point], float], words: FuncFormatter
) -> Markup:
    every = [*found.front, found.before, found.chosen]
    low, high = limits([value(point) for point in every], least=0.002)
    figure, axes = new(460, 280)
    axes.plot([p.latency_s for p in found.front], [value(p) for p in found.front], "o",
              color=TRAIN, mec=PAPER, ms=6, clip_on=False)  # fmt: skip
    named = [(found.chosen, UNSEEN, "chosen")]
    if found.before != found.chosen:
        named.insert(0, (found.before, RANDOM, "before"))
    for point, colour, name in named:
        at = (point.latency_s, value(point))
        axes.plot(*at, "o", color=colour, mec=PAPER, ms=13, clip_on=False)
        if all(map(math.isfinite, at)):
            axes.annotate(name, at, xytext=(0, 10), textcoords="offset points", ha="center",
                          weight="bold", color=colour)  # fmt: skip
    axes.set_xlim(limits([point.latency_s for point in every], least=0.05))
    axes.set_ylim(max(0.0, low), high)
    axes.set_title(title)
    axes.set_xlabel("median latency, s")
    axes.yaxis.set_major_formatter(words)
    return svg(figure, f"{title} over latency")


_percents: Final = FuncFormatter(lambda value, _: f"{100 * value:.3g} %")
_plain: Final = FuncFormatter(lambda value, _: f"{value:.3g}")
