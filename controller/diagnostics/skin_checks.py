"""Checks of the skin from frames that nothing touches, among them its calibration; pure."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics.report import Row, Verdict
from controller.diagnostics.touch_checks import pressed
from controller.recognition.images import drift
from controller.recognition.images.dead_taxels import TaxelInterpolator
from controller.recognition.images.frames import Frame, PreprocessSettings
from controller.recognition.images.preprocess import Prepared, Preprocessor
from controller.recognition.images.scale import PICOFARAD
from controller.shared import taxel_measures
from controller.shared.aliases import Frames, Mask
from controller.shared.taxel_measures import DEAD_TAXELS_SHARE, taxel_names, without_lead

IDLE_S: Final = 6.0  # so long nothing should touch
CALIBRATION_S: Final = 10.0  # paper, section 4.1
HOLD_S: Final = (0.6, 3.0)  # of a press, the least and the most
_FINE: Final = 0.02  # scatter of z that is left in the mean of a press
_MOVED: Final = 0.012  # of all taxels in some seconds: four times what sound orbs drift by
_SURE: Final = 9.0  # times the noise of such a drift, divided by idle: four medians of |z - 1|
_USUAL_PF: Final = (15.0, 120.0)
_SETTLES_S: Final = 2.0  # at most, until the first second is still
_MOVES_S: Final = 0.3  # so long something has to be felt
# Mean |z - 1| at 10 Hz; shorter scans are noisier. A preset as noisy as the paper's figures imply
# has 0.05.
_NOISY: Final = 0.09
# Of 400 simulated orbs that were never calibrated 1.5 % look so much like pressed ones, and none
# beyond the second; of 400 that a finger presses 8 mm deep 75 % and 38 % do.
_LIKELY, _CERTAIN = 3.5, 4.5
_DEEP: Final = 0.5  # of a press 8 mm deep
_LARGE: Final = 100  # taxels: larger grids are untested
_PITCH_MM: Final = 10.0
_OTHER: Final = 0.08  # ln C against the last calibration: of all taxels, of a line
_LINE: Final = 0.15

_ADVICE: Final = {
    "stuck": "Its reading never changes: look at the lead, and at the converter's input.",
    "saturated": "The converter is at its end: check reference and supply.",
    "loose": "Fasten the lead at the membrane.",
    "short": "Look for a solder bridge, or for film that touches.",
    "noisy": "Dry the membrane; if it stays, a contact or the dielectric leaks here.",
}
_CODE: Final = {"loose": "open"}


def rest(frames: Frames, rate_hz: float) -> list[Row]:
    """Return whether anything touched the skin, and whether it drifts; frames at rest, in order."""
    steps = _steps(frames, rate_hz)
    if not any(step.ready for step in steps):
        return [_touched(f"no quiet second in {len(frames) / rate_hz:.0f} s")]
    middle, idle = float(np.median(frames)), steps[-1].idle
    rows = [Row("rest", Verdict.GOOD, f"scatters by {100 * idle:.1f} %")]
    if not _USUAL_PF[0] < middle < _USUAL_PF[1]:
        words = f"{middle:.1f} pF, where some 41 are usual"
        advice = "Is the orb inflated, and the right wiring file in use?"
        rows.append(Row("level", Verdict.DOUBTFUL, words, advice, "level"))
    moved = _drift(frames, without_lead(frames.mean(axis=0)), idle)
    if moved < 0.0:
        minutes = len(frames) * 2 / 3 / rate_hz / 60.0
        words = f"all taxels lose {-100 * moved / minutes:.0f} % a minute"
        advice = "The orb leaks air: look at hose and valve, and pump it up."
        rows.append(Row("air", Verdict.FAULT, words, advice, "air_leak"))
    return rows


def _steps(frames: Frames, rate_hz: float) -> list[Prepared]:
    """Return what preprocessing makes of frames, without interpolation."""
    stage = Preprocessor(PreprocessSettings(rate_hz=rate_hz), *frames.shape[1:], mend=False)
    return [stage.step(frame) for frame in frames]


def _touched(why: str) -> Row:
    advice = "Take hands and things off the orb, and start again."
    return Row("rest", Verdict.FAULT, why, advice, "touched")


def _drift(frames: Frames, lost: Mask, idle: float) -> float:
    """Return by how much all taxels alike have drifted, ln C; 0.0 if that is within the noise."""
    third = max(1, len(frames) // 3)
    ends = (np.maximum(part.mean(axis=0), 0.01) for part in (frames[:third], frames[-third:]))
    before, after = (np.log(end[~lost]) for end in ends)
    if not before.size:
        return 0.0
    moved = float(np.median(after - before))
    return moved if abs(moved) > _MOVED + _SURE * idle / np.sqrt(third * before.size) else 0.0


def hold_s(idle: Frames, rate_hz: float) -> float:
    """Return how long a press is held, so that noise is averaged out of it, seconds."""
    level = idle.mean(axis=0)
    scatter = float(np.median(idle.std(axis=0) / np.where(level > 0.0, level, np.inf)))
    return float(np.clip((scatter / _FINE) ** 2 / rate_hz, *HOLD_S))


def examine(idle: Frames, touched: Frames, bad: Mask) -> list[Row]:
    """Judge single taxels by frames at rest and under presses; `bad` is skipped and extended."""
    frames = np.concatenate([idle, touched])
    level = idle.mean(axis=0)
    change = (frames / np.where(level > 0.01, level, np.inf) - 1.0).astype(np.float32)
    change[:, level <= 0.01] = 0.0
    at_rest = np.arange(len(frames)) < len(idle)
    rows = []
    stuck = taxel_measures.stuck(frames)
    for one in taxel_measures.faults(frames, PICOFARAD, stuck, change, at_rest):
        if not (one.mask & ~bad).any():
            continue
        verdict = Verdict.DOUBTFUL if one.kind == "noisy" else Verdict.FAULT
        code = _CODE.get(one.kind, one.kind)
        rows.append(Row(taxel_names(one.mask), verdict, one.text, _ADVICE[one.kind], code))
        bad |= one.mask if one.useless else False
    return rows


def calibrate(
    frames: Frames, rate_hz: float, last: Frame | None = None, *, anyway: bool = False
) -> tuple[list[Row], Frame | None, float]:
    """Return the rows on a calibration, its rest image (None: refused) and its noise.

    Args:
        frames: Of an untouched sensor, (n, rows, columns), pF.
        rate_hz: Frames per second.
        last: What the same sensor read when it was calibrated before, (rows, columns).
        anyway: Keep it although something seems to lie there.
    """
    steps = _steps(frames, rate_hz)
    late = not any(step.ready for step in steps[: max(1, round((1.0 + _SETTLES_S) * rate_hz))])
    restless = [step.ready and not step.quiet for step in steps]
    run = max(2, round(_MOVES_S * rate_hz))
    if late or any(all(restless[i : i + run]) for i in range(len(steps) - run + 1)):
        return [_touched("something moved on it")], None, 0.0
    rest, idle = frames.mean(axis=0), steps[-1].idle
    lost = without_lead(rest)
    if not (rest > 0.0).any() or lost.mean() > DEAD_TAXELS_SHARE:
        words = "no taxel reads anything" if lost.all() else f"{taxel_names(lost)}: no signal"
        return [Row("rest", Verdict.FAULT, words, "Run: controller doctor", "leads")], None, 0.0
    known = last if last is not None and last.shape == rest.shape and last.min() > 0.0 else None
    sure, place = _guess(rest, lost) if known is None else _lies(rest, lost, known)
    if sure > _CERTAIN and not anyway:
        return [_touched(f"something seems to lie on it, near {place}")], None, 0.0
    rows = list(_doubts(frames, lost, idle, rate_hz))
    if sure > _LIKELY:
        advice = "If so, take it off and calibrate again."
        words = f"something may lie on it, near {place}"
        rows.append(Row("touch", Verdict.DOUBTFUL, words, advice, "touched"))
    if known is not None and not lost.any():
        rows += _changes(rest, known)
    if not rows:
        words = f"{rest[~lost].mean():.1f} pF (SD {rest[~lost].std():.1f})"
        rows = [Row("rest", Verdict.GOOD, f"{words}, scatters by {100 * idle:.1f} %")]
    return rows, np.maximum(rest, 0.01).astype(np.float32), idle


def _lies(rest: Frame, lost: Mask, last: Frame) -> tuple[float, str]:
    """Return how sure something lies on the skin, and where, by the change since `last`."""
    change = _deviation(rest / last, lost)
    row, column = np.unravel_index(int(change.argmin()), change.shape)
    firm = float(np.abs(change).mean()) > PreprocessSettings().gate
    sure = firm and drift.shape(change) == "touch"
    return float("inf") if sure else 0.0, f"taxel ({row},{column})"


def _guess(rest: Frame, lost: Mask) -> tuple[float, str]:
    """Return how sure something lies on a skin that was never calibrated, and where.

    Taxels differ by 7 % from the start, so they have to look like a simulated press: as many
    standard deviations as are returned.
    """
    best = (0.0, "")
    if rest.size > _LARGE:
        return best
    change = _deviation(rest, lost)
    change -= change.mean()
    rows, columns = rest.shape
    for row, column in np.ndindex(rows, columns):
        press = pressed(rows, columns, _PITCH_MM, (row, column))
        press -= press.mean()
        power = float(np.square(press).sum())
        depth = float((press * change).sum()) / power
        error = float((change - depth * press).std(ddof=2)) / np.sqrt(power)
        if depth > _DEEP:
            best = max(best, (depth / max(error, 1e-9), f"taxel ({row},{column})"))
    return best


def _deviation(image: Frame, lost: Mask) -> NDArray[np.float64]:
    """Return how far taxels are from their median, relatively; those lost are interpolated."""
    change = image.astype(np.float64) / np.median(image[~lost]) - 1.0
    return TaxelInterpolator(*change.shape).fill(change, lost) if lost.any() else change


def _doubts(frames: Frames, lost: Mask, idle: float, rate_hz: float) -> list[Row]:
    """Return doubts about a usable sensor."""
    rows = []
    if lost.any():
        words = f"{taxel_names(lost)}: no signal; play goes on without"
        rows.append(Row("leads", Verdict.DOUBTFUL, words, "Run: controller doctor", "leads"))
    if idle > _NOISY * np.sqrt(rate_hz / 10.0):
        words = f"readings scatter by {100 * idle:.0f} %"
        rows.append(Row("noise", Verdict.DOUBTFUL, words, "Run: controller doctor", "noise"))
    if moved := _drift(frames, lost, idle):
        words = f"all taxels drifted by {100 * moved:+.1f} % in {CALIBRATION_S:.0f} s"
        advice = "Wait until the orb is inflated and warm; does it leak?"
        rows.append(Row("drift", Verdict.DOUBTFUL, words, advice, "drift"))
    return rows


def _changes(rest: Frame, last: Frame) -> list[Row]:
    """Return how rest, (rows, columns), has changed since the last time, by cause."""
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
