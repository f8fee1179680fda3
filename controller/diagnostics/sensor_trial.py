"""Trial of any sensor: rate, range, rest, sign, noise, and which taxels move. Pure."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics.report import Row, Verdict
from controller.diagnostics.skin_checks import Frames
from controller.recognition.scale import FIRM

_ABOVE: Final = 4.0  # times the noise: energy from which a frame is touched, and a taxel moves
_MOVED: Final = 0.1  # of the strongest taxel's change, below which a taxel does not move
_AT_ZERO: Final = 0.2  # of the strongest change: a rest below is about zero


@dataclass(frozen=True, slots=True)
class Trial:
    """What a sensor was seen to do."""

    rows: list[Row]  # for people
    sign: Literal["falls", "rises"] | None  # what its readings do under a touch; None: no touch
    scale: float  # change by a usual touch over `FIRM`, in its unit; 0 without a touch
    at_zero: bool  # whether it rests at about zero, for the size of its touches


def examine(rest: Frames, touched: Frames, rate_hz: float, unit: str) -> Trial:
    """Return what frames show: those at rest, and those in which every taxel was touched."""
    middle = np.median(rest, axis=0)
    noise, idle = float(np.median(rest.std(axis=0))), float(np.abs(rest - middle).mean())
    change = touched - middle
    energy = np.abs(change).mean(axis=(1, 2), dtype=np.float64)
    busy = energy > max(_ABOVE * idle, 1e-9)
    peaks = np.abs(change[busy]).max(axis=0, initial=0.0)
    at_zero = bool(np.abs(middle).mean() < _AT_ZERO * peaks.max())
    low, high = (float(limit(np.concatenate([rest, touched]))) for limit in (np.min, np.max))
    level = f"{middle.mean():.4g} {unit}" + (", about zero" if at_zero else "")
    rows = [
        Row("rate", Verdict.GOOD, f"{rate_hz:g} frames a second"),
        Row("range", Verdict.GOOD, f"{low:.4g} to {high:.4g} {unit}"),
        Row("rest", Verdict.GOOD, level),
        Row("noise", Verdict.GOOD, f"{noise:.3g} {unit}"),
    ]
    if not busy.any():
        advice = "Touch every taxel firmly after the call; check wiring and range."
        rows.append(Row("touch", Verdict.FAULT, "no touch was seen", advice, "untouched"))
        return Trial(rows, None, 0.0, at_zero)
    flat = change[busy].reshape(-1, middle.size)
    most = flat[np.arange(len(flat)), np.abs(flat).argmax(axis=1)]
    sign: Literal["falls", "rises"] = "rises" if np.median(most) > 0.0 else "falls"
    scale = float(f"{np.median(energy[busy]) / FIRM:.3g}")
    rows.append(Row("touch", Verdict.GOOD, f"the reading {sign}; scale {scale:g} {unit}"))
    rows += _moved(peaks > max(_MOVED * peaks.max(), _ABOVE * noise))
    return Trial(rows, sign, scale, at_zero)


def _moved(moved: NDArray[np.bool_]) -> list[Row]:
    """Return the rows about the taxels that answered a touch, (rows, columns), and a map."""
    words = f"{int(moved.sum())} of {moved.size} move"
    found = Row("taxels", Verdict.GOOD, words)
    if not moved.all():
        still = " ".join(f"({row},{column})" for row, column in np.argwhere(~moved).tolist())
        advice = "Touch these, too; if they stay still, check their leads, or `order`."
        found = Row("taxels", Verdict.DOUBTFUL, f"{words}; still are {still}", advice)
    lines = (" ".join("#" if one else "." for one in line) for line in moved.tolist())
    return [found, *(Row(f"row {i}", Verdict.GOOD, line) for i, line in enumerate(lines))]
