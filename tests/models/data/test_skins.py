"""Simulated skins of many shapes, resampled onto one grid and rate."""

from dataclasses import replace

import numpy as np
import pytest

from controller.recordings.recording import Recording
from models.data import skins
from models.data.simulate import DataSet
from models.data.skins import Skins

SMALL = Skins(seed=3, minutes=0.5)


@pytest.fixture(scope="module")
def wide() -> Recording:
    """Half a minute of presses on a skin of 3 × 9 taxels at 10 Hz."""
    data = DataSet(seed=3, minutes=0.5, rate_hz=10.0, rows=3, columns=9, gestures=("press",))
    return data.session(0, 0)


def test_every_session_has_the_grid_and_the_rate_of_the_data_set() -> None:
    for user in range(4):
        made = SMALL.session(user, 0)
        origin = made.origin
        assert made.frames.shape[1:] == (6, 6) == (origin.rows, origin.columns)
        assert origin.rate_hz == 20.0
        assert len(made.t) == len(made.label) == len(made.frames) == len(made.touch)
        assert len(made.frames) / origin.rate_hz == pytest.approx(30.0, abs=0.2)


def test_skins_differ_in_shape_rate_and_stiffness() -> None:
    drawn = [SMALL.skin(np.random.default_rng(number)) for number in range(30)]
    assert len({(skin.rows, skin.columns) for skin in drawn}) > 15
    assert {skin.rate_hz for skin in drawn} == set(skins.RATES_HZ)
    assert {skin.preset for skin in drawn} == {"nominal", "paper-snr"}
    stretches = [skin.model().mechanics.apex_stretch for skin in drawn]
    assert max(stretches) - min(stretches) > 0.3


def test_the_same_seed_makes_the_same_session() -> None:
    first, again = (replace(SMALL, minutes=0.5).session(1, 0) for _ in range(2))
    assert np.array_equal(first.frames, again.frames)
    assert not np.array_equal(first.frames, SMALL.session(2, 0).frames[: len(first.frames)])


def test_a_plane_stays_a_plane_when_it_is_resampled(wide: Recording) -> None:
    rows, columns = np.mgrid[0:3, 0:9] / np.array([2.0, 8.0]).reshape(2, 1, 1)
    seconds = wide.t[:, None, None]
    plane = (seconds + 2.0 * rows + 5.0 * columns).astype(np.float32)
    made = skins.resampled(replace(wide, frames=plane), 6, 6, 20.0)
    rows, columns = np.mgrid[0:6, 0:6] / 5.0
    expected = made.t[:, None, None] + 2.0 * rows + 5.0 * columns
    np.testing.assert_allclose(made.frames, expected, atol=1e-4)
    np.testing.assert_allclose(np.diff(made.t), 1.0 / 20.0)


def test_labels_and_places_go_with_the_frames(wide: Recording) -> None:
    made = skins.resampled(wide, 6, 6, 20.0)
    assert made.label[::2].tolist() == wide.label.tolist()
    assert wide.truth is not None
    assert made.truth is not None
    pressed = np.isfinite(wide.truth.touch[:, 0])
    assert pressed.any()
    shares = wide.truth.touch[pressed] / (8.0, 2.0)  # of the grid's sides
    np.testing.assert_allclose(made.truth.touch[::2][pressed] / 5.0, shares, rtol=1e-6)
