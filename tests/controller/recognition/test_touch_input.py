"""The input of the location network: a crop around the touch, at one strength."""

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.recognition.images.frames import Image
from controller.recognition.touch_input import TouchInput

CROP = TouchInput(crop=15)
LEVEL = TouchInput(level=0.08)
GRID = 24, 30  # rows, columns


def finger(x: float, y: float, depth: float = 0.1, grid: tuple[int, int] = GRID) -> Image:
    """The image of a finger at a place, grid units: x to the right, y away from the user."""
    rows, columns = grid
    row, column = np.mgrid[:rows, :columns]
    square = (column - x) ** 2 + (rows - 1 - row - y) ** 2  # row 0 is the far side
    return np.asarray(1.0 - depth * np.exp(-square / 4.0), dtype=np.float32)


def seen(image: Image, settings: TouchInput) -> tuple[Image, NDArray[np.float32]]:
    """The input of one image, and its corner."""
    inputs, corners = settings.of(image[None])
    return inputs[0], corners[0]


def peak(image: Image) -> tuple[int, int]:
    """The place of the strongest taxel, (x, y)."""
    row, column = divmod(int(np.abs(image - 1.0).argmax()), image.shape[1])
    return column, image.shape[0] - 1 - row


def test_bundles_without_settings_and_small_grids_use_the_image_as_it_is() -> None:
    small = finger(1.0, 3.0, grid=(5, 5))
    for settings in (TouchInput(), CROP):
        image, corner = seen(small, settings)
        assert image.tobytes() == small.tobytes()
        assert corner.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("depth", [0.1, -0.1])  # of sensors that fall or rise under a touch
@pytest.mark.parametrize("x", [0, 3, 15, 22, 29])
@pytest.mark.parametrize("y", [0, 9, 12, 23])
def test_a_place_in_the_crop_plus_its_corner_is_the_place_on_the_grid(
    x: int, y: int, depth: float
) -> None:
    image, corner = seen(finger(x, y, depth), CROP)
    assert image.shape == (15, 15)
    assert (peak(image) + corner).tolist() == [x, y]


def test_a_crop_is_around_the_touch_and_stays_on_the_grid() -> None:
    assert seen(finger(15, 12), CROP)[1].tolist() == [15 - 7, 12 - 7]
    assert seen(finger(0, 0), CROP)[1].tolist() == [0, 0]
    assert seen(finger(29, 23), CROP)[1].tolist() == [30 - 15, 24 - 15]


def test_a_side_that_is_not_longer_than_the_crop_is_kept_whole() -> None:
    strip = finger(20, 2, grid=(5, 30))
    image, corner = seen(strip, CROP)
    np.testing.assert_array_equal(image, strip[:, 13:28])
    assert corner.tolist() == [13, 0]


def test_noise_of_a_fifth_of_a_touch_and_single_bad_taxels_do_not_move_the_crop_off_it() -> None:
    rng = np.random.default_rng(5)
    for _ in range(100):
        at = rng.uniform((0, 0), (29, 23))
        image = finger(*at) + 0.02 * rng.standard_normal(GRID).astype(np.float32)
        image[rng.integers(GRID[0]), rng.integers(GRID[1])] += 0.2
        inside = at - seen(image, CROP)[1]
        assert ((inside > -1.0) & (inside < 15.0)).all()


def test_of_two_fingers_the_crop_is_around_the_stronger() -> None:
    two = finger(4, 4, 0.08) + finger(25, 19, 0.12) - 1.0
    assert seen(two, CROP)[1].tolist() == [15, 9]
    assert (peak(seen(two, CROP)[0]) + seen(two, CROP)[1]).tolist() == [25, 19]


def test_a_turned_image_has_the_turned_crop() -> None:
    """So a network may learn from crops that are turned."""
    rng = np.random.default_rng(6)
    for _ in range(20):
        image = finger(*rng.uniform((0, 0), (29, 23)))
        crop, corner = seen(image, CROP)
        turned, other = seen(image[::-1, ::-1], CROP)
        np.testing.assert_array_equal(turned, crop[::-1, ::-1])
        assert (corner + other).tolist() == [30 - 15, 24 - 15]


@pytest.mark.parametrize("strength", [0.5, 2.0])
def test_a_weaker_or_stronger_touch_makes_the_same_input(strength: float) -> None:
    image = finger(1.3, 2.6, grid=(5, 5))
    usual, _ = seen(image, LEVEL)
    assert np.sqrt(np.square(usual - 1.0).mean()) == pytest.approx(0.08)
    other, _ = seen(1.0 + strength * (image - 1.0), LEVEL)
    np.testing.assert_allclose(other, usual, atol=1e-6)
    assert peak(usual) == peak(image)


def test_an_image_without_a_touch_stays_without() -> None:
    flat = np.ones(GRID, dtype=np.float32)
    image, _ = seen(flat, TouchInput(crop=15, level=0.08))
    assert (image == 1.0).all()


def test_many_images_are_treated_as_one_is() -> None:
    both = TouchInput(crop=15, level=0.08)
    images = np.stack([finger(3, 4), finger(20, 12), finger(28, 2)])
    inputs, corners = both.of(images)
    for image, one, corner in zip(images, inputs, corners, strict=True):
        assert (seen(image, both)[0] == one).all()
        assert (seen(image, both)[1] == corner).all()
    assert both.of(images[:0])[0].shape == (0, 15, 15)
