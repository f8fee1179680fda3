"""Drift: what it looks like, and what causes it."""

import numpy as np
import pytest

from controller.recognition.images import drift
from controller.shared.aliases import Change
from controller.simulator.orb import OrbSimulator


def pressed(x_mm: float = 0.0, y_mm: float = 0.0) -> Change:
    """z - 1 under a finger that has lain there for five seconds."""
    orb = OrbSimulator(np.random.SeedSequence(4))
    steps = 60 * orb.steps_per_frame
    depth = np.zeros((steps, 6))
    depth[steps // 6 :, 0] = 8.0
    point = np.zeros((steps, 6), dtype=np.complex128)
    point[:, 0] = complex(x_mm, y_mm)
    frames = orb.advance(point, depth, np.full((steps, 6), 7.0)).astype(np.float64)
    return np.asarray(frames[-20:].mean(axis=0) / frames[:9].mean(axis=0) - 1.0)


@pytest.mark.parametrize("place", [(0.0, 0.0), (20.0, 20.0), (-10.0, 5.0), (0.0, -20.0)])
def test_a_press_looks_like_a_touch_and_its_end_like_a_lift(place: tuple[float, float]) -> None:
    change = pressed(*place)
    assert drift.shape(change) == "touch"
    assert drift.shape(1.0 / (1.0 + change) - 1.0) == "lifted"


def test_no_change_is_not_smooth() -> None:
    assert drift.smoothness(np.zeros((5, 5))) == 0.0
    assert drift.smoothness(np.ones((1, 1))) == 0.0  # without neighbours
    assert drift.smoothness(np.ones((5, 5))) == 1.0


def test_no_change_is_even() -> None:
    assert drift.unevenness(np.zeros((5, 5))) == 0.0


def test_air_and_warmth_change_all_taxels_alike() -> None:
    rng = np.random.default_rng(1)
    assert drift.shape(-0.1 + 0.005 * rng.standard_normal((5, 5))) == "common"
    assert drift.shape(0.1 + 0.005 * rng.standard_normal((5, 5))) == "common"


def test_an_electrode_changes_its_line_and_the_film_its_taxel() -> None:
    row, taxel = np.zeros((5, 5)), np.zeros((5, 5))
    row[3] = -0.4
    taxel[1, 2] = -0.3
    assert drift.shape(row) == drift.shape(row.T) == "electrode"
    assert drift.shape(taxel) == "film"


def test_what_each_taxel_does_by_itself_is_scattered() -> None:
    rng = np.random.default_rng(2)
    shapes = [drift.shape(0.05 * rng.standard_normal((5, 5))) for _ in range(50)]
    assert shapes.count("scattered") > 40
    assert drift.shape(np.zeros((5, 5))) == "scattered"


def test_the_causes_of_a_drift_add_up_to_it() -> None:
    rng = np.random.default_rng(4)
    before, now = rng.uniform(30.0, 50.0, (2, 5, 5))
    causes = drift.causes(before, now)
    sum_of_all = causes.common + causes.rows[:, None] + causes.columns + causes.film
    assert sum_of_all == pytest.approx(np.log(now / before))
    assert np.median(causes.rows) == np.median(causes.columns) == 0.0


def test_each_cause_of_a_drift_is_told_apart() -> None:
    before = np.random.default_rng(3).normal(41.2, 2.9, (5, 5))
    now = before * 0.9
    now[1] *= 1.2
    now[:, 4] *= 0.7
    now[3, 0] *= 2.0
    causes = drift.causes(before, now)
    assert causes.common == pytest.approx(np.log(0.9))
    assert causes.rows == pytest.approx(np.log([1, 1.2, 1, 1, 1]))
    assert causes.columns == pytest.approx(np.log([1, 1, 1, 1, 0.7]))
    assert causes.film[3, 0] == pytest.approx(np.log(2.0))
    assert np.abs(np.delete(causes.film.ravel(), 15)).max() < 1e-9
