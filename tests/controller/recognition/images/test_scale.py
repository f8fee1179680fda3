"""Sensors of other units: rest at zero, rising and falling, with and without a known scale."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Prepared, Preprocessor
from controller.recognition.images.scale import FIRM, SKIN, Signal

SETTINGS = PreprocessSettings(rate_hz=10.0)
COUNTS = Signal("counts")


def touches(size: float, noise: float = 0.0) -> NDArray[np.float32]:
    """A minute of a 2×2 sensor at rest at zero: a touch of two seconds every four, from second 4.

    It changes the mean of all taxels by `size`.
    """
    frames = noise * np.random.default_rng(1).standard_normal((600, 2, 2))
    seconds = np.arange(600) // 10
    frames[(seconds >= 4) & (seconds % 4 < 2)] += size
    return frames.astype(np.float32)


def run(frames: NDArray[np.float32], signal: Signal) -> tuple[list[Prepared], Preprocessor]:
    stage = Preprocessor(SETTINGS, *frames.shape[1:], signal=signal)
    return [stage.step(frame) for frame in frames], stage


@pytest.mark.parametrize(("sign", "size"), [(-1, -500.0), (1, 500.0), (1, 0.02)])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_every_touched_frame_is_felt_and_lowers_z(sign: int, size: float, noise: float) -> None:
    frames = touches(size, noise * abs(size))
    steps, stage = run(frames, Signal("counts", sign))
    touched = np.abs(touches(size)).mean(axis=(1, 2)) > 0.0
    felt = np.array([step.ready and not step.quiet for step in steps])
    assert (felt == touched).all()
    assert all(step.image.mean() < 1.0 for step in np.array(steps, dtype=object)[touched])
    assert abs(stage.settings.scale) == pytest.approx(abs(size) / FIRM, rel=0.05)


def test_a_firm_touch_is_as_strong_as_on_the_orb_once_the_scale_is_known() -> None:
    known, _ = run(touches(-500.0), Signal("counts", scale=500.0 / FIRM))
    assert known[45].deviation == pytest.approx(FIRM)
    learned, _ = run(touches(-500.0), COUNTS)
    assert learned[45].deviation == pytest.approx(FIRM)  # of the first touch, in its first second


def test_the_skin_in_picofarads_is_divided_by_rest_as_before() -> None:
    assert SKIN.fit(SETTINGS) is SETTINGS
    trained = PreprocessSettings(normalise="difference", scale=300.0)
    assert COUNTS.fit(trained) is trained  # a bundle of its own has its own scale
    assert Signal("pF", 1).fit(SETTINGS).normalise == "difference"


def test_a_sensor_of_zeros_only_is_never_touched_and_divides_by_nothing() -> None:
    steps, _ = run(np.zeros((100, 2, 2), dtype=np.float32), COUNTS)
    assert all(step.quiet and np.isfinite(step.image).all() for step in steps if step.ready)


def test_state_continues_exactly_and_a_new_rest_keeps_the_scale() -> None:
    frames = touches(-500.0, noise=3.0)
    _, whole = run(frames, COUNTS)
    for cut in (5, 45, 300):
        _, begun = run(frames[:cut], COUNTS)
        other = Preprocessor(SETTINGS, 2, 2, signal=COUNTS)
        other.restore(begun.state())
        steps = [other.step(frame) for frame in frames[cut:]]
        assert other.settings.scale == whole.settings.scale
        np.testing.assert_array_equal(steps[-1].image, run(frames, COUNTS)[0][-1].image)
    fresh = whole.anew()
    for frame in frames[:20]:
        fresh.step(frame)
    assert fresh.rest is not None
    assert fresh.settings.scale == whole.settings.scale


def test_a_state_without_a_scale_is_refused() -> None:
    stage = Preprocessor(SETTINGS, 2, 2, signal=COUNTS)
    with pytest.raises(ValueError, match="scale that is not above zero"):
        stage.restore({**stage.state(), "scale": np.zeros(1)})


def test_a_scale_that_was_learned_before_is_not_learned_again() -> None:
    _, whole = run(touches(-500.0), COUNTS)
    assert whole.learned == pytest.approx(500.0 / FIRM)
    assert run(touches(-500.0)[:60], COUNTS)[1].learned == 0.0  # 2 of the 6 seconds
    again = Preprocessor(SETTINGS, 2, 2, signal=replace(COUNTS, learned=whole.learned))
    steps = [again.step(frame) for frame in touches(-500.0)[:60]]
    assert steps[40].deviation == pytest.approx(FIRM)  # the first frame of the first touch
    assert again.learned == whole.learned
    copy = Preprocessor(SETTINGS, 2, 2, signal=COUNTS)  # as a recording of it is replayed
    copy.restore(again.state())
    assert copy.learned == whole.learned


def test_a_sensor_divided_by_rest_learns_no_scale() -> None:
    assert Preprocessor(SETTINGS, 2, 2).learned == 0.0
