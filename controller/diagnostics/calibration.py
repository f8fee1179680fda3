"""Calibration of a sensor: the rest image from untouched frames, judged and stored; and depth."""

from pathlib import Path
from typing import Final

import numpy as np

from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import NoGestures
from controller.diagnostics.report import Row, Verdict
from controller.diagnostics.skin_checks import common_drift, prepared, touched_row
from controller.recognition.images import drift
from controller.recognition.images.dead_taxels import TaxelInterpolator
from controller.recognition.images.frames import Frame, PreprocessSettings
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Pipeline
from controller.sensors import calibration_store
from controller.sensors.base import Sensor
from controller.sensors.calibration_store import Calibration
from controller.shared.aliases import Frames, Mask
from controller.shared.errors import UserError
from controller.shared.notices import notice
from controller.shared.taxel_measures import DEAD_TAXELS_SHARE, taxel_names, without_lead

CALIBRATION_S: Final = 10.0  # paper, section 4.1
SETTLING_S: Final = 2.0  # at most, until the first second is still
MOTION_S: Final = 0.3  # least duration of a touch
# Mean |z - 1| at 10 Hz; shorter scans are noisier. A preset as noisy as the paper's figures imply
# has 0.05.
NOISE_LIMIT_Z: Final = 0.09
COMMON_CHANGE_LOG_C: Final = 0.08  # against the last calibration: of all taxels
LINE_CHANGE_LOG_C: Final = 0.15  # of a row or column
PRESSING_S: Final = 60.0  # of touches of a known depth
FEWEST_TOUCHES: Final = 5
HELD_S: Final = 0.5  # the shortest touch that counts
DEPTHS_MM: Final = (2.0, 15.0)  # that can be asked for: a lighter touch may not be felt
FACTOR_RANGE: Final = (0.3, 3.0)  # another one is of another depth than was asked for


def keep(sensor: Sensor, frames: Frames) -> tuple[list[Row], Path | None]:
    """Return the rows on a calibration, and the file that it is kept in; None: it is refused.

    `frames` are of the untouched sensor, (n, rows, columns), pF.
    """
    last = calibration_store.load(sensor.device_id)
    before = None if last is None else last.rest
    rows, rest, idle = calibrate(frames, sensor.rate_hz, before)
    if rest is None:
        return rows, None
    kept = Calibration(rest, idle, sensor.rate_hz, 1.0 if last is None else last.depth)
    return rows, calibration_store.save(sensor.device_id, kept)


def calibrate(
    frames: Frames, rate_hz: float, last: Frame | None = None
) -> tuple[list[Row], Frame | None, float]:
    """Return the rows on a calibration, its rest image (None: refused) and its noise.

    Args:
        frames: Of an untouched sensor, (n, rows, columns), pF.
        rate_hz: Frames per second.
        last: What the same sensor read when it was calibrated before, (rows, columns).
    """
    steps = prepared(frames, rate_hz)
    late = not any(step.ready for step in steps[: max(1, round((1.0 + SETTLING_S) * rate_hz))])
    restless = [step.ready and not step.quiet for step in steps]
    run = max(2, round(MOTION_S * rate_hz))
    if late or any(all(restless[i : i + run]) for i in range(len(steps) - run + 1)):
        return [touched_row(notice("moved"))], None, 0.0
    rest, idle = frames.mean(axis=0), steps[-1].idle
    lost = without_lead(rest)
    if not (rest > 0.0).any() or lost.mean() > DEAD_TAXELS_SHARE:
        none = notice("nothing_reads")
        words = none if lost.all() else notice("no_signal", taxel_names(lost))
        return [Row("rest", Verdict.FAULT, words, notice("doctor"), "leads")], None, 0.0
    known = last if last is not None and last.shape == rest.shape and last.min() > 0.0 else None
    if known is not None and (place := _touched_taxel(rest, lost, known)):
        return [touched_row(notice("lies", place))], None, 0.0
    rows = list(_doubts(frames, lost, idle, rate_hz))
    if known is not None and not lost.any():
        rows += _changes(rest, known)
    if not rows:
        level = f"{rest[~lost].mean():.1f} pF (SD {rest[~lost].std():.1f})"
        rows = [Row("rest", Verdict.GOOD, f"{level}, scatters by {100 * idle:.1f} %")]
    return rows, np.maximum(rest, 0.01).astype(np.float32), idle


