"""The image of a touch: its frames laid over each other."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.recognition.images.frames import Image
from controller.recognition.touch_position import ContactLevel, PositionSpread, TouchImage

QUIET = np.ones((5, 5), dtype=np.float32)


def finger(x: int, depth: float = 0.2) -> Image:
    """The image of a finger at column x of the middle row."""
    image = QUIET.copy()
    image[2, x] += depth
    return image


def shown(*images: Image, idle: float = 0.0) -> TouchImage:
    """A touch after these images; whatever is not quiet is a gesture to the networks."""
    touch = TouchImage(30, 5, 5)
    for image in images:
        touch.step(image, idle, null=bool((image == QUIET).all()))
    return touch


def seen(touch: TouchImage) -> NDArray[np.float32]:
    image = touch.image()
    assert image is not None
    return image


def test_there_is_no_image_while_nothing_touches() -> None:
    assert shown().image() is None
    assert shown(QUIET, QUIET).image() is None
    assert shown(finger(1), QUIET, QUIET, QUIET).image() is None


def test_the_first_frames_of_a_noisy_touch_show_the_finger_with_less_noise_than_one() -> None:
    rng = np.random.default_rng(3)
    frames = [
        (finger(1) + 0.05 * rng.standard_normal((5, 5))).astype(np.float32) for _ in range(16)
    ]
    one = np.abs(seen(shown(frames[0])) - finger(1)).mean()
    all_ = np.abs(seen(shown(*frames)) - finger(1)).mean()
    assert all_ == pytest.approx(one / 2, rel=0.35)  # the root of four: .3 s at 10 Hz


def test_a_finger_that_slides_later_does_not_move_the_place() -> None:
    slid = seen(shown(*[finger(1)] * 4, *[finger(3)] * 20))
    assert slid[2, 1] == pytest.approx(1.2, abs=0.02)
    assert slid[2, 3] < 1.05


def sliding(noise: float, seed: int = 7, to: int = 3) -> tuple[NDArray[np.float32], float]:
    """The image at 40 Hz and its blur: a finger lands at column 1 and is elsewhere after .15 s."""
    rng, touch = np.random.default_rng(seed), TouchImage(120, 5, 5, 40.0)
    for image in [QUIET] * 14 + [finger(1)] * 6 + [finger(to)] * 10:
        noisy = (image + noise * rng.standard_normal((5, 5))).astype(np.float32)
        touch.step(noisy, noise * math.sqrt(2 / math.pi), null=image is QUIET)
    return seen(touch), touch.blur


def test_a_finger_that_slides_at_once_is_where_it_landed() -> None:
    image, blur = sliding(0.01)
    assert image[2, 1] == pytest.approx(1.2, abs=0.02)
    assert image[2, 3] < 1.02
    assert blur > 1.1 * sliding(0.01, to=1)[1]  # fewer images, more noise


def test_noise_does_not_look_like_a_slide() -> None:
    lying = [sliding(0.05, seed, to=1)[0] for seed in range(40)]
    errors = [np.abs(image - finger(1)).mean() for image in lying]
    assert np.mean(errors) < 0.8 * 0.05 * math.sqrt(1 / 10 + 1 / 12)  # of ten images, and of rest


def test_what_was_there_before_may_be_the_touch_itself() -> None:
    rest, deeper = [QUIET] * 9, [finger(1, 0.25)] * 4
    assert shown(*rest, *deeper).signals[-1, 2, 1] == pytest.approx(0.25)
    doubted = TouchImage(30, 5, 5)  # the finger is down, and no gesture for the network yet
    for image in [*[finger(1)] * 9, *deeper]:
        doubted.step(image, 0.0, null=image is not deeper[0] and image[2, 1] < 1.22)
    assert doubted.signals[-1, 2, 1] == pytest.approx(0.25)


def test_firm_frames_count_more_than_faint_ones() -> None:
    arriving = [finger(1, depth) for depth in (0.02, 0.2, 0.2)]
    assert seen(shown(*arriving))[2, 1] == pytest.approx(1.2, abs=0.02)


def test_the_frames_before_the_networks_noticed_belong_to_the_touch() -> None:
    touch = TouchImage(30, 5, 5)
    touch.step(finger(1, 0.1), 0.0, null=True)
    touch.step(finger(1, 0.3), 0.0, null=False)
    touch.step(finger(1, 0.3), 0.0, null=False)
    assert 1.2 < seen(touch)[2, 1] < 1.3


@pytest.mark.parametrize(("rate_hz", "frames"), [(10.0, 1), (40.0, 2), (80.0, 4)])
def test_a_twentieth_of_a_second_before_that_is_when_the_finger_comes(
    rate_hz: float, frames: int
) -> None:
    touch = TouchImage(60, 5, 5, rate_hz)
    for image in [QUIET] * 8 + [finger(3)] * frames:
        touch.step(image, 0.0, null=True)
    touch.step(finger(1), 0.0, null=False)
    assert seen(touch)[2, 3] == pytest.approx(1.0 + 0.2 * frames / (frames + 1), rel=0.06)


def test_a_blink_of_the_networks_does_not_end_a_touch() -> None:
    touch = shown(finger(1), finger(1))
    touch.step(finger(1), 0.0, null=True)
    touch.step(finger(1), 0.0, null=True)
    assert seen(touch).tolist() == finger(1).tolist()
    touch.step(finger(1), 0.0, null=False)
    assert seen(touch)[2, 1] == pytest.approx(1.2)


def test_the_latest_touch_is_kept_until_the_next_one() -> None:
    touch = shown(finger(1), finger(1), QUIET, QUIET, QUIET)
    assert touch.image() is None
    latest = touch.image(latest=True)
    assert latest is not None
    assert latest.tolist() == finger(1).tolist()
    assert shown().image(latest=True) is None


def test_when_a_gesture_is_over_the_next_touch_is_another_one() -> None:
    touch = shown(finger(1), finger(1))
    touch.step(QUIET, 0.0, null=True, released=True)
    assert touch.image() is None
    touch.step(finger(3), 0.0, null=False)
    assert seen(touch)[2, 1] == pytest.approx(1.0)
    assert seen(touch)[2, 3] > 1.15


def test_what_the_rubber_remembers_is_taken_away() -> None:
    touch = TouchImage(30, 5, 5)
    for _ in range(6):
        touch.step(finger(0, 0.03), 0.0, null=True)
    for _ in range(3):
        touch.step(finger(3) + finger(0, 0.03) - QUIET, 0.0, null=False)
    assert seen(touch)[2, 0] == pytest.approx(1.0, abs=1e-6)
    assert seen(touch)[2, 3] == pytest.approx(1.2, abs=1e-2)


def test_pressure_moves_the_level_of_a_contact_and_not_the_uneven_one() -> None:
    contact = ContactLevel(5, 5)
    for _ in range(20):
        level = contact.step(QUIET * np.float32(0.9), 0.0)
    assert level == pytest.approx(0.1 * 5, abs=1e-3)
    assert contact.uneven == pytest.approx(0.0, abs=1e-6)
    for _ in range(20):
        contact.step(finger(1) - np.float32(0.1), 0.0)
    assert contact.uneven > 0.15


def test_fingers_that_lay_there_until_now_are_no_residue() -> None:
    touch = TouchImage(30, 5, 5)
    for image in [finger(0)] * 8 + [QUIET]:  # of a pinch that was held
        touch.step(image, 0.0, null=True, left=image is QUIET)
    touch.step(finger(0), 0.0, null=False)
    assert seen(touch)[2, 0] > 1.09  # with the frame before


def test_the_residue_is_that_of_three_tenths_of_a_second() -> None:
    touch = TouchImage(30, 5, 5, 40.0)
    for residue in [0.03] * 6 + [0.0] * 8:  # the last two are when the finger comes
        touch.step(finger(0, residue), 0.0, null=True)
    touch.step(finger(3), 0.0, null=False)
    assert touch.state()["left"][2, 0] == pytest.approx(0.03 * 6 / 12)


def test_a_noisy_sensor_is_not_believed_what_it_remembers() -> None:
    touch = TouchImage(30, 5, 5)
    for _ in range(6):
        touch.step(finger(0, 0.03), 0.1, null=True)
    touch.step(finger(3) + finger(0, 0.03) - QUIET, 0.1, null=False)
    assert touch.state()["left"].max() < 0.002


def test_an_image_says_how_much_of_it_is_noise() -> None:
    rng = np.random.default_rng(6)
    rest = [QUIET.copy() for _ in range(5)]

    def blur(frames: int, depth: float, idle: float) -> float:
        noisy = [finger(1, depth) + idle * rng.standard_normal((5, 5)) for _ in range(frames)]
        touch = shown(*rest, *[one.astype(np.float32) for one in noisy], idle=idle)
        seen(touch)
        return touch.blur

    assert blur(1, 0.2, 0.002) == pytest.approx(0.002 / 0.2, rel=0.5)
    assert blur(8, 0.2, 0.02) < 0.75 * blur(1, 0.2, 0.02)  # frames are laid over each other
    assert blur(4, 0.1, 0.02) > 1.5 * blur(4, 0.2, 0.02)  # a faint touch
    assert blur(1, 0.0, 0.02) <= 1.0  # nothing but noise


def test_the_noise_of_an_image_is_that_of_a_reading_and_of_what_was_left_before() -> None:
    reading, left = math.pi / 2 * 0.02**2, 0.01**2  # variances
    alone = shown(finger(1), idle=0.02)
    seen(alone)
    assert alone.blur == pytest.approx(math.sqrt((reading + left) / 0.2**2), rel=1e-4)
    # Four images of the untouched sensor, before the one in which the finger arrives.
    after_rest = shown(*[QUIET] * 9, finger(1), idle=0.02)
    seen(after_rest)
    known = reading / left / 4
    noise = reading + left * known / (1.0 + known)
    assert after_rest.blur == pytest.approx(math.sqrt(noise / 0.2**2), rel=1e-4)


def test_an_image_that_shows_nothing_is_all_noise() -> None:
    touch = TouchImage(30, 5, 5)
    touch.step(QUIET, 0.0, null=False)
    assert seen(touch).tolist() == QUIET.tolist()
    assert touch.blur == 1.0


def test_a_place_is_off_by_its_floor_and_by_the_noise_of_its_image() -> None:
    assert PositionSpread(0.3, 2.0).sigma(0.2) == pytest.approx(0.5)


def test_only_the_latest_frames_of_a_long_touch_count() -> None:
    touch = TouchImage(3, 5, 5)
    for x in (0, 1, 1, 1):
        touch.step(finger(x), 0.0, null=False)
    assert seen(touch).tolist() == finger(1).tolist()


def test_it_goes_on_exactly_where_its_state_was_taken() -> None:
    rng = np.random.default_rng(4)
    images = [(QUIET + 0.1 * rng.standard_normal((5, 5))).astype(np.float32) for _ in range(60)]
    nulls = (rng.random(60) < 0.6).tolist()
    for cut in range(60):
        whole, copy = TouchImage(8, 5, 5), TouchImage(8, 5, 5)
        for image, null in zip(images[:cut], nulls[:cut], strict=True):
            whole.step(image, 0.01, null=null)
        copy.restore(whole.state())
        for image, null in zip(images[cut:], nulls[cut:], strict=True):
            for touch in (whole, copy):
                touch.step(image, 0.01, null=null)
            one, other = whole.image(), copy.image()
            assert one is None or whole.blur == copy.blur
            assert (one is None) == (other is None)
            assert one is None or other is None or one.tobytes() == other.tobytes()


def test_a_finger_that_still_rises_is_not_taken_from_the_next_one() -> None:
    touch = TouchImage(120, 5, 5, rate_hz=40.0)
    for _ in range(20):
        touch.step(QUIET, 0.0, null=True)
    for _ in range(6):
        touch.step(finger(1), 0.0, null=False)
    for depth in (0.1, 0.05, 0.02):  # it rises
        touch.step(finger(1, depth), 0.0, null=True)
    for _ in range(4):
        touch.step(finger(3), 0.0, null=False)
    np.testing.assert_allclose(seen(touch), finger(3), atol=1e-6)
