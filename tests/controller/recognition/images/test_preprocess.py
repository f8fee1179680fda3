"""Rest, images and windows."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from controller.recognition.images.baseline import StoredBaseline
from controller.recognition.images.frames import PreprocessSettings, z_image
from controller.recognition.images.preprocess import Prepared, Preprocessor
from controller.recognition.images.rebaseline import Rebaseline

RATIO = PreprocessSettings()
REST_PF = np.linspace(36.0, 46.0, 25).reshape(5, 5)
OTHER_PF = np.random.default_rng(5).permutation(REST_PF.ravel()).reshape(5, 5)


def idle(seconds: float, seed: int = 0, noise: float = 0.003) -> NDArray[np.float32]:
    """Frames of an untouched sensor at 10 Hz."""
    rng = np.random.default_rng(seed)
    frames = REST_PF * (1.0 + noise * rng.standard_normal((round(seconds * 10), 5, 5)))
    return frames.astype(np.float32)


def pressed(seconds: float, depth: float = 0.3) -> NDArray[np.float32]:
    """The same with a finger that takes `depth` of the middle taxel's capacitance."""
    frames = idle(seconds, seed=1)
    frames[:, 1:4, 1:4] *= 1.0 - depth / 2
    frames[:, 2, 2] *= 1.0 - depth / 2
    return frames


def fresh() -> Preprocessor:
    return Preprocessor(PreprocessSettings(), 5, 5)


def felt(stage: Preprocessor, *pieces: NDArray[np.floating]) -> list[Prepared]:
    """What the stage makes of all frames of these pieces."""
    return [stage.step(frame) for frame in np.concatenate(pieces).astype(np.float32)]


def rested(seconds: float) -> Preprocessor:
    """A stage after this time of an untouched sensor."""
    stage = fresh()
    felt(stage, idle(seconds))
    return stage


def test_an_image_is_capacitance_over_rest_and_says_nothing_without_a_lead() -> None:
    frame = np.array([[30.0, 30.0, 30.0, 0.2, 40.0, 1.0]], dtype=np.float32)
    # Three that are well; one never had a lead, one is mended, one broke just now.
    rest = np.array([[30.0, 60.0, 15.0, 0.0, 1.0, 40.0]])
    assert z_image(frame, rest, RATIO).tolist() == [[1.0, 0.5, 2.0, 1.0, 1.0, 1.0]]


def test_a_sensor_that_reads_0_untouched_is_measured_by_its_difference() -> None:
    stage = Preprocessor(PreprocessSettings(normalise="difference", scale=400.0), 2, 2)
    for _ in range(10):
        stage.step(np.zeros((2, 2), dtype=np.float32))
    touched = stage.step(np.array([[400.0, 0.0], [100.0, 0.0]], dtype=np.float32))
    assert touched.ready
    assert touched.image.tolist() == [[2.0, 1.0], [1.25, 1.0]]
    assert not touched.quiet


@pytest.mark.parametrize(("normalise", "scale"), [("sum", 1.0), ("difference", 0.0)])
def test_a_normalisation_that_cannot_be_is_refused(normalise: str, scale: float) -> None:
    with pytest.raises(ValueError, match="ratio or difference, with a scale other than 0"):
        PreprocessSettings(normalise=normalise, scale=scale)


def test_frame_and_rest_of_different_shapes_are_refused_with_advice() -> None:
    with pytest.raises(ValueError, match=r"\(4, 4\).*\(5, 5\).*recalibrate"):
        z_image(np.ones((4, 4), np.float32), np.ones((5, 5)), RATIO)


def test_play_may_begin_after_one_quiet_second_with_a_whole_window() -> None:
    stage = fresh()
    assert [prepared.ready for prepared in felt(stage, idle(1.5))].index(True) == 9
    window = stage.window()
    assert window is not None
    assert window.shape == (10, 5, 5)
    assert np.abs(window - 1.0).max() < 0.02


def test_a_hand_that_is_still_moving_at_the_start_is_waited_for() -> None:
    stage, ramp = fresh(), np.linspace(0.7, 1.0, 20)[:, None, None]
    assert not any(prepared.ready for prepared in felt(stage, idle(2.0) * ramp, idle(0.1)))
    assert any(prepared.ready for prepared in felt(stage, idle(2.0)))


