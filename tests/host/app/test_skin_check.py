"""The quick check of the skin, on drawn images."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from host.app.skin_check import PRESS_S, QUARTERS, REST_S, SkinCheck, quarter

RATE_HZ = 40
Image = NDArray[np.float32]
Distort = Callable[[Image, np.random.Generator], None]


def checked(distort: Distort, *, rest: float = 0.0) -> SkinCheck:
    """Return a check after a rest at so large a change, and a press of every quarter."""
    check, rng, now_s = SkinCheck(), np.random.default_rng(1), 0.0
    while check.stage != "over":
        image = rng.normal(rest, 0.003, (5, 5)).astype(np.float32)
        if check.stage in QUARTERS:
            image[quarter((5, 5), check.stage)] -= 0.1
        distort(image, rng)
        check.step(image, now_s)
        now_s += 1 / RATE_HZ
        assert now_s < 2 * (REST_S + 4 * PRESS_S)
    return check


def sound(image: Image, rng: np.random.Generator) -> None:
    """Leave the image as it is."""


def test_sound_skin_has_no_fault() -> None:
    verdict = checked(sound).verdict
    assert (verdict.noisy, verdict.still, verdict.touched) == ((), (), False)


@pytest.mark.parametrize("place", [(0, 0), (2, 2), (4, 3)])
def test_taxel_that_never_answers_is_named(place: tuple[int, int]) -> None:
    def dead(image: Image, rng: np.random.Generator) -> None:
        image[place] = 0.0

    assert checked(dead).verdict.still == (place,)


def test_noisy_taxel_is_named() -> None:
    def leaky(image: Image, rng: np.random.Generator) -> None:
        image[1, 3] += rng.normal(0.0, 0.03)

    assert checked(leaky).verdict.noisy == ((1, 3),)


def test_check_ends_when_the_orb_is_touched_at_rest() -> None:
    verdict = checked(sound, rest=-0.08).verdict
    assert verdict.touched
    assert verdict.still == ()


def test_time_stands_still_until_the_quarter_is_pressed() -> None:
    check = SkinCheck()
    quiet = np.zeros((5, 5), np.float32)
    for frame in range(10 * RATE_HZ):
        check.step(quiet, frame / RATE_HZ)
    assert check.stage == QUARTERS[0]
    assert check.progress == 0.0


def test_a_press_of_another_quarter_does_not_count() -> None:
    check = SkinCheck()
    image = np.zeros((5, 5), np.float32)
    for frame in range(10 * RATE_HZ):
        pressed = check.stage == QUARTERS[0]
        image[1, 1], image[4, 4] = (-0.05, -0.1) if pressed else (0.0, 0.0)
        check.step(image, frame / RATE_HZ)
    assert (check.stage, check.progress) == (QUARTERS[0], 0.0)


def test_middle_taxels_belong_to_both_sides() -> None:
    marked = quarter((5, 5), "top_left")
    assert marked.sum() == 9
    assert marked[2, 2]
    assert not marked[3, 0]
