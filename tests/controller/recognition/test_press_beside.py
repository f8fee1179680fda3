"""A press beside a pinch that is still held, from the dome to the answers."""

import numpy as np
import pytest

from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.shared.aliases import Array
from controller.simulator.hand.gesture import min_jerk
from controller.simulator.hand.performance import SLOTS
from controller.simulator.orb import OrbSimulator, preset

RATE_HZ, LEAD_S, PERIOD_S, TIMES = 40.0, 3.0, 3.6, 6
REGION = 1.3  # grid units, of a command
USUAL = bundle.read(bundle.default_path())


def moved(time_s: Array, keys: list[float], values: list[float]) -> Array:
    """A course from value to value, (n,), each reached smoothly at its key."""
    course = np.full(len(time_s), values[0])
    for begin, end, before, after in zip(keys, keys[1:], values, values[1:], strict=False):
        course += (after - before) * min_jerk((time_s - begin) / (end - begin))
    return course


def answers(name: str) -> list[tuple[str, float]]:
    """What answers pinches that are held while a finger presses, and how far off, grid units."""
    orb = OrbSimulator(np.random.SeedSequence([35, 2]), RATE_HZ, SLOTS, preset(name))
    step_hz = RATE_HZ * orb.steps_per_frame
    steps = round((LEAD_S + TIMES * PERIOD_S) * step_hz)
    time_s = (np.arange(steps) / step_hz - LEAD_S) % PERIOD_S
    playing = np.arange(steps) >= LEAD_S * step_hz
    point, depth = np.zeros((steps, SLOTS), dtype=np.complex128), np.zeros((steps, SLOTS))
    for slot, side in enumerate((1.0, -1.0)):
        point[:, slot] = side * moved(time_s, [0.12, 0.45], [16.0, 8.0])
        depth[:, slot] = moved(time_s, [0.0, 0.12, 2.1, 2.2], [0.0, 6.0, 6.0, 0.0]) * playing
    point[:, 2] = 19j
    depth[:, 2] = moved(time_s, [1.2, 1.32, 1.72, 1.84], [0.0, 9.0, 9.0, 0.0]) * playing
    pipeline, found = Pipeline(USUAL.settings, Recognizer(USUAL), USUAL.mapping), []
    for number, frame in enumerate(orb.advance(point, depth, np.full((steps, SLOTS), 7.0)), 1):
        step = pipeline.step(frame, number / RATE_HZ)
        if step.gesture is not None:
            assert step.touch is not None
            found.append((step.gesture, float(np.hypot(step.touch[0] - 2.0, step.touch[1] - 3.9))))
    return found


@pytest.mark.parametrize(("name", "placed"), [("nominal", TIMES), ("paper-snr", TIMES - 1)])
def test_a_press_beside_a_held_pinch_is_answered_and_placed(name: str, placed: int) -> None:
    found = answers(name)
    assert [gesture for gesture, _ in found] == ["pinch", "press"] * TIMES
    away = np.array([distance for gesture, distance in found if gesture == "press"])
    assert (away < REGION).sum() >= placed
