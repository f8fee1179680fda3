"""Position error: measured from errors, and reported with every touch."""

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.recognition.touch_position import PositionSpread
from models.evaluation.scores import position_spread, within

RNG = np.random.default_rng(5)
BLUR = RNG.uniform(0.01, 0.15, 4000)


def errors(spread: PositionSpread) -> NDArray[np.float64]:
    """Return errors of places that are so far off."""
    sigma = np.array([spread.sigma(blur) for blur in BLUR])
    drawn: NDArray[np.float64] = RNG.standard_normal((len(BLUR), 2)) * sigma[:, None]
    return drawn


def test_errors_tell_how_far_off_places_are() -> None:
    found = position_spread(BLUR, errors(PositionSpread(0.07, 3.0)))
    assert found is not None
    assert found.floor == pytest.approx(0.07, rel=0.1)
    assert found.noise == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize("true", [PositionSpread(0.1, 0.0), PositionSpread(0.0, 2.0)])
def test_one_cause_may_be_all_there_is(true: PositionSpread) -> None:
    found = position_spread(BLUR, errors(true))
    assert found is not None
    for blur in (0.02, 0.1):
        assert found.sigma(blur) == pytest.approx(true.sigma(blur), rel=0.1)


def test_of_normal_errors_two_thirds_are_within_one_deviation_and_19_of_20_within_two() -> None:
    true = PositionSpread(0.07, 3.0)
    one, two = within(np.array([true.sigma(blur) for blur in BLUR]), errors(true))
    assert one == pytest.approx(0.683, abs=0.02)
    assert two == pytest.approx(0.954, abs=0.01)


def test_a_handful_of_presses_tells_nothing() -> None:
    assert position_spread(BLUR[:5], errors(PositionSpread(0.1, 1.0))[:5]) is None
    assert position_spread(np.full(4000, np.nan), errors(PositionSpread(0.1, 1.0))) is None
