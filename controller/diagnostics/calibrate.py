"""Calibration: judge the rest image of an untouched sensor."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics.report import Row, Verdict
from controller.diagnostics.touch_checks import pressed
from controller.recognition import drift
from controller.recognition.dead_taxels import MOST, TaxelInterpolator, without_lead
from controller.recognition.frames import Frame, PreprocessSettings
from controller.recognition.preprocess import Preprocessor
from controller.recognition.sensor_health import taxel_names

Frames = NDArray[np.float32]  # (n, rows, columns)
Change = NDArray[np.float64]

SECONDS: Final = 10.0  # paper, section 4.1
_SETTLES_S: Final = 2.0  # at most, until the first second is still
_MOVES_S: Final = 0.3  # so long something has to be felt
# Of 400 simulated orbs that were never calibrated 1.5 % look so much like pressed ones, and none
# beyond the second; of 400 that a finger presses 8 mm deep 75 % and 38 % do.
_LIKELY, _SURE = 3.5, 4.5
_DEEP: Final = 0.5  # of a press 8 mm deep
_LARGE: Final = 100  # taxels: larger grids are untested
_PITCH_MM: Final = 10.0
_NOISY: Final = 0.09  # mean |z - 1|; a preset as noisy as the paper's figures imply has 0.05
_MOVED: Final = 0.012  # what rest may drift meanwhile
_OTHER: Final = 0.08  # ln C against the last calibration: of all taxels, of a line
_LINE: Final = 0.15


def judge(
    frames: Frames, rate_hz: float, last: Frame | None = None, *, anyway: bool = False
) -> tuple[list[Row], Frame | None, float]:
    """Return the rows on a calibration, its rest image (None: refused) and its noise.

    Args:
        frames: Of an untouched sensor, (n, rows, columns), pF.
        rate_hz: Frames per second.
        last: What the same sensor read when it was calibrated before.
        anyway: Keep it although something seems to lie there.
    """
    stage = Preprocessor(PreprocessSettings(rate_hz=rate_hz), *frames.shape[1:], mend=False)
    steps = [stage.step(frame) for frame in frames]
    late = not any(step.ready for step in steps[: max(1, round((1.0 + _SETTLES_S) * rate_hz))])
    restless = [step.ready and not step.quiet for step in steps]
    run = max(2, round(_MOVES_S * rate_hz))
    if late or any(all(restless[i : i + run]) for i in range(len(steps) - run + 1)):
        return [_refused("something moved on it")], None, 0.0
    rest = frames.mean(axis=0)
    lost = without_lead(rest)
    if not (rest > 0.0).any() or lost.mean() > MOST:
        words = "no taxel reads anything" if lost.all() else f"{taxel_names(lost)}: no signal"
        return [Row("rest", Verdict.FAULT, words, "Run: controller doctor", "leads")], None, 0.0
    sure, place = _lies(rest, lost, last)
    if sure > _SURE and not anyway:
        return [_refused(f"something seems to lie on it, near {place}")], None, 0.0
    rows = [*_doubts(frames, rest, lost, steps[-1].idle), *_changes(rest, last, lost)]
    if sure > _LIKELY:
        words = f"something may lie on it, near {place}"
        advice = "If so, take it off and calibrate again."
        rows.append(Row("touch", Verdict.DOUBTFUL, words, advice, "touched"))
    if not rows:
        words = f"{rest[~lost].mean():.1f} pF (SD {rest[~lost].std():.1f})"
        rows = [Row("rest", Verdict.GOOD, f"{words}, scatters by {100 * steps[-1].idle:.1f} %")]
    return rows, np.maximum(rest, 0.01).astype(np.float32), steps[-1].idle


def _refused(why: str) -> Row:
    advice = "Take hands and things off the orb, and calibrate again."
    return Row("rest", Verdict.FAULT, why, advice, "touched")


def _lies(rest: Frame, lost: NDArray[np.bool_], last: Frame | None) -> tuple[float, str]:
    """Return how sure something lies on the skin, and where, from rest images (rows, columns).

    Where the sensor was calibrated before, the change since then shows it. Where not, taxels that
    differ by 7 % from the start have to look like a simulated press (standard deviations).
    """
    now = rest.astype(np.float64)
    if last is not None and last.shape == rest.shape and (last > 0.0).all():
        z = now / last
        change = _filled(z / np.median(z[~lost]) - 1.0, lost)
        row, column = np.unravel_index(int(change.argmin()), change.shape)
        firm = float(np.abs(change).mean()) > PreprocessSettings().gate
        sure = firm and drift.shape(change) == "touch"
        return float("inf") if sure else 0.0, f"taxel ({row},{column})"
    change = _filled(now / np.median(now[~lost]) - 1.0, lost)
    if rest.size > _LARGE:
        return 0.0, ""
    best = (0.0, "")
    change = change - change.mean()
    for row, column in np.ndindex(*rest.shape):
        press = pressed(rest.shape[0], rest.shape[1], _PITCH_MM, (row, column))
        press = press - press.mean()
        power = float(np.square(press).sum())
        depth = float((press * change).sum()) / power
        error = float((change - depth * press).std(ddof=2)) / np.sqrt(power)
        if depth > _DEEP:
            best = max(best, (depth / max(error, 1e-9), f"taxel ({row},{column})"))
    return best


def _filled(change: Change, lost: NDArray[np.bool_]) -> Change:
    """Return a change, (rows, columns), with lost taxels interpolated."""
    return TaxelInterpolator(*change.shape).fill(change, lost) if lost.any() else change


def _doubts(frames: Frames, rest: Frame, lost: NDArray[np.bool_], idle: float) -> list[Row]:
    """Return doubts about a usable sensor from `frames`, (n, rows, columns)."""
    rows = []
    if lost.any():
        words = f"{taxel_names(lost)}: no signal; play goes on without"
        rows.append(Row("leads", Verdict.DOUBTFUL, words, "Run: controller doctor", "leads"))
    if idle > _NOISY:
        words = f"readings scatter by {100 * idle:.0f} %"
        rows.append(Row("noise", Verdict.DOUBTFUL, words, "Run: controller doctor", "noise"))
    third = max(1, len(frames) // 3)
    ends = frames[:third].mean(axis=0), frames[-third:].mean(axis=0)
    moved = np.log(np.maximum(ends[1], 0.01) / np.maximum(ends[0], 0.01))[~lost]
    limit = _MOVED + 4.0 * idle / np.sqrt(third * moved.size)
    if abs(float(np.median(moved))) > limit:
        words = f"all taxels drifted by {100 * np.median(moved):+.1f} % in {SECONDS:.0f} s"
        advice = "Wait until the orb is inflated and warm; does it leak?"
        rows.append(Row("drift", Verdict.DOUBTFUL, words, advice, "drift"))
    return rows


def _changes(rest: Frame, last: Frame | None, lost: NDArray[np.bool_]) -> list[Row]:
    """Return how rest, (rows, columns), has changed since the last time, by cause."""
    if last is None or last.shape != rest.shape or lost.any() or not (last > 0.0).all():
        return []
    why, rows = drift.causes(last, np.maximum(rest, 0.01)), []
    if abs(why.common) > _OTHER:
        words = f"all taxels {100 * np.expm1(why.common):+.0f} % since the last time"
        advice = "Pump the orb to its usual pressure." if why.common < 0 else ""
        rows.append(Row("pressure", Verdict.DOUBTFUL, words, advice, "pressure"))
    for word, sizes in (("row", why.rows), ("column", why.columns)):
        for i in np.flatnonzero(np.abs(sizes) > _LINE).tolist():
            words = f"{100 * np.expm1(sizes[i]):+.0f} % against the others since the last time"
            rows.append(Row(f"{word} {i}", Verdict.DOUBTFUL, words, "Look at its lead.", "line"))
    return rows
