"""Reasons for touches without a command, as the panel says them."""

from collections.abc import Sequence
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


NOTHING, PRESS, LIGHT = shares(1.0), shares(0.0, press=1.0), shares(0.8, press=0.2)


def reasons(
    levels: Sequence[float],
    touch: Share,
    rest: Share = NOTHING,
    held: str = "",
    answered: int | None = None,  # frame
) -> list[Reason]:
    """Return what is said of frames; those with `TOUCHED` have a touch's probabilities."""
    watch, said = UnansweredTouches(LABELS), []
    for frame, level in enumerate(levels):
        if frame == answered:
            watch.answer()
        shown, name = (touch, held) if level == TOUCHED else (rest, "")
        said.append(watch.step(np.full((5, 5), level), shown, name, frame * FRAME_S))
    return [reason for reason in said if reason]


def around(frames: int, level: float = TOUCHED) -> list[float]:
    """Return the levels of one touch with rest around it."""
    return [REST] * 40 + [level] * frames + [REST] * 20


@pytest.mark.parametrize(
    ("touch", "frames", "reason"),
    [
        (LIGHT, 20, Reason("light")),
        (shares(0.2, press=0.8), 4, Reason("short")),
        (shares(0.1, press=0.5, pinch=0.4), 20, Reason("undecided", ("press", "pinch"))),
        (shares(0.2, pinch=0.7), 20, Reason("unclear", ("pinch",))),
    ],
)
def test_a_touch_without_a_command_has_a_reason(touch: Share, frames: int, reason: Reason) -> None:
    assert reasons(around(frames), touch) == [reason]


def test_noise_that_no_taxel_shows_as_a_touch_is_none() -> None:
    assert reasons(around(20, 0.039), LIGHT, rest=LIGHT) == []
    assert reasons(around(20, 0.041), LIGHT, rest=LIGHT) == [Reason("light")]


def test_a_touch_that_is_answered_even_a_little_late_has_none() -> None:
    assert reasons(around(4), shares(0.2, press=0.8), answered=46) == []
    assert reasons(around(20), PRESS, held="press") == []


def test_the_dome_that_springs_back_after_a_command_is_no_second_touch() -> None:
    """Between the levels at which a touch ends and begins there is neither."""
    levels = [REST] * 40 + [TOUCHED] * 10 + [0.022, 0.024] * 10 + [REST] * 20
    assert reasons(levels, PRESS, held="press") == []


def test_an_orb_without_any_noise_is_watched_too() -> None:
    levels = [0.0] * 10 + [TOUCHED] * 20 + [0.0] * 20
    assert reasons(levels, LIGHT, rest=LIGHT) == [Reason("light")]


def test_rest_is_no_touch_on_a_noisy_orb_either() -> None:
    levels = 0.05 * (1.0 + 0.15 * np.random.default_rng(1).standard_normal(2000))
    assert reasons(levels.tolist(), NOTHING) == []


@pytest.mark.parametrize(("rest", "said"), [(3, []), (12, []), (60, [Reason("light")])])
def test_what_comes_soon_after_an_answered_touch_is_the_dome_springing_back(
    rest: int, said: list[Reason]
) -> None:
    levels = [REST] * 40 + [TOUCHED] * 10 + [REST] * rest + [0.04] * 6 + [REST] * 20
    assert reasons(levels, PRESS, rest=shares(0.9, press=0.1), held="press") == said


@pytest.mark.parametrize("name", language.names())
@pytest.mark.parametrize("key", get_args(Reason.__annotations__["key"]))
def test_every_language_has_words_for_every_reason(name: str, key: str) -> None:
    words = language.load(name)(f"dome.unanswered.{key}")
    assert not words.startswith("dome.")
    named = {"undecided": 2, "unclear": 1}.get(key, 0)
    assert words.count("{}") == named
