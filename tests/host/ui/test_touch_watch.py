"""Touches in the level of telemetry."""

import numpy as np

from host.ui.touch_watch import TouchWatch

FRAME_S = 1 / 40


def events(*parts: tuple[float, float]) -> list[str]:
    """Return what happens in parts of a level, each with its seconds."""
    watch = TouchWatch()
    levels = [level for level, seconds in parts for _ in range(round(seconds / FRAME_S))]
    found = [
        watch.step(np.full((5, 5), level), number * FRAME_S) for number, level in enumerate(levels)
    ]
    return [event for event in found if event]


def test_a_touch_begins_and_ends_after_a_pause() -> None:
    assert events((0.01, 1.0), (0.12, 0.4), (0.01, 0.4)) == ["begun"]
    assert events((0.01, 1.0), (0.12, 0.4), (0.01, 0.6)) == ["begun", "ended"]


def test_two_taps_are_one_touch() -> None:
    double = [(0.01, 1.0), (0.12, 0.15), (0.01, 0.2), (0.12, 0.15), (0.01, 0.6)]
    assert events(*double) == ["begun", "ended"]


def test_the_dome_springing_back_is_no_touch() -> None:
    back = [(0.04, 0.4), (0.03, 0.4), (0.02, 0.4), (0.01, 0.4), (0.021, 0.03), (0.01, 1.0)]
    assert events((0.01, 1.0), (0.15, 1.5), *back) == ["begun", "ended"]


def test_a_lighter_touch_follows_a_firm_one() -> None:
    assert events((0.01, 1.0), (0.15, 0.4), (0.01, 0.7), (0.08, 0.4)) == ["begun", "ended", "begun"]


def test_what_lasts_is_the_new_level_at_rest() -> None:
    assert events((0.01, 1.0), (0.03, 20.0)) == ["begun", "ended"]


def test_an_orb_that_is_touched_at_first_is_watched_from_the_next_touch() -> None:
    found = events((0.15, 0.5), (0.01, 1.0), (0.15, 0.4), (0.01, 0.6))
    assert found == ["begun", "ended", "begun", "ended"]
