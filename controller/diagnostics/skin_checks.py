"""Checks of the skin at rest and under presses that are asked for."""

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np

from controller.diagnostics import touch_checks
from controller.diagnostics.frame_source import Finger, FrameReader
from controller.diagnostics.report import Row, Verdict, faulty
from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Prepared, Preprocessor
from controller.recognition.images.scale import PICOFARAD
from controller.shared import taxel_measures
from controller.shared.aliases import Frames, Mask
from controller.shared.notices import notice
from controller.shared.taxel_measures import taxel_names, without_lead

IDLE_S: Final = 6.0  # time without touch
HOLD_S: Final = (0.6, 3.0)  # of a press, the least and the most
PRESS_SCATTER_Z: Final = 0.02  # scatter that is left in the mean of a press
DRIFT_LIMIT_LOG_C: Final = 0.012  # of all taxels in some seconds: four times that of sound orbs
DRIFT_NOISE_RATIO: Final = 9.0  # of such a drift to its noise over idle, four medians of |z - 1|
USUAL_PF: Final = (15.0, 120.0)

_ADVICE: Final = {
    "stuck": notice("stuck_advice"),
    "saturated": notice("saturated_advice"),
    "loose": notice("loose_advice"),
    "short": notice("touching"),
    "noisy": notice("noisy_advice"),
}
_CODE: Final = {"loose": "open"}


def skin_rows(
    watch: FrameReader, bad: Mask, find: Callable[[FrameReader], Finger | None]
) -> Iterator[Row]:
    """Yield what the skin says, at rest and under presses; SensorError.

    Args:
        watch: Source of the frames.
        bad: Taxels known to be of no use, (rows, columns); what is found is added.
        find: Returns what presses the sensor, None: nothing; called after the rest.
    """
    sensor = watch.sensor
    idle = watch.frames(IDLE_S)
    yield from (rows := rest(idle, sensor.rate_hz))
    if any(row.code == "touched" for row in rows):
        return
    hand = find(watch)
    pressed = [] if hand is None else _pressed(watch, hand, hold_s(idle, sensor.rate_hz))
    grid = sensor.geometry
    touched = np.concatenate(pressed) if pressed else np.empty((0, grid.rows, grid.columns))
    yield from examine(idle, touched.astype(np.float32), bad)
    if not pressed:
        yield Row("touches", Verdict.UNKNOWN, notice("unpressed"))
        return
    level = idle.mean(axis=0).astype(np.float64)
    bad |= without_lead(level)
    means = np.array([frames.mean(axis=0) for frames in pressed])
    changes = means / np.where(level > 0.0, level, 1.0) - 1.0
    if any(touch_checks.unfelt(np.where(bad, 0.0, change)) for change in changes):
        words, advice = notice("unfelt"), notice("unfelt_advice")
        yield Row("touches", Verdict.DOUBTFUL, words, advice, "unfelt")
    told = touch_checks.judge(changes, bad)
    yield from told
    if not faulty(told):
        yield Row("touches", Verdict.GOOD, notice("presses", len(pressed)))


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


def rest(frames: Frames, rate_hz: float) -> list[Row]:
    """Return whether anything touched the skin, and whether it drifts; frames at rest, in order."""
    steps = prepared(frames, rate_hz)
    if not any(step.ready for step in steps):
        return [touched_row(notice("no_quiet", len(frames) / rate_hz))]
    middle, idle = float(np.median(frames)), steps[-1].idle
    rows = [Row("rest", Verdict.GOOD, notice("scatters", 100 * idle))]
    if not USUAL_PF[0] < middle < USUAL_PF[1]:
        words, advice = notice("level", middle), notice("level_advice")
        rows.append(Row("level", Verdict.DOUBTFUL, words, advice, "level"))
    moved = common_drift(frames, without_lead(frames.mean(axis=0)), idle)
    if moved < 0.0:
        minutes = len(frames) * 2 / 3 / rate_hz / 60.0
        words, advice = notice("leaks", -100 * moved / minutes), notice("leaks_advice")
        rows.append(Row("air", Verdict.FAULT, words, advice, "air_leak"))
    return rows


def prepared(frames: Frames, rate_hz: float) -> list[Prepared]:
    """Return what preprocessing makes of frames, without interpolation."""
    stage = Preprocessor(PreprocessSettings(rate_hz=rate_hz), *frames.shape[1:], mend=False)
    return [stage.step(frame) for frame in frames]


def touched_row(why: str) -> Row:
    """Return the row of a sensor that was touched when it should not be."""
    return Row("rest", Verdict.FAULT, why, notice("hands_off"), "touched")


def common_drift(frames: Frames, lost: Mask, idle: float) -> float:
    """Return by how much all taxels alike have drifted, ln C; 0.0 if that is within the noise."""
    third = max(1, len(frames) // 3)
    ends = (np.maximum(part.mean(axis=0), 0.01) for part in (frames[:third], frames[-third:]))
    before, after = (np.log(end[~lost]) for end in ends)
    if not before.size:
        return 0.0
    moved = float(np.median(after - before))
    limit = DRIFT_LIMIT_LOG_C + DRIFT_NOISE_RATIO * idle / np.sqrt(third * before.size)
    return moved if abs(moved) > limit else 0.0


def hold_s(idle: Frames, rate_hz: float) -> float:
    """Return how long a press is held, so that noise is averaged out of it, seconds."""
    level = idle.mean(axis=0)
    scatter = float(np.median(idle.std(axis=0) / np.where(level > 0.0, level, np.inf)))
    return float(np.clip((scatter / PRESS_SCATTER_Z) ** 2 / rate_hz, *HOLD_S))


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
