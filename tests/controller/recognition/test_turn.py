"""A twist is answered when it has turned farther than it is wound up, or back; a pinch has not."""

from dataclasses import replace

import numpy as np
import pytest

from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.contact import ContactEstimate
from controller.recognition.debounce import Debouncer, DebounceSettings
from controller.recognition.pipeline import Pipeline
from controller.recognition.turn import Turned, TurnTracker
from controller.simulator.hand.gesture import min_jerk
from controller.simulator.orb import OrbSimulator

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")
PRESS, PINCH, CW, CCW = range(1, 5)
RATE_HZ = 40.0
SETTINGS = DebounceSettings(smoothing=0.9, on=0.9, off=0.5, slow=("twist_cw", "twist_ccw"))
FINGERS = ContactEstimate(2.0, 2.0, 0.1, 6.0, 1.0, 3, 0.9, 0.0, 5.0, 0.0, 1.0)
USUAL = bundle.read(bundle.default_path())


def tracker() -> TurnTracker:
    return TurnTracker(CW, CCW, [PINCH])


def said(angles: list[float], touch_s: float, sigma: float = 5.0) -> Turned:
    """What a touch says whose angle has gone through these, degrees."""
    stage = tracker()
    for number, angle in enumerate(angles):
        contact = replace(FINGERS, angle_deg=angle, angle_sigma=sigma)
        stage.step(contact, begins=number == 0)
    return stage.says(touch_s)


@pytest.mark.parametrize(
    ("angles", "touch_s", "expected"),
    [
        ([0, -10, -25, -25], 0.4, Turned([CCW, CW, PINCH])),  # may be wound up
        ([0, -20, -60, -60], 0.4, Turned([CCW, PINCH], (), [CW])),  # too far for winding up
        ([0, -10, -25, -25], 0.7, Turned([CCW, PINCH], (), [CW])),  # and too long
        ([0, -30, -30, -12], 0.7, Turned([CCW, CW, PINCH])),  # it goes back
        ([0, -30, -15, 25, 25], 0.5, Turned([CW, PINCH], [CW, PINCH], [CCW])),  # it was wound up
        ([0, 2, -3, 1], 0.4, Turned([CCW, CW])),  # a pinch does not turn
        ([0, 2, -3, 1], 0.3, Turned([CCW, CW], doubted=[PINCH])),  # or not yet
    ],
)
def test_what_an_angle_says(angles: list[float], touch_s: float, expected: Turned) -> None:
    found = said(angles, touch_s)
    assert [sorted(one) for one in found] == [sorted(one) for one in expected]


def test_an_angle_that_is_not_sure_says_less() -> None:
    assert said([0, -20, -60, -60], 0.3, sigma=60.0).confirmed == []


def test_a_turn_begins_anew_with_each_touch_and_continues_from_its_state() -> None:
    one, other = tracker(), tracker()
    one.step(replace(FINGERS, angle_deg=-40.0), begins=True)
    other.restore(one.state())
    assert one.turning
    assert other.turning
    assert other.says(0.5) == one.says(0.5)
    one.step(FINGERS, begins=True)
    assert not one.turning
    other.step(None, begins=False)
    assert not other.turning  # nothing is there


def test_a_wound_twist_is_answered_once_by_the_way_it_turned_last() -> None:
    stage = Debouncer(LABELS, SETTINGS, RATE_HZ, tracker())
    angles = [0.0] * 4 + [-25.0] * 8 + [-10.0, 0.0, 10.0] + [35.0] * 12
    wrong, right = np.array([0, 0, 0, 0.99, 0.01]), np.array([0, 0, 0, 0.05, 0.95])
    found = []
    for angle in angles:
        contact = replace(FINGERS, angle_deg=angle)
        found.append(stage.step(right if angle > 5.0 else wrong, contact=contact))
    found.append(stage.step(np.array([1.0, 0, 0, 0, 0])))
    assert [one for one in found if one] == ["twist_ccw"]


@pytest.mark.parametrize(("probability", "after_s"), [(0.999, 0.05), (0.95, 0.35)])
def test_fingers_that_may_begin_to_turn_are_a_pinch_only_for_sure(
    probability: float, after_s: float
) -> None:
    stage, sure = Debouncer(LABELS, SETTINGS, RATE_HZ, tracker()), np.zeros(len(LABELS))
    sure[[0, PINCH]] = 1.0 - probability, probability
    found = [stage.step(sure, contact=FINGERS) for _ in range(20)]
    assert (found.index("pinch") + 1) / RATE_HZ == pytest.approx(after_s, abs=0.03)


@pytest.mark.parametrize("wound_deg", [0.0, 25.0])
def test_the_shipped_bundle_answers_a_twist_by_its_direction_wound_up_or_not(
    wound_deg: float,
) -> None:
    orb = OrbSimulator(np.random.SeedSequence(12), USUAL.rate_hz, 4)
    step_hz = USUAL.rate_hz * orb.steps_per_frame
    time_s = np.arange(round(6.0 * step_hz)) / step_hz - 3.0
    turned = 65.0 * min_jerk((time_s - 0.35) / 0.4) - wound_deg * min_jerk((time_s - 0.12) / 0.2)
    around = np.radians(np.array([180.0, -30.0, 0.0, 30.0]) + turned[:, None])
    deep = 6.0 * (min_jerk(time_s / 0.12) - min_jerk((time_s - 0.9) / 0.12))
    depth = np.repeat(deep[:, None], 4, axis=1)
    point = (18.0 * np.exp(1j * around)).astype(np.complex128)
    frames = orb.advance(point, depth, np.full(depth.shape, 6.5))
    pipeline = Pipeline(USUAL.settings, Recognizer(USUAL), USUAL.mapping)
    steps = [pipeline.step(frame, n / USUAL.rate_hz) for n, frame in enumerate(frames, 1)]
    assert [one.gesture for one in steps if one.gesture] == ["twist_ccw"]
