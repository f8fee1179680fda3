"""The radius of a touch: a finger until images show otherwise, and no press if too wide."""

import math
from dataclasses import replace

import numpy as np
import pytest

from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.contact_radius import ContactSettings, RadiusNetwork, features
from controller.recognition.pipeline import Pipeline
from controller.simulator.orb import OrbSimulator
from tests.support.loop_bench import SHIPPED, Certain

USUAL = bundle.read(bundle.default_path())
UNITS, FEATURES = 4, 52
PRIOR = (math.log(11.0), 0.5)
TOUCH = np.full((8, 5, 5), -0.1)


def always(radius_mm: float, variance: float) -> RadiusNetwork:
    """A network that estimates the same from any image; the variance is of its training's."""
    zeros = np.zeros((UNITS, UNITS), dtype=np.float32)
    said = (math.log(radius_mm) - PRIOR[0]) / PRIOR[1], math.log(variance)
    return RadiusNetwork(
        first=np.zeros((UNITS, FEATURES), dtype=np.float32),
        first_bias=zeros[0],
        second=zeros,
        second_bias=zeros[0],
        out=zeros[:2],
        out_bias=np.array(said, dtype=np.float32),
        prior=np.array(PRIOR, dtype=np.float32),
    )


def test_a_contact_is_a_finger_until_its_images_show_otherwise() -> None:
    finger, deviation = always(20.0, 0.01).log_radius(TOUCH[:1], 0.01)
    assert math.exp(finger) == pytest.approx(7.5)
    for network in (always(11.0, 1.0), always(20.0, 1.0)):  # no surer than before it looked
        assert network.log_radius(TOUCH, 0.01) == pytest.approx((finger, deviation))


@pytest.mark.parametrize("radius_mm", [6.0, 20.0])
def test_images_that_agree_make_sure_but_not_surer_than_people_and_orbs_vary(
    radius_mm: float,
) -> None:
    log_mm, deviation = always(radius_mm, 0.01).log_radius(TOUCH, 0.01)
    assert math.exp(log_mm) == pytest.approx(radius_mm, rel=0.1)
    assert 0.09 < deviation < 0.1
    assert ContactSettings().too_wide(log_mm, deviation) == (radius_mm > 12.0)


def test_features_do_not_depend_on_how_strong_a_touch_is_but_for_two() -> None:
    weak, strong = features(0.5 * TOUCH, 0.01), features(TOUCH, 0.01)
    assert weak.shape == (len(TOUCH) - 1, FEATURES)
    np.testing.assert_allclose(weak[:, :-2], strong[:, :-2], atol=0.03)
    assert (np.abs(weak[:, -2:] - strong[:, -2:]) > 0.05).all()


def test_a_contact_too_wide_for_its_gesture_is_not_answered_and_not_held() -> None:
    rest = np.full((5, 5), 40.0, dtype=np.float32)
    touched = rest.copy()
    touched[2, 1] *= 0.4
    frames = [rest] * 20 + [touched] * 20 + [rest] * 20
    noisy = ContactSettings(labels=("press",), quiet=0.0)
    frames = [frame + np.float32(0.02) * (k % 2) for k, frame in enumerate(frames)]
    for contact, held in (
        (ContactSettings(labels=("press",)), ""),
        (ContactSettings(labels=("pinch",)), "press"),
        (noisy, "press"),  # its images do not show a radius
    ):
        settings = replace(SHIPPED.settings, radius=always(20.0, 0.01), contact=contact)
        pipeline = Pipeline(settings, Certain(), SHIPPED.mapping)
        steps = [pipeline.step(frame, k / 10, k) for k, frame in enumerate(frames, 1)]
        assert [step.gesture for step in steps if step.gesture] == [held] * bool(held)
        assert steps[35].held == held


@pytest.mark.parametrize(
    ("radius_mm", "deviation", "wide"),
    [(8.0, 0.1, False), (20.0, 0.1, True), (20.0, 0.9, False)],  # a finger, an elbow, unsure
)
def test_a_touch_is_too_wide_where_its_radius_is_sure(
    radius_mm: float, deviation: float, wide: bool
) -> None:
    assert ContactSettings().too_wide(math.log(radius_mm), deviation) == wide


@pytest.mark.parametrize(("radius_mm", "answers"), [(7.0, ["press"]), (20.0, [])])
def test_the_shipped_bundle_answers_a_finger_and_no_elbow(
    radius_mm: float, answers: list[str]
) -> None:
    orb = OrbSimulator(np.random.SeedSequence(7), USUAL.rate_hz, 1)
    step_hz = USUAL.rate_hz * orb.steps_per_frame
    time_s = np.arange(round(4.0 * step_hz)) / step_hz
    depth = 8.0 * np.clip((0.25 - np.abs(time_s - 2.75)) / 0.12, 0.0, 1.0)[:, None]
    point = np.full(depth.shape, 8.0 + 3.0j)
    frames = orb.advance(point, depth, np.full(depth.shape, radius_mm))
    pipeline = Pipeline(USUAL.settings, Recognizer(USUAL), USUAL.mapping)
    steps = [pipeline.step(frame, k / USUAL.rate_hz) for k, frame in enumerate(frames, 1)]
    assert [step.gesture for step in steps if step.gesture] == answers
