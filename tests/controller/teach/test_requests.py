"""Requests, counts and display of a teaching session."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.bundles import vocabulary
from controller.capture.cues import CueSession, CueTiming, ExampleRequest
from controller.capture.labels import Labeller
from controller.recognition.pipeline import Step
from controller.teach import TeachError, protocols
from controller.teach.progress import (
    ExampleCounts,
    ProgressLog,
    summary,
)

FIVE = vocabulary.shipped()
MODEL = FIVE.labels


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def step(t_s: float, gesture: str | None = None, touched: bool = True) -> Step:
    """A frame of which only the model's opinion matters."""
    probabilities = np.zeros(len(MODEL), dtype=np.float32)
    probabilities[MODEL.index(gesture) if gesture else 0] = 0.75
    z = np.ones((5, 5), dtype=np.float32)
    return Step(1, t_s, z, True, not touched, probabilities, None, gesture, "", None)


def test_every_gesture_is_asked_for_as_often_and_so_are_touches_that_are_none() -> None:
    asks = protocols.asks("gestures", FIVE, (5, 5), 3, rng())
    assert Counter(ask.label for ask in asks) == dict.fromkeys(FIVE.labels, 3)
    assert {ask.place for ask in asks} == {None}


@given(st.integers(0, 30), st.integers(0, 100))
def test_whoever_stops_early_has_as_many_of_each(stop: int, seed: int) -> None:
    asks = protocols.asks("gestures", FIVE, (5, 5), 6, rng(seed))[:stop]
    count = Counter(ask.label for ask in asks)
    assert max(count.values(), default=0) - min((count[name] for name in MODEL), default=0) <= 1


def test_places_are_every_taxel_and_every_middle_between_four_in_any_order() -> None:
    asks = protocols.asks("locations", FIVE, (3, 2), 2, rng())
    places = {(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2), (0.5, 0.5), (0.5, 1.5)}
    assert Counter(ask.place for ask in asks) == dict.fromkeys(places, 2)
    assert {ask.label for ask in asks} == {"press"}
    again = protocols.asks("locations", FIVE, (3, 2), 2, rng(2))
    assert sorted(map(repr, again)) == sorted(map(repr, asks))
    assert again != asks


def test_of_a_large_grid_a_hundred_places_are_drawn() -> None:
    places = protocols.sites(27, 15, rng())
    assert len(places) == len(set(places)) == 100
    assert all(0 <= x <= 14 and 0 <= y <= 26 for x, y in places)


def test_a_vocabulary_without_places_has_none_to_ask_for() -> None:
    wave = vocabulary.parse('[[gesture]]\nlabel = "wave"', "wave.toml", Path())
    with pytest.raises(TeachError, match="write located = true to one"):
        protocols.asks("locations", wave, (5, 5), 1, rng())


def test_nobody_is_asked_for_ten_thousand_examples() -> None:
    with pytest.raises(TeachError, match="choose fewer --repetitions"):
        protocols.asks("gestures", FIVE, (5, 5), 9999, rng())


def cued(*labels: str) -> Labeller:
    """Somebody who is asked for these, four seconds each."""
    asks = [ExampleRequest(label) for label in labels]
    return Labeller(
        MODEL, cues=CueSession(asks, CueTiming(1.0, 2.0, 1.0, 0.0), rng(), shuffled=False)
    )


def play(
    labeller: Labeller,
    tally: ExampleCounts,
    seconds: float,
    answers: dict[float, str],
    felt: bool = True,
) -> None:
    """Let frames pass; `answers` says when the model recognised what."""
    for k in range(round(seconds * 10)):
        one = step(k / 10, answers.get(k / 10))
        tally.take(labeller.label(k / 10, felt=felt), one)


def test_examples_are_counted_and_so_is_what_the_model_made_of_them() -> None:
    labeller = cued("press", "press", "pinch", "null")
    tally = ExampleCounts({"press": 2, "pinch": 1, "null": 1}, {"press": 7}, MODEL)
    play(labeller, tally, 17.0, {1.5: "press", 2.0: "pinch", 5.5: "pinch", 11.5: "pinch"})
    assert [tally.have(label) for label in tally.wanted] == [2, 1, 1]
    assert tally.understood("press") == (1, 2)  # the first answer of each counts
    assert tally.understood("pinch") == (1, 1)  # which came while the hand was leaving
    assert tally.understood("null") == (1, 1)  # nothing was recognised in nothing
    assert summary(tally)[0] == (
        "  press: 2 examples, 9 in all; 1 of 2 understood by the present model"
    )


def test_a_label_that_the_model_does_not_know_has_no_figure() -> None:
    tally = ExampleCounts({"knock": 1}, {}, MODEL)
    play(cued("press"), tally, 5.0, {1.5: "press"})
    assert tally.understood("knock") is None
    assert summary(tally) == ["  knock: 1 example"]


def test_an_example_that_does_not_count_is_nowhere_counted() -> None:
    tally = ExampleCounts({"pinch": 1}, {}, MODEL)
    play(cued("pinch"), tally, 8.0, {1.5: "pinch"}, felt=False)
    assert tally.have("pinch") == 0
    assert tally.understood("pinch") == (0, 0)


def test_a_line_tells_what_changed() -> None:
    told: list[str] = []
    tally = ExampleCounts({"press": 1})
    log = ProgressLog(tally, told.append)
    labeller = cued("press")
    for k in range(100):
        log.show(labeller.label(k / 10, felt=k > 40), step(k / 10))
    assert told == ["press again: nothing was felt", "press: enough (1)"]


def test_a_person_is_told_what_to_do() -> None:
    told: list[str] = []
    log, labeller = ProgressLog(ExampleCounts({"press": 1}), told.append, FIVE), cued("press")
    for k in range(45):
        log.show(labeller.label(k / 10, felt=True), step(k / 10))
    assert told == [
        "get ready: press with one finger, anywhere  (1 left)",
        "GO: press with one finger, anywhere 2 s",
        "press: enough (1)",
        "done",
    ]
