"""Trial of any sensor: rate, range, rest, sign, noise, and which taxels move. Pure."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics.report import Row, Verdict
from controller.recognition.images.scale import FIRM
from controller.shared.aliases import Frames
from controller.shared.taxel_measures import taxel_names

# Times a taxel's own noise from which it is touched. At rest the greatest of 20,000 values of a
# virtual orb is at 5.4, that of 10^6 Gaussian ones at 4.9; a finger on it is at 24 or more.
_ABOVE: Final = 8.0
_DEVIATION: Final = 1.4826  # standard deviation of Gaussian noise over its median deviation
_MOVED: Final = 0.1  # of the strongest taxel's change, below which a taxel does not move
_AT_ZERO: Final = 0.2  # of the strongest change: a rest below is about zero
_OFTEN: Final = 10  # differences of successive readings at rest, from which they are noise
_NO_CHIP: Final = 65535.0  # 16 bits of a bus on which nothing answers


@dataclass(frozen=True, slots=True)
class Trial:
    """What a sensor was seen to do."""

    rows: list[Row]  # for people
    sign: Literal["falls", "rises"] | None  # what its readings do under a touch; None: no touch
    scale: float  # change by a usual touch over `FIRM`, in its unit; 0 without a touch
    at_zero: bool  # whether it rests at about zero, for the size of its touches


def examine(rest: Frames, touched: Frames, rate_hz: float, unit: str) -> Trial:
    """Return what frames show: those at rest, and those in which every taxel was touched."""
    middle, noise = np.median(rest, axis=0), _noise(rest)
    both, change = np.concatenate([rest, touched]), touched - middle
    silent = np.ptp(both, axis=0) == 0.0
    silent |= middle == _NO_CHIP
    if silent.all():
        return Trial([_silent(silent, middle)], None, 0.0, False)
    early = ((np.abs(rest - middle) > _ABOVE * noise) & ~silent).any(axis=0)
    above = np.where(silent, 0.0, np.abs(change) / noise)
    busy = above.max(axis=(1, 2)) > _ABOVE
    peaks = np.where(silent, 0.0, np.abs(change[busy]).max(axis=0, initial=0.0))
    level = float(middle[~silent].mean())
    at_zero = bool(np.abs(middle[~silent]).mean() < _AT_ZERO * peaks.max())
    low, high = float(both[:, ~silent].min()), float(both[:, ~silent].max())
    rows = [
        Row("rate", Verdict.GOOD, f"{rate_hz:g} frames a second"),
        Row("range", Verdict.GOOD, f"{low:.4g} to {high:.4g} {unit}"),
        Row("rest", Verdict.GOOD, f"{level:.4g} {unit}" + (", about zero" if at_zero else "")),
        Row("noise", Verdict.GOOD, f"{np.median(noise[~silent]):.3g} {unit}"),
    ]
    if silent.any():
        rows.append(_silent(silent, middle))
    if early.any():
        advice = "Keep hands off until the call, and try again."
        found = f"moved before the call: {taxel_names(early)}"
        rows.append(Row("hands", Verdict.DOUBTFUL, found, advice, "early"))
    if not busy.any():
        advice = "Touch every taxel firmly after the call; check wiring and range."
        rows.append(Row("touch", Verdict.FAULT, "no touch was seen", advice, "untouched"))
        return Trial(rows, None, 0.0, at_zero)
    flat = change[busy].reshape(-1, middle.size)
    most = flat[np.arange(len(flat)), above[busy].reshape(-1, middle.size).argmax(axis=1)]
    sign: Literal["falls", "rises"] = "rises" if np.median(most) > 0.0 else "falls"
    energy = np.abs(change[busy]).mean(axis=(1, 2), dtype=np.float64, where=~silent)
    scale = float(f"{np.median(energy) / FIRM:.3g}")
    rows.append(Row("touch", Verdict.GOOD, f"the reading {sign}; scale {scale:g} {unit}"))
    rows += _moved(peaks > np.maximum(_MOVED * peaks.max(), _ABOVE * noise))
    return Trial(rows, sign, scale, at_zero)


def _noise(rest: Frames) -> NDArray[np.float64]:
    """Return each taxel's noise, (rows, columns): median based, at least half a reading's step.

    Steps that are seldom are those of a hand that is early, on a skin without noise.
    """
    spread = _DEVIATION * np.median(np.abs(rest - np.median(rest, axis=0)), axis=0)
    steps = np.abs(np.diff(rest, axis=0))
    steps = steps[steps > 0.0]
    return np.maximum(spread, 0.5 * float(steps.min()) if len(steps) >= _OFTEN else 1e-9)


def _silent(silent: NDArray[np.bool_], middle: NDArray[np.float32]) -> Row:
    """Return the row about taxels, (rows, columns), that are constant or of a missing chip."""
    values = ", ".join(f"{value:.6g}" for value in np.unique(middle[silent])[:3])
    found = f"does not answer: {taxel_names(silent)}, reads {values}"
    advice = "Touch these, too; if they stay so, check leads, and supply and address of the chip."
    return Row("readings", Verdict.FAULT, found, advice, "silent")


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
