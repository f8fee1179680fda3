"""The skin at rest and under presses that are asked for: the doctor's checks that need a hand."""

from collections.abc import Callable, Iterator

import numpy as np

from controller.diagnostics import skin_checks, touch_checks
from controller.diagnostics.frame_source import Finger, FrameReader
from controller.diagnostics.report import Row, Verdict, faulty
from controller.shared.aliases import Frames, Mask
from controller.shared.taxel_measures import without_lead


def skin_rows(
    watch: FrameReader,
    bad: Mask,
    find: Callable[[FrameReader], Finger | None] | None,
) -> Iterator[Row]:
    """Yield what the skin says, at rest and under presses; SensorError.

    Args:
        watch: Source of the frames.
        bad: Taxels known to be of no use, (rows, columns); what is found is added.
        find: Returns what presses the sensor, None: nothing; called after the rest.
    """
    sensor = watch.sensor
    idle = watch.frames(skin_checks.IDLE_S)
    rest = skin_checks.rest(idle, sensor.rate_hz)
    yield from rest
    if any(row.code == "touched" for row in rest):
        return
    hand = None if find is None else find(watch)
    pressed = (
        [] if hand is None else _pressed(watch, hand, skin_checks.hold_s(idle, sensor.rate_hz))
    )
    grid = sensor.geometry
    touched = np.concatenate(pressed) if pressed else np.empty((0, grid.rows, grid.columns))
    yield from skin_checks.examine(idle, touched.astype(np.float32), bad)
    if not pressed:
        yield Row("touches", Verdict.UNKNOWN, "nobody pressed: leads that are swapped stay unseen")
        return
    level = idle.mean(axis=0).astype(np.float64)
    bad |= without_lead(level)
    means = np.array([frames.mean(axis=0) for frames in pressed])
    changes = means / np.where(level > 0.0, level, 1.0) - 1.0
    if any(touch_checks.unfelt(np.where(bad, 0.0, change)) for change in changes):
        yield Row(
            "touches",
            Verdict.DOUBTFUL,
            "some presses were hardly felt",
            "Press firmly, a centimetre deep, and start again.",
            "unfelt",
        )
    told = touch_checks.judge(changes, grid.pitch_mm, bad)
    yield from told
    if not faulty(told):
        yield Row("touches", Verdict.GOOD, f"{len(pressed)} presses were felt where they were made")


def _pressed(watch: FrameReader, hand: Finger, seconds: float) -> list[Frames]:
    """Return so many seconds of each press; [] if a press is missing."""
    grid = watch.sensor.geometry
    taken = []
    for place in touch_checks.places(grid.rows, grid.columns):
        if not hand.press(place):
            return []
        taken.append(watch.frames(seconds))
        hand.lift()
    return taken
