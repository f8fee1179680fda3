"""Reasons for touches without a command, as the panel says them."""

from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from host.ui.unanswered import Reason, UnansweredTouches
from tetris.kit import language

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")
REST, TOUCHED = 0.01, 0.08  # root mean square of z - 1
FRAME_S = 0.025

Share = NDArray[np.float32]


def shares(null: float, **others: float) -> Share:
    """Return probabilities, (labels,)."""
    return np.array([null, *(others.get(label, 0.0) for label in LABELS[1:])], np.float32)


def image(level: float) -> NDArray[np.float64]:
    """Return z - 1 of a frame, alike everywhere."""
    return np.full((5, 5), level)


def reasons(
    touch: Share, frames: int, *, answered: bool = False, held: str = "", level: float = TOUCHED
) -> list[Reason]:
    """Return what is said of one touch of so many frames, with rest around it."""
    watch, said = UnansweredTouches(LABELS), []
    for frame in range(40 + frames + 20):
        touched = 40 <= frame < 40 + frames
        if answered and frame == 40 + frames + 2:
            watch.answer()
        probabilities = touch if touched else shares(1.0)
        strength = level if touched else REST
        now_held, now_s = held if touched else "", frame * FRAME_S
        said.append(watch.step(image(strength), probabilities, now_held, now_s))
    return [reason for reason in said if reason]


@pytest.mark.parametrize(
    ("touch", "frames", "reason"),
    [
        (shares(0.8, press=0.2), 20, Reason("light")),
        (shares(0.2, press=0.8), 4, Reason("short")),
        (shares(0.1, press=0.5, pinch=0.4), 20, Reason("undecided", ("press", "pinch"))),
        (shares(0.2, pinch=0.7), 20, Reason("unclear", ("pinch",))),
    ],
)
def test_a_touch_without_a_command_has_a_reason(touch: Share, frames: int, reason: Reason) -> None:
    assert reasons(touch, frames) == [reason]


def test_noise_that_no_taxel_shows_as_a_touch_is_none() -> None:
    light = shares(0.8, press=0.2)
    assert reasons(light, 20, level=0.039) == []
    assert reasons(light, 20, level=0.041) == [Reason("light")]


def test_a_touch_that_is_answered_even_a_little_late_has_none() -> None:
    assert reasons(shares(0.2, press=0.8), 4, answered=True) == []
    assert reasons(shares(0.0, press=1.0), 20, held="press") == []


def test_the_dome_that_springs_back_after_a_command_is_no_second_touch() -> None:
    """Between the levels at which a touch ends and begins there is neither."""
    watch, said = UnansweredTouches(LABELS), []
    levels = [REST] * 40 + [TOUCHED] * 10 + [0.022, 0.024] * 10 + [REST] * 20
    for frame, level in enumerate(levels):
        pressed = level == TOUCHED
        probabilities = shares(0.0, press=1.0) if pressed else shares(1.0)
        held = "press" if pressed else ""
        said.append(watch.step(image(level), probabilities, held, frame * FRAME_S))
    assert not any(said)


def test_an_orb_without_any_noise_is_watched_too() -> None:
    watch, touch = UnansweredTouches(LABELS), shares(0.8, press=0.2)
    levels = [0.0] * 10 + [TOUCHED] * 20 + [0.0] * 20
    said = [watch.step(image(level), touch, "", i * FRAME_S) for i, level in enumerate(levels)]
    assert [reason for reason in said if reason] == [Reason("light")]


def test_rest_is_no_touch_on_a_noisy_orb_either() -> None:
    watch, noise = UnansweredTouches(LABELS), np.random.default_rng(1)
    levels = 0.05 * (1.0 + 0.15 * noise.standard_normal(2000))
    assert {
        watch.step(image(level), shares(1.0), "", i * FRAME_S) for i, level in enumerate(levels)
    } == {None}


@pytest.mark.parametrize(("rest", "said"), [(3, []), (12, []), (60, [Reason("light")])])
def test_what_comes_soon_after_an_answered_touch_is_the_dome_springing_back(
    rest: int, said: list[Reason]
) -> None:
    watch, found = UnansweredTouches(LABELS), []
    levels = [REST] * 40 + [TOUCHED] * 10 + [REST] * rest + [0.04] * 6 + [REST] * 20
    for frame, level in enumerate(levels):
        pressed = level == TOUCHED
        probabilities = shares(0.0, press=1.0) if pressed else shares(0.9, press=0.1)
        held = "press" if pressed else ""
        found.append(watch.step(image(level), probabilities, held, frame * FRAME_S))
    assert [reason for reason in found if reason] == said


@pytest.mark.parametrize("name", language.names())
@pytest.mark.parametrize("key", get_args(Reason.__annotations__["key"]))
def test_every_language_has_words_for_every_reason(name: str, key: str) -> None:
    words = language.load(name)(f"dome.unanswered.{key}")
    assert not words.startswith("dome.")
    named = {"undecided": 2, "unclear": 1}.get(key, 0)
    assert words.count("{}") == named
