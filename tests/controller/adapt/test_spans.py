"""The touch of an example is found where the simulated hand made it, on quiet and noisy sensors."""

import numpy as np
import pytest

from controller.adapt.examples import Example, touched, vary
from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Preprocessor
from controller.simulator.hand.user_style import person
from controller.simulator.orb import preset
from controller.simulator.session import simulate

RATE_HZ = 40.0
NEAR_S = 0.15
BEFORE_S, AFTER_S = 1.5, 0.45  # of an example


def errors(noise: str, label: str) -> np.ndarray:
    """How late begin and end of each touch of a session are found, seconds, (touches, 2)."""
    played = simulate(
        np.random.SeedSequence([7, 2]).spawn(5), 0.6, style=person(7, 2), rate_hz=RATE_HZ,
        model=preset(noise), protocol="free", gestures=(label,),
    )  # fmt: skip
    stage = Preprocessor(PreprocessSettings(rate_hz=RATE_HZ), 5, 5)
    images = np.array([stage.step(frame).image for frame in played.frames])
    late = []
    for event in played.events:
        if event.kind == label and event.onset_s > 3.0:
            times = event.onset_s - BEFORE_S, event.release_s + AFTER_S
            first, end = np.searchsorted(played.time_s, times)
            span = np.array(touched(images[first:end], RATE_HZ)[-1].span)
            seconds = played.time_s[first] + span / RATE_HZ
            late.append(seconds - (event.onset_s, event.release_s))
    return np.array(late)


@pytest.mark.parametrize("label", ["press", "swipe", "twist_cw"])
@pytest.mark.parametrize("noise", ["nominal", "paper-snr"])
def test_a_touch_is_found_where_it_was_made(noise: str, label: str) -> None:
    near = (np.abs(errors(noise, label)) <= NEAR_S).all(axis=1)
    assert len(near) >= 8
    assert near.mean() >= 0.9


def finger(seconds: tuple[float, ...], noise: float, most: float = 0.25) -> np.ndarray:
    """Three seconds of images; a finger is down from the first second to the second, and so on."""
    t = np.arange(3.0 * RATE_HZ) / RATE_HZ
    row, column = np.mgrid[:5, :5]
    dent = most * np.exp(-(np.square(row - 2) + np.square(column - 1)) / 3.0)
    down = sum((t >= a) & (t < b) for a, b in zip(seconds[::2], seconds[1::2], strict=True))
    z = 1.0 - np.multiply.outer(np.asarray(down, dtype=np.float64), dent)
    rng = np.random.default_rng(5)
    return np.asarray(z + noise * rng.normal(size=z.shape), dtype=np.float32)


@pytest.mark.parametrize("noise", [0.0, 0.03, 0.12])
def test_noise_of_single_frames_makes_a_touch_no_longer(noise: float) -> None:
    (touch,) = touched(finger((1.8, 2.05), noise), RATE_HZ)
    assert np.array(touch.span) / RATE_HZ == pytest.approx((1.8, 2.05), abs=0.1)


def test_the_short_touch_after_a_long_one_belongs_to_it() -> None:
    """One that would be noise on a noisy sensor, were it smaller yet."""
    (touch,) = touched(finger((1.0, 1.5, 1.75, 1.95), 0.003), RATE_HZ)
    assert np.array(touch.span) / RATE_HZ == pytest.approx((1.0, 1.95), abs=0.1)


def test_an_example_keeps_the_rest_around_its_touch_and_no_other_touch() -> None:
    one = Example("tap", finger((0.2, 0.5, 1.5, 1.9), 0.03)).found(RATE_HZ)
    assert one is not None
    assert one.span is not None
    begin, end = np.array(one.span) / RATE_HZ
    assert end - begin == pytest.approx(0.4, abs=0.1)
    assert 0.1 < begin < 1.0
    assert len(one.images) / RATE_HZ - end == pytest.approx(1.1, abs=0.1)


def test_all_touches_within_a_label_belong_to_it_and_its_edges_move_to_them() -> None:
    """A label that begins .3 s early and ends .2 s late."""
    taps = finger((0.5, 0.8, 1.4, 1.7, 2.3, 2.6), 0.003)
    one = Example("taps", taps).labelled(round(0.2 * RATE_HZ), round(2.8 * RATE_HZ), RATE_HZ)
    assert one.span is not None
    assert np.array(one.span) / RATE_HZ == pytest.approx((0.5, 2.6), abs=0.1)
    windows, telling = vary(one, 40, 1, np.random.default_rng(0))
    assert len(windows) == len(telling) < len(taps)  # what is near an edge is left out


def test_a_light_touch_counts_where_a_label_names_it() -> None:
    light = finger((1.2, 1.8), 0.0, most=0.02)
    assert touched(light, RATE_HZ) == []
    one = Example("tap", light).labelled(48, 72, RATE_HZ)
    assert one.span == (48.0, 72.0)
    telling = vary(one, 10, 1, np.random.default_rng(0))[1]
    assert (telling > 0.9).sum() >= 10
