"""Trial of any sensor: rate, range, rest, sign, noise, and which taxels move. Pure."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics.report import Row, Verdict
from controller.recognition.scale import FIRM

_ABOVE: Final = 4.0  # times the noise: energy from which a frame is touched, and a taxel moves
_MOVED: Final = 0.1  # of the strongest taxel's change, below which a taxel does not move
_AT_ZERO: Final = 0.2  # of the strongest change: a rest below is about zero

Frames = NDArray[np.float32]  # (n, rows, columns), in the sensor's unit


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """What a sensor was seen to do; values in its unit."""

    rate_hz: float
    low: float
    high: float
    rest: float  # mean of the untouched frame
    noise: float  # standard deviation of an untouched taxel, the median of all
    at_zero: bool  # whether it rests at about zero, for the size of its touches
    sign: str  # "falls" or "rises" under a touch; "" if nothing was touched
    scale: float  # a usual touch over `FIRM`; 0 if nothing was touched
    moved: NDArray[np.bool_]  # taxels that answered a touch, (rows, columns)


def examine(rest: Frames, touched: Frames, rate_hz: float) -> Trial:
    """Return what the frames show: those at rest, and those in which every taxel was touched."""
    middle = np.median(rest, axis=0)
    noise = float(np.median(rest.std(axis=0)))
    change = touched - middle
    energy = np.abs(change).mean(axis=(1, 2), dtype=np.float64)
    idle = float(np.abs(rest - middle).mean())
    busy = energy > max(_ABOVE * idle, 1e-9)
    peaks = np.abs(change[busy]).max(axis=0) if busy.any() else np.zeros(middle.shape)
    strongest = float(peaks.max())
    flat = change[busy].reshape(int(busy.sum()), middle.size)
    most = np.take_along_axis(flat, np.abs(flat).argmax(axis=1)[:, None], axis=1)
    both = np.concatenate([rest, touched])
    return Trial(
        rate_hz,
        float(both.min()),
        float(both.max()),
        float(middle.mean()),
        noise,
        at_zero=bool(np.abs(middle).mean() < _AT_ZERO * strongest),
        sign=("rises" if np.median(most) > 0.0 else "falls") if busy.any() else "",
        scale=float(f"{np.median(energy[busy]) / FIRM:.3g}") if busy.any() else 0.0,
        moved=peaks > max(_MOVED * strongest, _ABOVE * noise),
    )


def rows(trial: Trial, unit: str) -> list[Row]:
    """Return a table of a trial."""
    good, doubtful = Verdict.GOOD, Verdict.DOUBTFUL
    level = f"{trial.rest:.4g} {unit}" + (", about zero" if trial.at_zero else "")
    found = [
        Row("rate", good, f"{trial.rate_hz:g} frames a second"),
        Row("range", good, f"{trial.low:.4g} to {trial.high:.4g} {unit}"),
        Row("rest", good, level),
        Row("noise", good, f"{trial.noise:.3g} {unit}"),
    ]
    if not trial.sign:
        advice = "Touch every taxel firmly after the call; check wiring and range."
        return [*found, Row("touch", Verdict.FAULT, "no touch was seen", advice, "untouched")]
    found.append(Row("touch", good, f"the reading {trial.sign}; scale {trial.scale:g} {unit}"))
    still = [f"({row},{column})" for row, column in np.argwhere(~trial.moved).tolist()]
    words = f"{int(trial.moved.sum())} of {trial.moved.size} move"
    if still:
        words += f"; still are {' '.join(still)}"
    advice = "Touch these, too; if they stay still, check their leads, or `order`." if still else ""
    found.append(Row("taxels", doubtful if still else good, words, advice))
    found += [
        Row(f"row {number}", good, " ".join(".#"[int(one)] for one in line))
        for number, line in enumerate(trial.moved)
    ]
    return found
