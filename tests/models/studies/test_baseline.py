"""The baseline of sweeps sees a touch's place, width and strength, whatever the sensor counts."""

import numpy as np
import pytest

import tests.support.synthetic_people as look_alike
from controller.recordings import importer
from controller.recordings.description import described
from models.studies.sweep import baseline
from tests.support import ROOT

WINDOW = 3
DESCRIPTION = ROOT / "docs" / "people" / "capfingerid.toml"


def windowed(images: np.ndarray) -> np.ndarray:
    """Two windows of these six images."""
    return images.reshape(2, WINDOW, *images.shape[1:])


def features(windows: np.ndarray) -> np.ndarray:
    return baseline.Signal.of(windows).features(windows)


TAXELS = 6 * 7
TRAJECTORY = slice(-TAXELS * 5)  # all but mean, deviation, maximum, share and one frequency
X, Y = slice(0, WINDOW), slice(WINDOW, 2 * WINDOW)
SPREAD, TOTAL = slice(2 * WINDOW, 3 * WINDOW), slice(3 * WINDOW, 4 * WINDOW)


def moving() -> np.ndarray:
    """A finger over three rows that goes to the right, a taxel an image; the first is untouched."""
    images = np.ones((6, 6, 7), dtype=np.float32)
    for i in range(1, 6):
        images[i, 1:4, i] = 2.0, 3.0, 2.0
    return images


def test_the_plain_model_sees_where_a_touch_is_how_wide_and_how_strong() -> None:
    rows = features(windowed(moving()))
    assert rows[1, X].tolist() == [3.0, 4.0, 5.0]
    assert rows[1, Y].tolist() == [2.0, 2.0, 2.0]
    assert rows[1, SPREAD].tolist() == pytest.approx([np.sqrt(0.5)] * 3)
    assert rows[1, TOTAL].tolist() == [4.0, 4.0, 4.0]
    assert rows[0, X].tolist() == [-1.0, 1.0, 2.0]  # nowhere, then it is touched


def test_a_signal_that_falls_under_touch_is_seen_like_one_that_rises() -> None:
    """A sensor whose counts fall gives the plain model the features of one whose counts rise."""
    up, down = windowed(moving()), windowed(np.float32(2.0) - moving())
    rising, falling = (features(one) for one in (up, down))
    np.testing.assert_array_equal(rising, falling)
    assert (rising[1, TOTAL] > 0.0).all()


def test_a_taxel_that_is_read_wrongly_moves_no_centroid() -> None:
    images = moving()
    images[:, 5, 6] = 2.5  # alone in its corner, in every image
    images[4, 4, 0] = -3.0  # what is below untouched counts for nothing
    clean = features(windowed(moving()))[:, TRAJECTORY]
    np.testing.assert_allclose(features(windowed(images))[:, TRAJECTORY], clean, rtol=1e-6)


def test_the_plain_model_sees_the_course_of_each_taxel() -> None:
    rows = features(windowed(moving()))[1]
    mean, deviation, greatest, share, wave = rows[rows.size - 5 * TAXELS :].reshape(5, 6, 7)
    assert greatest[2].tolist() == [0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 0.0]
    assert mean[2, 3] == pytest.approx(2.0 / 3.0)  # touched in one image of three
    assert share.sum() == pytest.approx(1.0)
    assert deviation[2, 3] == pytest.approx(np.std([2.0, 0.0, 0.0]))
    assert wave[2, 3] == pytest.approx(2.0)  # an impulse has every frequency
    assert not wave[5].any()


def test_shares_of_the_sum_are_the_same_at_half_the_strength() -> None:
    images = moving()[1:]
    halved = np.float32(0.5) * (images + np.float32(1.0))
    strong, weak = (baseline.shares(one) for one in (images, halved))
    np.testing.assert_allclose(weak[:, :-1], strong[:, :-1], rtol=1e-6)
    np.testing.assert_allclose(weak[:, -1], 0.5 * strong[:, -1], rtol=1e-6)
    assert strong[:, -3:-1].tolist() == [[float(x), 2.0] for x in range(1, 6)]


def test_the_description_that_ships_reads_what_looks_like_capfingerid() -> None:
    told = described(DESCRIPTION)
    made = list(importer.recordings(look_alike.arrays(people=2), told))
    assert [(r.origin.user, r.origin.session) for r in made] == [
        ("00", "leftthumb"), ("00", "rightthumb"), ("01", "leftthumb"), ("01", "rightthumb"),
    ]  # fmt: skip
    assert made[0].origin.labels == ("null", "drag", "scroll", "tap")
    # Frames over time; the one that is read twice in each stretch is dropped.
    kept = (look_alike.STRETCH - 2) / (look_alike.STRETCH - 1)
    assert made[0].origin.rate_hz == pytest.approx(kept / look_alike.STEP_S, abs=0.1)
    assert (np.diff(made[0].sequence) > 1).sum() == 8  # nine stretches
