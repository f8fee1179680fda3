"""The drawings of a report that show how a training went and what came of it."""

import math
from collections.abc import Sequence
from typing import Final

from models.reports.svg import Plot, fitted
from models.results.training import Epoch, Honesty, SessionRow
from models.text import number, percent

SHOWN_SESSIONS: Final = 30  # of the labels' lateness; of more some, evenly spread


def curves(epochs: Sequence[Epoch], best: int, *, share: bool) -> str:
    """Return how the score grew on what was learned, on windows at random, and unseen.

    Args:
        epochs: The curve.
        best: Number of the epoch that was kept.
        share: Scores are shares; else errors in grid units.
    """

    def words(value: float) -> str:
        return f"{100 * value:.0f} %" if share else f"{value:.2f}"

    every = [value for e in epochs for value in (e.train, e.check, e.random)]
    early = [value for e in epochs[: max(1, len(epochs) // 20)] for value in (e.train, e.check)]
    low, high = fitted([v for v in every if v not in early] or every, least=0.04)
    plot = Plot((470, 290), (1, max(2, len(epochs))), (max(0.0, low), min(1.0, high)))
    plot.axes("epoch", "right windows" if share else "error, grid units", lambda v: f"{v:g}", words)
    kept = plot.x(best)
    plot.line((kept, plot.y.first), (kept, plot.y.last), "kept")
    plot.text((kept, plot.y.last - 6), "kept", "tick mid")
    plot.path([(e.number, e.random) for e in epochs], "line random")
    plot.path([(e.number, e.train) for e in epochs], "line train")
    plot.path([(e.number, e.check) for e in epochs], "line unseen")
    last, at = epochs[-1], epochs[best - 1]
    plot.dot((best, at.check), "mark unseen", 4.5, f"epoch {best}: {words(at.check)} unseen")
    plot.ends(
        [
            (last.check, "unseen", "name unseen"),
            (last.random, "at random", "name random"),
            (last.train, "learned", "name train"),
        ]
    )
    return plot.svg("score over the epochs, on what was learned, at random and unseen")


def losses(epochs: Sequence[Epoch], best: int) -> str:
    """Return how the loss fell on what was learned, and unseen."""
    every = [value for e in epochs for value in (e.loss, e.check_loss) if value > 0]
    low, high = (min(every), max(every)) if every else (0.1, 1.0)
    plot = Plot((470, 290), (1, max(2, len(epochs))), (low / 1.1, high * 1.1), log_y=True)
    plot.axes("epoch", "loss", lambda v: f"{v:g}", lambda v: f"{v:g}")
    kept = plot.x(best)
    plot.line((kept, plot.y.first), (kept, plot.y.last), "kept")
    plot.text((kept, plot.y.last - 6), "kept", "tick mid")
    plot.path([(e.number, e.loss) for e in epochs], "line train")
    plot.path([(e.number, e.check_loss) for e in epochs], "line unseen")
    last = epochs[-1]
    plot.ends([(last.check_loss, "unseen", "name unseen"), (last.loss, "learned", "name train")])
    return plot.svg("loss over the epochs, on what was learned and unseen")


def gap(honest: Honesty, *, share: bool) -> str:
    """Return the honest figure and the paper's protocol on one line, and the gap between them."""
    known = [honest.unseen, honest.random, honest.low, honest.high]
    low, high = fitted(known, least=0.08 if share else 0.05, room=0.25)
    high = min(high, 1.0) if share else high

    def words(value: float) -> str:
        return percent(value) if share else number(value)

    plot = Plot((560, 150), (max(0.0, low), high), (0, 1), margins=(8, 60, 40, 150))
    left, right = plot.x.first, plot.x.last
    for value in plot.x.ticks(4):
        x = plot.x(value)
        plot.line((x, 8), (x, 110), "grid")
        plot.text((x, 128), f"{100 * value:.3g} %" if share else f"{value:.2f}", "tick mid")
    plot.line((left, 110), (right, 110), "axis")
    for y, value, name, kind in (
        (36.0, honest.unseen, "sessions never seen", "unseen"),
        (82.0, honest.random, "windows at random", "random"),
    ):
        plot.text((left - 12, y + 4), name, f"name {kind} end")
        if not math.isfinite(value):
            continue
        if kind == "unseen" and math.isfinite(honest.low):
            plot.line((plot.x(honest.low), y), (plot.x(honest.high), y), "range unseen")
        plot.circle((plot.x(value), y), 6.5, f"mark {kind}")
        plot.text((plot.x(value), y - 13), words(value), f"value {kind} mid")
    return plot.svg("the score on unseen sessions and on windows at random")


def reliability(bins: Sequence[tuple[float, float, int]]) -> str:
    """Return how often a network is right when it is so sure."""
    plot = Plot((360, 320), (0.0, 1.0), (0.0, 1.0), margins=(26, 24, 44, 58))
    plot.axes("how sure it was", "how often it was right", _whole, _whole)
    plot.path([(0.0, 0.0), (1.0, 1.0)], "guide")
    most = max((bin_[2] for bin_ in bins), default=1)
    plot.path([(sure, right) for sure, right, _ in bins], "line unseen thin")
    for sure, right, amount in bins:
        says = f"{_whole(sure)} sure, {_whole(right)} right, {amount} windows"
        plot.dot((sure, right), "mark unseen", 3.0 + 7.0 * math.sqrt(amount / most), says)
    return plot.svg("share of right answers over the probability that was given")


def examples_curve(curve: Sequence[tuple[float, float]]) -> str:
    """Return a small drawing of how errors fall as examples are added."""
    if len(curve) < 2:
        return ""
    high = max(0.05, *(error for _, error in curve))
    plot = Plot((96, 28), (0.0, curve[-1][0]), (0.0, high), margins=(4, 6, 4, 6))
    plot.line((plot.x.first, plot.y.first), (plot.x.last, plot.y.first), "axis")
    plot.path(list(curve), "line unseen thin")
    for examples, error in curve:
        plot.dot((examples, error), "mark unseen", 2.5, f"{examples:.0f}: {percent(error)} missed")
    return plot.svg(f"errors fall from {percent(curve[0][1])} to {percent(curve[-1][1])}")


def lateness(rows: Sequence[SessionRow]) -> str:
    """Return how late labels were in each session: the estimate, its spread, and the truth."""
    known = [row for row in rows if row.lateness is not None]
    step = max(1, -(-len(known) // SHOWN_SESSIONS))
    known = known[::step]
    late = [row.lateness for row in known if row.lateness is not None]
    values = [
        1000 * (value + side * spread / 2)
        for of in late
        for value, spread in ((of.begin_s, of.begin_spread_s), (of.end_s, of.end_spread_s))
        for side in (-1, 1)
    ]
    low, high = fitted([*values, 0.0], least=100.0)
    plot = Plot((640, 74 + 34 * len(known)), (low, high), (0, 1), margins=(20, 20, 50, 170))
    bottom = plot.y.first
    for value in plot.x.ticks(6):
        plot.line((plot.x(value), 14), (plot.x(value), bottom), "grid" if value else "axis")
        plot.text(
            (plot.x(value), bottom + 17),
            f"{value:+.0f}".replace("-", "−") if value else "0",
            "tick mid",
        )
    plot.text(
        ((plot.x.first + plot.x.last) / 2, bottom + 36),
        "milliseconds after the touch (left of 0: too early)",
        "title mid",
    )
    for number_of, (row, of) in enumerate(zip(known, late, strict=True)):
        y = 34.0 + 34 * number_of
        plot.text((plot.x.first - 12, y + 9), _session(row), "tick end")
        for offset, kind, value, spread, truth in (
            (0.0, "unseen", of.begin_s, of.begin_spread_s, of.true_begin_s),
            (11.0, "random", of.end_s, of.end_spread_s, of.true_end_s),
        ):
            if not math.isfinite(value):
                continue
            at, half = 1000 * value, 500 * spread
            plot.line((plot.x(at - half), y + offset), (plot.x(at + half), y + offset),
                      f"range {kind}")  # fmt: skip
            plot.circle((plot.x(at), y + offset), 4.5, f"mark {kind}", f"{at:+.0f} ms")
            if math.isfinite(truth):
                x = plot.x(1000 * truth)
                plot.line((x, y + offset - 6), (x, y + offset + 6), "truth")
    return plot.svg("how late labels were, session by session")


def _session(row: SessionRow) -> str:
    if row.user or row.session:
        named = (("user", row.user), ("session", row.session))
        return ", ".join(f"{what} {name}" for what, name in named if name)
    return row.path.rpartition("/")[2].removesuffix(".npz")


def _whole(share: float) -> str:
    return f"{100 * share:.0f} %"
