"""The touch strength of a person, found from presses that a simulated orb feels."""

import numpy as np
import pytest

from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Preprocessor
from controller.sensors import base as sensors
from controller.shared import touch_strength
from controller.shared.aliases import Images
from controller.shared.protocol.messages import Contact
from controller.shared.touch_strength import LEAST, MOST, PRESSES

RATE_HZ = 40.0


def felt(depth_mm: float, preset: str = "nominal", presses: int = PRESSES) -> Images:
    """Return the images, (frames, rows, columns), of presses of half a second, all the same."""
    orb = sensors.load("virtual", RATE_HZ, seed=3, preset=preset)
    stage = Preprocessor(PreprocessSettings(rate_hz=RATE_HZ), 5, 5)
    press, lift, images = Contact(1, 2.2, 1.7, depth_mm, 7.0), round(1.5 * RATE_HZ), []
    for number in range(round(2.0 * RATE_HZ) + presses * (lift + 20)):
        since = number - round(2.0 * RATE_HZ)
        down = since >= 0 and since % (lift + 20) < 20
        orb.touch((press,) if down else (), number / RATE_HZ)
        prepared = stage.step(orb.read((number + 1) / RATE_HZ))
        if prepared.ready:
            images.append(prepared.image)
    return np.array(images)


def presses_of(images: Images) -> list[float]:
    return touch_strength.press_deviations((images - 1.0).mean(axis=(1, 2)), RATE_HZ)


def test_presses_of_3_mm_look_like_9_mm_once_they_are_divided_by_the_strength_found() -> None:
    light, usual = felt(3.0), float(np.median(presses_of(felt(9.0))))
    strength = touch_strength.of_presses(presses_of(light), usual)
    assert 0.3 < strength < 0.5
    seen = presses_of(touch_strength.scaled(light, strength))
    assert len(seen) == PRESSES
    assert np.median(seen) == pytest.approx(usual, rel=0.15)


@pytest.mark.parametrize("preset", ["nominal", "paper-snr"])
def test_every_press_is_counted_once_and_rest_is_none(preset: str) -> None:
    assert len(presses_of(felt(9.0, preset))) == PRESSES
    assert presses_of(felt(9.0, preset, presses=0)) == []


def test_a_press_counts_when_it_is_over() -> None:
    images = felt(9.0, presses=1)
    pressed = int(np.abs((images - 1.0).mean(axis=(1, 2))).argmax())
    assert presses_of(images[: pressed + 1]) == []
    assert len(presses_of(images)) == 1
    assert presses_of(images[:3]) == []


def test_a_person_is_as_strong_as_the_median_press_and_nearly_usual_is_usual() -> None:
    assert touch_strength.of_presses([0.4, 0.5, 9.0], usual=1.0) == 0.5
    assert touch_strength.of_presses([1.5], usual=1.0) == 1.5
    assert touch_strength.of_presses([0.85], usual=1.0) == 1.0
    assert touch_strength.of_presses([1.2], usual=1.0) == 1.0
    assert touch_strength.of_presses([0.01], usual=1.0) == LEAST
    assert touch_strength.of_presses([100.0], usual=1.0) == MOST


def test_images_of_strength_1_are_the_same_array() -> None:
    images = np.full((2, 5, 5), 0.9, dtype=np.float32)
    assert touch_strength.scaled(images, 1.0) is images
    light = touch_strength.scaled(images, 0.5)
    assert light.dtype == np.float32
    assert light == pytest.approx(0.8)
