"""Contacts that begin beside others: what they add is seen alone."""

import numpy as np
import pytest

from controller.recognition.images.frames import Image
from controller.recognition.images.lying import LyingContact

RATE_HZ = 40.0
NOISE = 0.005
THUMB, FINGER = (1.0, 1.0), (3.0, 3.0)


def contact(place: tuple[float, float], depth: float, wide: float = 0.8) -> Image:
    """z - 1 of a contact at (x, y), (5, 5)."""
    x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
    away = (x - place[0]) ** 2 + (y - place[1]) ** 2
    return np.asarray(-depth * np.exp(-away / (2 * wide**2)), dtype=np.float32)


def seen(stage: LyingContact, changes: list[Image]) -> list[int]:
    """Give a stage images, and return after which of them another contact had begun."""
    rng = np.random.default_rng(1)
    noisy = (1.0 + one + rng.normal(0.0, NOISE, one.shape) for one in changes)
    idle = NOISE * float(np.sqrt(2 / np.pi))
    return [n for n, image in enumerate(noisy) if stage.step(image.astype(np.float32), idle)]


def landing(place: tuple[float, float], depth: float = 0.3) -> list[Image]:
    """A finger that lands in .1 s and stays for .4 s."""
    return [contact(place, depth * share) for share in (*np.linspace(0.0, 1.0, 5), *[1.0] * 16)]


def stage() -> LyingContact:
    return LyingContact(5, 5, RATE_HZ, share=0.2)


UNTOUCHED = [np.zeros((5, 5), dtype=np.float32)] * 40
LYING = [contact(THUMB, 0.2)] * 40


def test_a_finger_beside_a_thumb_is_seen_alone_soon_after_it_lands() -> None:
    beside = stage()
    pressing = [LYING[0] + one for one in landing(FINGER)]
    (begun,) = seen(beside, [*UNTOUCHED, *LYING, *pressing])
    assert 80 < begun <= 85
    alone = beside.added(1.0 + pressing[-1]) - 1.0
    assert np.abs(alone - contact(FINGER, 0.3)).max() < 0.02


def test_the_window_shows_nothing_from_before_it_landed() -> None:
    beside, pressing = stage(), [LYING[0] + one for one in landing(FINGER)]
    seen(beside, [*UNTOUCHED, *LYING, *pressing])
    window = np.array([*LYING, *pressing], dtype=np.float32)[-40:] + np.float32(1.0)
    assert window[0, 1, 1] == pytest.approx(0.8)
    assert np.abs(beside.window(window)[:15] - 1.0).max() < 0.02


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param(landing(FINGER), id="a finger on an untouched sensor"),
        pytest.param([contact(THUMB, d) for d in np.linspace(0.2, 0.5, 10)], id="presses deeper"),
        pytest.param([contact((x, 1.0), 0.2) for x in np.linspace(1, 3, 12)], id="slides"),
        pytest.param([contact(THUMB, 0.2) - 0.05] * 20, id="pressure rises"),
        pytest.param([contact(THUMB, 0.2 + 0.1 * np.sin(n)) for n in range(40)], id="trembles"),
    ],
)
def test_one_contact_is_no_other(changes: list[Image]) -> None:
    lies = UNTOUCHED if changes[0].max() == changes[0].min() == 0.0 else LYING
    assert seen(stage(), [*UNTOUCHED, *lies, *changes]) == []


def test_what_has_left_is_subtracted_no_longer() -> None:
    beside = stage()
    seen(beside, [*UNTOUCHED, *LYING, *(LYING[0] + one for one in landing(FINGER)), *UNTOUCHED])
    again = 1.0 + contact(THUMB, 0.2)
    assert beside.added(again) is again


def test_it_goes_on_elsewhere_as_it_would_have_here() -> None:
    here, there = stage(), stage()
    pressing = [LYING[0] + one for one in landing(FINGER)]
    seen(here, [*UNTOUCHED, *LYING])
    there.restore(here.state())
    assert seen(here, pressing) == seen(there, pressing) != []


def test_none_is_looked_for_unless_the_bundle_says_so() -> None:
    off = LyingContact(5, 5, RATE_HZ, share=0.0)
    assert seen(off, [*LYING, *(LYING[0] + one for one in landing(FINGER))]) == []
    assert off.state() == {}


def test_on_a_noisy_sensor_a_finger_is_seen_where_networks_find_a_press_likely() -> None:
    beside, rng, noise = stage(), np.random.default_rng(2), 0.06
    idle = noise * float(np.sqrt(2 / np.pi))
    pressing = [LYING[0] + one for one in landing(FINGER)]
    images = [1.0 + one + rng.normal(0.0, noise, one.shape) for one in (*LYING, *pressing)]
    *before, newest = (image.astype(np.float32) for image in images)
    assert not any(beside.step(image, idle) for image in before)
    assert beside.step(newest, idle, pressed=True)
    alone = beside.added(1.0 + pressing[-1]) - 1.0
    assert divmod(int(alone.argmin()), 5) == (3, 3)
    assert abs(alone[1, 1]) < 0.05


def test_nothing_is_known_to_lie_in_the_first_images() -> None:
    assert not stage().step(1.0 + LYING[0], NOISE, pressed=True)