@pytest.mark.parametrize("rate_hz", [1.0, 2.0, 2.5, 5.0])
def test_a_noisy_sensor_comes_to_rest_however_slowly_it_is_read(rate_hz: float) -> None:
    """Two frames of 4 % noise differ by more than they scatter: more are asked for."""
    found = 0
    for seed in range(20):
        stage = Preprocessor(PreprocessSettings(rate_hz=rate_hz), 5, 5)
        frames = 40.0 * (1.0 + np.random.default_rng(seed).normal(0.0, 0.04, (12, 5, 5)))
        found += any(stage.step(frame.astype(np.float32)).ready for frame in frames)
    assert found == 20


def test_a_window_holds_the_latest_images_oldest_first() -> None:
    stage = fresh()
    images = [prepared.image for prepared in felt(stage, idle(2.0), pressed(1.0))]
    window = stage.window()
    assert window is not None
    np.testing.assert_array_equal(window, np.stack(images[-10:]))


@pytest.mark.parametrize(("change", "after"), [(1.2, 10), (0.8, 100)])
def test_a_rise_is_rest_after_a_second_and_an_even_fall_after_ten(
    change: float, after: int
) -> None:
    """No finger raises the mean; air and warmth do. Noise that has grown as well is no touch."""
    stage = rested(5.0)
    changed = felt(stage, idle(40.0, noise=0.02) * change)
    assert not any(prepared.quiet for prepared in changed[:after])
    assert all(prepared.quiet for prepared in changed[after + 1 :])


def test_a_dome_that_loses_air_in_play_is_followed_between_the_touches() -> None:
    stage, leak = rested(5.0), 1.0 - np.linspace(0.0, 0.2, 600)[:, None, None]
    touched = np.concatenate([pressed(0.4), idle(0.6)] * 60)
    felt(stage, touched * leak)
    assert stage.rest is not None
    assert float((stage.rest / REST_PF).mean()) == pytest.approx(0.8, abs=0.05)


def test_short_touches_never_add_up_to_a_new_sensor() -> None:
    stage = rested(5.0)
    for _ in range(10):
        touched, left = felt(stage, pressed(8.0)), felt(stage, idle(2.0, seed=3))
    assert touched[-1].deviation == pytest.approx(touched[0].deviation, rel=0.1)
    assert all(prepared.quiet for prepared in left)


def test_a_light_hand_on_a_noisy_skin_takes_less_of_rest_along() -> None:
    """Nearly all that it touches is quiet; followed at the usual pace it leaves rest at 0.978."""
    stage, quiet = fresh(), 0
    felt(stage, idle(5.0, noise=0.066))
    for touch in range(40):
        light = felt(stage, idle(0.6, seed=2 * touch, noise=0.066) * np.float32(0.93))
        quiet += sum(prepared.quiet for prepared in light)
        felt(stage, idle(0.7, seed=2 * touch + 1, noise=0.066))
    assert quiet > 0.9 * 240
    assert stage.rest is not None
    assert float((stage.rest / REST_PF).mean()) > 0.982


@pytest.mark.parametrize("to", [0.99, 1.01])
def test_a_quiet_skin_is_followed_at_the_usual_pace_wherever_it_goes(to: float) -> None:
    """A step is followed to within 1/e in the time constant: there noise hides no finger."""
    stage = fresh()
    felt(stage, idle(5.0, noise=0.002), idle(2.0, noise=0.002) * to)
    assert stage.rest is not None
    share = (float((stage.rest / REST_PF).mean()) - 1.0) / (to - 1.0)
    assert share == pytest.approx(1.0 - 1.0 / math.e, abs=0.05)


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_noisy_skin_that_drifts_fast_is_followed_down_as_well_as_up(way: float) -> None:
    stage = fresh()
    drift = 1.0 + way * np.linspace(0.0, 0.2, 600)[:, None, None]  # 20 % in a minute
    felt(stage, idle(60.0, noise=0.066) * drift)
    assert stage.rest is not None
    assert abs(float((stage.rest / (REST_PF * drift[-1])).mean()) - 1.0) < 0.015


def test_rest_is_frozen_for_four_tenths_of_a_second_after_a_touch() -> None:
    stage, same = fresh(), []
    felt(stage, idle(3.0), pressed(1.0))
    assert stage.rest is not None
    frozen = stage.rest.copy()
    for frame in idle(0.8, seed=7):
        stage.step(frame)
        same.append(np.array_equal(stage.rest, frozen))
    assert same == [True] * 4 + [False] * 4


