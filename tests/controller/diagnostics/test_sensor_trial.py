"""The trial of a sensor judges each taxel by its own noise, and names what does not answer."""

import numpy as np
import pytest

from controller.diagnostics.sensor_trial import Trial, examine

SHAPE = (12, 21)


def frames(seed: int, shape: tuple[int, int] = SHAPE, count: int = 250) -> np.ndarray:
    """Return noise of deviation 1 around 500, (count, rows, columns)."""
    noise = np.random.default_rng(seed).normal(500.0, 1.0, (count, *shape))
    return noise.astype(np.float32)


def row(trial: Trial, name: str) -> str:
    """Return verdict and words of a row."""
    return next(f"{one.verdict} {one.found}" for one in trial.rows if one.name == name)


@pytest.mark.parametrize(("shape", "change"), [(SHAPE, 267.0), ((5, 5), 27.0)])
def test_one_finger_on_one_taxel_is_a_touch(shape: tuple[int, int], change: float) -> None:
    touched = frames(2, shape)
    touched[100:150, 3, 4] += change
    trial = examine(frames(1, shape), touched, 50.0, "counts")
    assert trial.sign == "rises"
    assert row(trial, "taxels").startswith("doubtful 1 of ")
    assert not any(one.name == "hands" for one in trial.rows)


def test_noise_alone_is_no_touch_even_where_readings_seldom_change() -> None:
    for rest, later in [(frames(1), frames(2)), (frames(1).round(), frames(2).round())]:
        assert examine(rest, later, 50.0, "counts").sign is None
    rest, later = (np.random.default_rng(3).random((2, 250, 5, 5)) < 0.02).astype(np.float32)
    assert examine(rest, later, 50.0, "counts").sign is None


def test_a_finger_that_comes_too_early_is_named_and_the_touch_is_seen() -> None:
    rest, touched = frames(1), frames(2)
    rest[200:, 3, 4] -= 90.0
    touched[:100, 3, 4] -= 90.0
    trial = examine(rest, touched, 50.0, "counts")
    assert row(trial, "hands") == "doubtful moved before the call: taxel row 3, column 4"
    assert trial.sign == "falls"


def test_a_finger_that_comes_too_early_on_a_skin_without_noise_is_no_noise() -> None:
    rest, touched = np.zeros((2, 50, 3, 4), np.float32)
    rest[-1, 1, 2], touched[10:20, 1, 2] = 200.0, 200.0
    trial = examine(rest, touched, 20.0, "counts")
    assert row(trial, "hands") == "doubtful moved before the call: taxel row 1, column 2"
    assert trial.sign == "rises"


def test_a_noisy_taxel_is_no_finger_and_a_quiet_one_is_felt_beside_it() -> None:
    rest, touched = frames(1), frames(2)
    for part in (rest, touched):
        part[:, 0, 0] = 500.0 + 40.0 * (part[:, 0, 0] - 500.0)
    assert examine(rest, touched, 50.0, "counts").sign is None
    touched[100:150, 3, 4] += 30.0
    assert examine(rest, touched, 50.0, "counts").sign == "rises"


@pytest.mark.parametrize("reading", [65535.0, 0.0])
def test_a_missing_chip_does_not_answer_and_spoils_no_range(reading: float) -> None:
    rest, touched = frames(1), frames(2)
    touched[100:150, 3, 4] += 90.0
    rest[:, 6:], touched[:, 6:] = reading, reading
    trial = examine(rest, touched, 50.0, "counts")
    words = f"FAULT does not answer: rows 6, 7, 8, 9, 10 and 11, reads {reading:g}"
    assert row(trial, "readings") == words
    assert row(trial, "range").startswith("good 49")
    assert trial.sign == "rises"


def test_a_sensor_of_which_nothing_answers_is_not_looked_at_further() -> None:
    nothing = np.full((50, 5, 5), 65535.0, np.float32)
    trial = examine(nothing, nothing, 50.0, "counts")
    assert [one.name for one in trial.rows] == ["readings"]
    assert trial.sign is None
