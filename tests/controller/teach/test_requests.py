"""Requests of a teaching session: as often as each was asked for, in any order."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.bundles import vocabulary
from controller.bundles.vocabulary import Vocabulary
from controller.shared.errors import UserError
from controller.teach.session import (
    GESTURES,
    LOCATIONS,
    SessionPlan,
    requests,
    sites,
)

FIVE = vocabulary.shipped()


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def plan(words: Vocabulary, protocol: str, repetitions: int) -> SessionPlan:
    return SessionPlan("virtual", Path(), "", "1", words, protocol, repetitions)


def test_every_gesture_is_asked_for_as_often_and_so_are_touches_that_are_none() -> None:
    asks = requests(plan(FIVE, GESTURES, 3), (5, 5), rng())
    assert Counter(ask.label for ask in asks) == dict.fromkeys(FIVE.labels, 3)
    assert {ask.place for ask in asks} == {None}


@given(st.integers(0, 30), st.integers(0, 100))
def test_whoever_stops_early_has_as_many_of_each(stop: int, seed: int) -> None:
    asks = requests(plan(FIVE, GESTURES, 6), (5, 5), rng(seed))[:stop]
    count = Counter(ask.label for ask in asks)
    assert (
        max(count.values(), default=0) - min((count[name] for name in FIVE.labels), default=0) <= 1
    )


def test_places_are_every_taxel_and_every_middle_between_four_in_any_order() -> None:
    asks = requests(plan(FIVE, LOCATIONS, 2), (3, 2), rng())
    places = {(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2), (0.5, 0.5), (0.5, 1.5)}
    assert Counter(ask.place for ask in asks) == dict.fromkeys(places, 2)
    assert {ask.label for ask in asks} == {"press"}
    again = requests(plan(FIVE, LOCATIONS, 2), (3, 2), rng(2))
    assert sorted(map(repr, again)) == sorted(map(repr, asks))
    assert again != asks


def test_of_a_large_grid_a_hundred_places_are_drawn() -> None:
    places = sites(27, 15, rng())
    assert len(places) == len(set(places)) == 100
    assert all(0 <= x <= 14 and 0 <= y <= 26 for x, y in places)


def test_a_vocabulary_without_places_has_none_to_ask_for() -> None:
    wave = vocabulary.parse('[[gesture]]\nlabel = "wave"', "wave.toml", Path())
    with pytest.raises(UserError, match="write located = true to one"):
        requests(plan(wave, LOCATIONS, 1), (5, 5), rng())


def test_nobody_is_asked_for_ten_thousand_examples() -> None:
    with pytest.raises(UserError, match="choose fewer --repetitions"):
        requests(plan(FIVE, GESTURES, 9999), (5, 5), rng())
