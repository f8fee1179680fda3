"""One finger on a large skin: it hardly moves the mean of all taxels, and is felt all the same."""

from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.noise import TaxelNoise
from controller.recognition.images.preprocess import Prepared, Preprocessor
from controller.shared.aliases import Frames

RATE_HZ: Final = 10
NOISE: Final = 0.004  # of a taxel
COMMON: Final = 0.004  # of all taxels at once: pressure
DRIFT: Final = 0.02  # of all taxels, a minute


def fingers(shape: tuple[int, int], count: int, depth: tuple[float, float]) -> Frames:
    """Fingers of two to three taxels' width anywhere on a grid, z of each, (count, *shape)."""
    rng, (y, x) = np.random.default_rng(7), np.indices(shape)
    found = []
    for deep in np.linspace(*depth, count):
        row, column = rng.uniform(0.0, np.array(shape) - 1.0)
        width = rng.uniform(2.0, 3.0) / 2.355  # at half its depth
        square = (y - row) ** 2 + (x - column) ** 2
        found.append(1.0 - deep * np.exp(-square / (2.0 * width**2)))
    return np.array(found, dtype=np.float32)


def sensed(z: Frames, seed: int = 3) -> Frames:
    """What a skin of unequal taxels reads of z, with noise and drift, (n, rows, columns), pF."""
    rng, n = np.random.default_rng(seed), len(z)
    rest = rng.normal(41.2, 2.9, z.shape[1:])
    drift = 1.0 - DRIFT * np.arange(n) / (60.0 * RATE_HZ)
    common = drift + COMMON * rng.standard_normal(n)
    noise = 1.0 + NOISE * rng.standard_normal(z.shape)
    return (rest * z * common[:, None, None] * noise).astype(np.float32)


def run(frames: Frames) -> tuple[NDArray[np.bool_], list[Prepared]]:
    """Return which frames are taken for touched, (n,), and all of each."""
    stage = Preprocessor(PreprocessSettings(rate_hz=RATE_HZ), *frames.shape[1:])
    steps = [stage.step(frame) for frame in frames]
    return np.array([step.ready and not step.quiet for step in steps]), steps


def held(shape: tuple[int, int], touch_s: float, pause_s: float, count: int) -> Frames:
    """Fingers held one after the other, with pauses before and after, z, (n, rows, columns)."""
    pause = np.ones((round(pause_s * RATE_HZ), *shape), dtype=np.float32)
    parts = [pause]
    for finger in fingers(shape, count, (0.03, 0.1)):
        parts += [np.repeat(finger[None], round(touch_s * RATE_HZ), axis=0), pause]
    return np.concatenate(parts)


@pytest.mark.parametrize("shape", [(12, 21), (40, 64)])
def test_a_light_finger_is_felt_as_long_as_it_is_held(shape: tuple[int, int]) -> None:
    z = held(shape, touch_s=10.0, pause_s=5.0, count=8)
    touched, steps = run(sensed(z))
    true = (z < 1.0 - 0.01).any(axis=(1, 2))
    assert touched[true].mean() >= 0.99
    assert touched[~true].mean() <= 0.005
    # The image of the last one, held for 10 s, is as deep as the finger: rest did not follow it.
    last = np.mean([step.image for step in steps[-100:-50]], axis=0)
    assert 1.0 - last.min() == pytest.approx(1.0 - z.min(), abs=0.02)


@pytest.mark.parametrize("shape", [(12, 21), (40, 64)])
def test_a_drifting_skin_that_is_brushed_now_and_then_stays_idle(shape: tuple[int, int]) -> None:
    z = held(shape, touch_s=0.3, pause_s=6.0, count=20)
    touched, _ = run(sensed(z))
    true = (z < 1.0).any(axis=(1, 2))
    assert touched[~true].mean() <= 0.005
    assert touched[true].mean() >= 0.95


def test_a_finger_that_was_there_from_the_start_is_forgotten_once_touches_show_the_sign() -> None:
    """Counts at rest at zero, of a sensor whose sign is unknown: its rest begins with a finger."""
    shape = (12, 21)
    first, *others = 300.0 * (1.0 - fingers(shape, 6, (0.5, 1.0)))
    pause = np.zeros((30, *shape))
    parts = [np.repeat(first[None] / 3.0, 15, axis=0), pause]
    for other in others:
        parts += [np.repeat(other[None], 30, axis=0), pause]
    counts = np.concatenate(parts) + np.random.default_rng(2).normal(0.0, 2.0, (345, *shape))
    stage = Preprocessor(PreprocessSettings("difference", 60.0), *shape)
    steps = [stage.step(frame) for frame in counts.astype(np.float32)]
    assert all(step.quiet for step in steps[-20:])
    assert not any(step.quiet for step in steps[-60:-35])
    assert stage.rest is not None
    assert np.abs(stage.rest).max() < 30.0


def test_on_a_sensor_of_few_taxels_the_mean_decides_alone() -> None:
    noise = TaxelNoise(PreprocessSettings(), (5, 5))
    image = np.ones((5, 5), dtype=np.float32)
    image[2, 2] = 0.2
    assert noise.strength(image) == 0.0
    assert not noise.touched(0.014, noise.strength(image))
    assert noise.touched(0.015, noise.strength(image))


def test_noise_that_has_doubled_is_no_touch_after_a_minute() -> None:
    quiet = sensed(np.ones((60 * RATE_HZ, 12, 21), dtype=np.float32))
    noisy = quiet * (1.0 + 0.008 * np.random.default_rng(4).standard_normal(quiet.shape))
    touched, _ = run(np.concatenate([quiet, noisy.astype(np.float32)]))
    assert touched[610:800].any()
    assert touched[-100:].mean() <= 0.02


def test_state_continues_exactly_and_an_older_one_learns_its_noise() -> None:
    frames = sensed(held((12, 21), touch_s=2.0, pause_s=3.0, count=3))
    whole, _ = run(frames)
    half = len(frames) // 2
    settings = PreprocessSettings(rate_hz=RATE_HZ)
    begun, other = Preprocessor(settings, 12, 21), Preprocessor(settings, 12, 21)
    for frame in frames[:half]:
        begun.step(frame)
    other.restore(begun.state())
    rest = [not other.step(frame).quiet for frame in frames[half:]]
    assert rest == whole[half:].tolist()
    older = Preprocessor(settings, 12, 21)
    older.restore({**begun.state(), "noise": np.zeros((12, 21))})
    for frame in frames[half:]:
        older.step(frame)
    assert older.state()["noise"] == pytest.approx(other.state()["noise"], rel=0.5)
