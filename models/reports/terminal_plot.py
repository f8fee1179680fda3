"""Pareto front of a tuning, drawn in a terminal: slower to the right, fewer losses upwards."""

import math
from collections.abc import Sequence
from typing import Final

from models.results.evaluation import Point, Tuning

WIDTH, HEIGHT = 56, 12
LEAST: Final = 0.0005  # of the gestures lost, where the logarithmic axis ends
# False alarms per idle minute up to which a point is drawn like this.
MARKS: Final = ((0.005, "·"), (0.05, "o"), (math.inf, "O"))
CHOSEN, BEFORE = "◆", "+"


def draw(tuning: Tuning) -> str:
    """Return the front, the chosen point and the one before as lines of text."""
    shown = [*tuning.front, tuning.chosen, tuning.before]
    marks = [_mark(point) for point in tuning.front] + [CHOSEN, BEFORE]
    across = _scale([p.latency_s for p in shown], WIDTH)
    upward = _scale([-math.log10(max(1.0 - p.recall, LEAST)) for p in shown], HEIGHT)
    field = [[" "] * WIDTH for _ in range(HEIGHT)]
    for x, y, mark in zip(across, upward, marks, strict=True):
        field[HEIGHT - 1 - y][x] = mark
    losses = [max(1.0 - p.recall, LEAST) for p in shown]
    times = [p.latency_s for p in shown if math.isfinite(p.latency_s)]
    lines = [f"{min(losses):7.2%} lost ┤" + "".join(field[0])]
    lines += [" " * 13 + "│" + "".join(row) for row in field[1:-1]]
    lines.append(f"{max(losses):7.2%} lost ┤" + "".join(field[-1]))
    lines.append(" " * 13 + "└" + "─" * WIDTH)
    left, right = f"{min(times):.2f} s", f"{max(times):.2f} s"
    lines.append(" " * 14 + left + right.rjust(WIDTH - len(left)))
    lines.append(
        " " * 14 + "false alarms per idle minute: · ≤ 0.005, o ≤ 0.05, O more;  "
        f"{CHOSEN} chosen  {BEFORE} before"
    )
    return "\n".join(lines)


def _mark(point: Point) -> str:
    return next(mark for most, mark in MARKS if point.false_alarms_per_min <= most)


def _scale(values: Sequence[float], size: int) -> list[int]:
    """Return a place from 0 to size - 1 for each value; NaN is at the far end."""
    known = [value for value in values if math.isfinite(value)]
    low, high = min(known), max(known)
    span = (high - low) or 1.0
    return [round((v - low) / span * (size - 1)) if math.isfinite(v) else size - 1 for v in values]