@pytest.mark.parametrize("before", [[], [idle(5.0), pressed(3.0)]], ids=["start", "touch"])
def test_slow_drift_of_the_untouched_sensor_is_followed(before: list[NDArray[np.float32]]) -> None:
    drift = np.linspace(1.0, 1.1, 1200)[:, None, None]  # 10 % in two minutes
    last = felt(fresh(), *before, idle(120.0) * drift)[-1]
    assert last.quiet
    assert abs(float(last.image.mean()) - 1.0) < 0.01


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 60))
def test_a_restored_stage_continues_exactly(cut: int) -> None:
    frames = np.concatenate([idle(3.0), pressed(2.0), idle(2.0, seed=2)])
    whole, before, after = fresh(), fresh(), fresh()
    expected = [whole.step(frame) for frame in frames]
    for frame in frames[:cut]:
        before.step(frame)
    after.restore(before.state())
    for frame, wanted in zip(frames[cut:], expected[cut:], strict=True):
        got = after.step(frame)
        np.testing.assert_array_equal(got.image, wanted.image)
        assert (got.ready, got.quiet) == (wanted.ready, wanted.quiet)


def test_learning_after_a_frame_is_as_learning_with_it() -> None:
    whole, parts = fresh(), fresh()
    frames = [idle(3.0), pressed(1.0), idle(2.0), pressed(1.0, depth=0.2), idle(0.5)]
    frames[3][:, 1, :] = 0.0  # a lead is off
    for frame in np.concatenate(frames):
        one, other = whole.step(frame), parts.measure(frame)
        parts.learn()
        parts.learn()  # there is nothing left to learn
        assert one.quiet == other.quiet
        np.testing.assert_array_equal(one.image, other.image)
    end = parts.state()
    for name, array in whole.state().items():
        np.testing.assert_array_equal(array, end[name])


def test_what_a_busy_sensor_comes_back_to_again_and_again_is_its_rest() -> None:
    stage = rested(2.0)
    drifted = (idle(0.5) * 1.025).astype(np.float32)  # more than the gate, and never longer at rest
    for touch in range(12):
        for frame in (*pressed(0.6), *drifted):
            deviation = stage.step(frame).deviation
        assert touch < 10 or deviation < 0.01
    assert stage.step(idle(0.1)[0]).deviation == pytest.approx(0.024, abs=0.004)


def test_three_returns_make_a_rest_once_the_sensor_has_been_busy_for_long() -> None:
    returns = Rebaseline(PreprocessSettings(adopt_s=0.3))  # a third of it is long
    settled, found = REST_PF * 1.025, []
    for _ in range(3):
        for frame, deviation in ((REST_PF * 0.8, 0.2), *[(settled, 0.025)] * 3):
            found.append(returns.step(frame, deviation, REST_PF, 0.015))
    assert [one is None for one in found] == [True] * 11 + [False]
    assert found[-1] == pytest.approx(settled)


@pytest.mark.parametrize("lowered", [0.92, 0.8])
def test_a_finger_that_rests_again_and_again_on_a_dome_that_has_not_recovered_is_no_rest(
    lowered: float,
) -> None:
    returns = Rebaseline(PreprocessSettings(adopt_s=0.3))
    resting = REST_PF * lowered  # fast play keeps the rubber low, and a finger rests at the rim
    resting[1:4, 0] *= 0.75
    resting[1:4, 1] *= 0.9
    for _ in range(3):
        for frame, deviation in ((REST_PF * 0.6, 0.4), *[(resting, 0.12)] * 3):
            assert returns.step(frame, deviation, REST_PF, 0.015) is None


def test_one_hands_press_is_not_absorbed_while_the_other_hand_taps() -> None:
    stage, tap = rested(2.0), pressed(0.6)
    tap[:, :, :2] *= 0.6
    assert felt(stage, *[tap, pressed(0.5)] * 15)[-1].deviation > 0.05


# --- fingers that are there from the start, and for long ------------------------------------------


def test_a_press_of_ten_minutes_is_never_absorbed() -> None:
    stage = rested(5.0)
    touched = felt(stage, pressed(600.0))
    assert touched[-1].deviation == pytest.approx(touched[0].deviation, rel=0.1)
    assert all(prepared.quiet for prepared in felt(stage, idle(2.0, seed=4)))


def test_a_finger_that_was_there_from_the_start_is_noticed_when_it_leaves() -> None:
    stage = fresh()
    touched = felt(stage, pressed(10.0))[-1]
    assert touched.ready
    assert touched.quiet
    left = felt(stage, idle(5.0))
    assert not left[0].quiet
    assert all(prepared.quiet for prepared in left[11:])
    assert stage.rest == pytest.approx(REST_PF, rel=0.01)


