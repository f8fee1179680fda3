"""Calibration of a sensor from frames, judged and stored."""

from datetime import datetime
from pathlib import Path

from controller.diagnostics.report import Row, Verdict
from controller.diagnostics.skin_checks import calibrate
from controller.sensors import calibration_store
from controller.sensors.base import Sensor
from controller.sensors.calibration_store import Calibration
from controller.shared.aliases import Frames


def keep(
    sensor: Sensor, frames: Frames, now: datetime, *, anyway: bool = False
) -> tuple[list[Row], Path | None]:
    """Return the rows on a calibration, and the file that it is kept in; None: it is refused.

    `frames` are of the untouched sensor, as of `skin_checks.calibrate`, which has `anyway`, too.
    """
    last = calibration_store.load(sensor.device_id)
    before = None if last is None else last.rest
    rows, rest, idle = calibrate(frames, sensor.rate_hz, before, anyway=anyway)
    if rest is None:
        return rows, None
    verdict = "good" if all(row.verdict is Verdict.GOOD for row in rows) else "doubtful"
    made = now.isoformat(timespec="seconds")
    kept = Calibration(sensor.device_id, rest, idle, made, verdict, sensor.rate_hz)
    return rows, calibration_store.save(kept)