def _touched_taxel(rest: Frame, lost: Mask, last: Frame) -> str:
    """Return the taxel near which something lies, by the change since `last`; "" if nothing."""
    ratio = (rest / last).astype(np.float64)
    change = ratio / np.median(ratio[~lost]) - 1.0
    if lost.any():
        change = TaxelInterpolator(*change.shape).fill(change, lost)
    if np.abs(change).mean() <= PreprocessSettings().gate or drift.shape(change) != "touch":
        return ""
    row, column = np.unravel_index(int(change.argmin()), change.shape)
    return notice("taxel_at", row, column)


def _doubts(frames: Frames, lost: Mask, idle: float, rate_hz: float) -> list[Row]:
    """Return doubts about a usable sensor."""
    rows = []
    if lost.any():
        words = notice("no_signal_goes_on", taxel_names(lost))
        rows.append(Row("leads", Verdict.DOUBTFUL, words, notice("doctor"), "leads"))
    if idle > NOISE_LIMIT_Z * np.sqrt(rate_hz / 10.0):
        words = notice("scatter", 100 * idle)
        rows.append(Row("noise", Verdict.DOUBTFUL, words, notice("doctor"), "noise"))
    if moved := common_drift(frames, lost, idle):
        words = notice("drifted", 100 * moved, CALIBRATION_S)
        rows.append(Row("drift", Verdict.DOUBTFUL, words, notice("drifted_advice"), "drift"))
    return rows


def _changes(rest: Frame, last: Frame) -> list[Row]:
    """Return how rest, (rows, columns), has changed since the last time, by cause."""
    why, rows = drift.causes(last, np.maximum(rest, 0.01)), []
    if abs(why.common) > COMMON_CHANGE_LOG_C:
        words = notice("pressure", 100 * np.expm1(why.common))
        advice = notice("pressure_advice") if why.common < 0 else ""
        rows.append(Row("pressure", Verdict.DOUBTFUL, words, advice, "pressure"))
    for word, sizes in (("row", why.rows), ("column", why.columns)):
        for i in np.flatnonzero(np.abs(sizes) > LINE_CHANGE_LOG_C).tolist():
            words, advice = notice("line", 100 * np.expm1(sizes[i])), notice("line_advice")
            rows.append(Row(notice(word, i), Verdict.DOUBTFUL, words, advice, "line"))
    return rows


# --- depth: a dome that stretches more shows the same touch as deeper -----------------------------


def calibrate_depth(loaded: Bundle, frames: Frames, depth_mm: float) -> tuple[Row, float | None]:
    """Return the row on touches of a depth, and the factor of estimated depths; None: refused.

    Args:
        loaded: A bundle that estimates depth.
        frames: Untouched for three seconds and then touched, at its rate, (n, rows, columns), pF.
        depth_mm: Of each touch.

    Raises:
        UserError: The bundle is for another sensor.
    """
    refuse_other(loaded, *frames.shape[1:])
    touches = _held(loaded, frames)
    if len(touches) < FEWEST_TOUCHES:
        felt = f"{len(touches)} touches of {HELD_S:.1f} s or more were felt"
        words = f"{felt}, {FEWEST_TOUCHES} are needed"
        return Row("depth", Verdict.FAULT, words, "press with one finger, and hold each"), None
    factor = depth_mm / float(np.median(touches))
    found = f"{len(touches)} touches of {depth_mm:.1f} mm look like {np.median(touches):.1f} mm"
    if not FACTOR_RANGE[0] <= factor <= FACTOR_RANGE[1]:
        return Row("depth", Verdict.FAULT, found, "check how deep they were"), None
    return Row("depth", Verdict.GOOD, found), factor


def refuse_other(loaded: Bundle, rows: int, columns: int) -> None:
    """Raise UserError if a bundle estimates no depth on so many taxels."""
    if loaded.contacts is None or (rows, columns) != (loaded.rows, loaded.columns):
        raise UserError(
            f"the bundle estimates depth on {loaded.rows}×{loaded.columns} taxels, not on "
            f"{rows}×{columns}; calibrate without --depth"
        )


def _held(loaded: Bundle, frames: Frames) -> list[float]:
    """Return the estimated depth of each touch of one finger that is held, mm."""
    pipeline = Pipeline(loaded.settings, NoGestures(len(loaded.labels)), Mapping())
    touches, depths = list[float](), list[float]()
    for number, frame in enumerate(frames, 1):
        contact = pipeline.step(frame.astype(np.float32), number / loaded.rate_hz).contact
        if contact is not None and contact.fingers == 1:
            depths.append(contact.depth_mm)
        elif contact is None:
            if len(depths) >= HELD_S * loaded.rate_hz:
                touches.append(float(np.median(depths[len(depths) // 4 : -len(depths) // 4])))
            depths = []
    return touches