# --- a calibration --------------------------------------------------------------------------------


def known(rest: NDArray[np.float64] = REST_PF) -> Preprocessor:
    stored = StoredBaseline(rest.astype(np.float32), 0.003)
    return Preprocessor(PreprocessSettings(), 5, 5, stored)


def test_with_a_calibration_play_may_begin_after_a_third_of_a_second() -> None:
    stage = known()
    prepared = felt(stage, idle(0.5) * 0.95)  # cooler today
    assert [one.ready for one in prepared] == [False, False, True, True, True]
    assert stage.window() is not None
    assert prepared[-1].quiet


def test_with_a_calibration_a_finger_from_the_start_is_a_touch_at_once() -> None:
    stage = known()
    prepared = felt(stage, pressed(5.0))
    assert prepared[3].ready
    assert not any(one.quiet for one in prepared)
    assert prepared[-1].image[2, 2] == pytest.approx(0.72, abs=0.1)
    assert felt(stage, idle(10.0))[-1].quiet
    assert stage.rest == pytest.approx(REST_PF, rel=0.02)


def test_a_calibration_of_a_sensor_that_is_another_today_is_given_up() -> None:
    stage = known(OTHER_PF)
    assert [prepared.ready for prepared in felt(stage, idle(2.0))].index(True) < 14
    assert stage.rest == pytest.approx(REST_PF, rel=0.01)


def followed(stage: Preprocessor, change: float, frames: int) -> list[float]:
    """How much of a change of the whole sensor rest has taken up, frame by frame."""
    shares = []
    for _ in range(frames):
        stage.step((REST_PF * (1.0 + change)).astype(np.float32))
        assert stage.rest is not None
        shares.append((stage.rest[0, 0] / REST_PF[0, 0] - 1.0) / change)
    return shares


@pytest.mark.parametrize(
    ("finger", "frames", "shares"),
    [
        (1.0, 3, [0, 1 / 11, 2 / 12]),  # one that holds: as the ten frames of a first second
        (1.0, 40, [1 / 20, 1 - (19 / 20) ** 2]),  # later a time constant of two seconds
        (0.85, 3, [0, 0, 0, 0, 1 / 2, 2 / 3, 3 / 4]),  # begun under a finger: as one frame
    ],
)
def test_a_calibration_weighs_as_frames(finger: float, frames: int, shares: list[float]) -> None:
    stage, image = known(), np.ones((5, 5))
    image[1:4, 1:4] = finger
    for _ in range(frames):
        stage.step((REST_PF * image).astype(np.float32))
    assert followed(stage, 0.01, len(shares)) == pytest.approx(shares, abs=1e-3)


def test_a_calibration_that_is_given_up_leaves_nothing_behind() -> None:
    given_up, without = known(OTHER_PF), fresh()
    for stage in (given_up, without):
        assert not any(prepared.ready for prepared in felt(stage, idle(0.3)))
    found, expected = given_up.state(), without.state()
    assert found.keys() == expected.keys()
    assert all(np.array_equal(found[name], expected[name], equal_nan=True) for name in found)


def test_a_calibration_of_another_shape_is_refused() -> None:
    with pytest.raises(ValueError, match="calibrate it again"):
        Preprocessor(PreprocessSettings(), 4, 5, StoredBaseline(REST_PF.astype(np.float32), 0.003))


# --- leads ----------------------------------------------------------------------------------------


def test_a_row_that_is_cut_off_in_a_touch_is_filled_in_and_comes_back_as_it_was() -> None:
    stage, cut = rested(5.0), pressed(60.0)
    whole = felt(stage, pressed(0.1))[0].image
    cut[:, 2] = 1.0
    filled = felt(stage, cut)
    assert max(np.abs(prepared.image - whole).max() for prepared in filled) < 0.15
    assert filled[-1].lost is not None
    assert np.argwhere(filled[-1].lost)[:, 0].tolist() == [2] * 5
    [prepared] = felt(stage, idle(0.1))
    assert prepared.lost is None
    assert prepared.quiet


def test_a_lead_that_is_mended_only_later_needs_no_new_start() -> None:
    stage, cut = fresh(), idle(5.0)
    cut[:, :, 1] = 1.0
    assert not any(prepared.deviation > 0.01 for prepared in felt(stage, cut))
    last = felt(stage, idle(3.0, seed=6))[-1]
    assert last.lost is None
    assert last.quiet
