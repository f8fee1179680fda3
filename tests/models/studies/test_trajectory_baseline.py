"""The baseline of sweeps sees a touch's place, width and strength, whatever the sensor counts."""

import numpy as np
import pytest

import tests.support.synthetic_people as look_alike
from controller.recordings import importer
from controller.recordings.description import described
from models.data.examples import Examples
from models.studies.sweep import trajectory_baseline
from tests.support import ROOT
from tests.support.model_commands import examples

WINDOW = 3
DESCRIPTION = ROOT / "docs" / "people" / "capfingerid.toml"


def windowed(images: np.ndarray) -> Examples:
    """Two windows of these six images."""
    return examples([0] * 6, images=images, ends=[2, 5], window=WINDOW)


X, Y = slice(0, WINDOW), slice(WINDOW, 2 * WINDOW)
SPREAD, TOTAL = slice(2 * WINDOW, 3 * WINDOW), slice(3 * WINDOW, 4 * WINDOW)


def moving() -> np.ndarray:
    """A finger over three rows that goes to the right, a taxel an image; the first is untouched."""
    images = np.ones((6, 6, 7), dtype=np.float32)
    for i in range(1, 6):
        images[i, 1:4, i] = 2.0, 3.0, 2.0
    return images


def test_the_plain_model_sees_where_a_touch_is_how_wide_and_how_strong() -> None:
    rows = trajectory_baseline.features(windowed(moving()))
    assert rows[1, X].tolist() == [3.0, 4.0, 5.0]
    assert rows[1, Y].tolist() == [2.0, 2.0, 2.0]
    assert rows[1, SPREAD].tolist() == pytest.approx([np.sqrt(0.5)] * 3)
    assert rows[1, TOTAL].tolist() == [4.0, 4.0, 4.0]
    assert rows[0, X].tolist() == [-1.0, 1.0, 2.0]  # nowhere, then it is touched


def test_a_signal_that_falls_under_touch_is_seen_like_one_that_rises() -> None:
    """A sensor whose counts fall gives the plain model the features of one whose counts rise."""
    up, down = windowed(moving()), windowed(np.float32(2.0) - moving())
    rising, falling = (trajectory_baseline.features(one) for one in (up, down))
    np.testing.assert_array_equal(rising, falling)
    assert (rising[1, TOTAL] > 0.0).all()


def test_a_taxel_that_is_read_wrongly_moves_no_centroid() -> None:
    images = moving()
    images[:, 5, 6] = 2.5  # alone in its corner, in every image
    images[4, 4, 0] = -3.0  # what is below untouched counts for nothing
    clean = trajectory_baseline.features(windowed(moving()))
    np.testing.assert_allclose(trajectory_baseline.features(windowed(images)), clean, rtol=1e-6)


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
