"""User identification: evidence adds up over gestures, fades, and is forgotten."""

import dataclasses
from hashlib import sha256
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.recognition.user_id import (
    UserIdentifier,
    Users,
    evidence,
    identify,
    uniform_belief,
    update_belief,
)

TWO = Users(
    ("ann", "bob"), ("press",), temperature=1.0, accept=0.9, stay=0.98, forget_s=5.0
)  # fmt: skip
ANN = np.array([0.2, 0.6, 0.2], dtype=np.float32)
SOMEBODY = np.array([0.8, 0.1, 0.1], dtype=np.float32)


def gesture(witness: UserIdentifier, people: np.ndarray, frames: int = 6) -> None:
    """One gesture, and half a second of rest behind it."""
    for _ in range(frames):
        witness.step(people)
    for _ in range(5):
        witness.step(None)


def test_a_gesture_counts_when_it_ends_and_its_windows_count_as_one() -> None:
    witness = UserIdentifier(TWO, 10.0)
    for _ in range(6):
        witness.step(ANN)
        assert witness.confidence == pytest.approx(1 / 3)
    witness.step(None)
    assert witness.confidence == pytest.approx(0.6, abs=0.01)
    assert witness.name == ""


def test_what_turns_out_to_be_no_gesture_says_nothing() -> None:
    witness = UserIdentifier(TWO, 10.0)
    for _ in range(6):
        witness.step(ANN, counts=False)
    witness.step(None)
    assert witness.confidence == pytest.approx(1 / 3)
    for known in (False, False, True, True):  # the first windows of a gesture count as well
        witness.step(ANN, counts=known)
    witness.step(None)
    assert witness.confidence == pytest.approx(0.6, abs=0.01)


def test_successive_gestures_name_somebody() -> None:
    witness = UserIdentifier(TWO, 10.0)
    confidences = []
    for _ in range(4):
        gesture(witness, ANN)
        confidences.append(witness.confidence)
    assert witness.name == "ann"
    assert confidences == sorted(confidences)


def test_who_was_named_stays_named_while_nobody_else_is_more_probable() -> None:
    unsure = np.array([0.3, 0.5, 0.2])
    assert identify(unsure, TWO) == 0
    assert identify(unsure, TWO, before=1) == 1
    assert identify(unsure, TWO, before=2) == 0


def test_somebody_else_is_believed_after_some_gestures() -> None:
    witness = UserIdentifier(TWO, 10.0)
    for _ in range(50):
        gesture(witness, ANN)
    others = 0
    while witness.name == "ann":
        gesture(witness, SOMEBODY)
        others += 1
    assert 1 <= others <= 4  # however long ann played
    for _ in range(4):
        gesture(witness, SOMEBODY)
    assert witness.name == ""


def test_who_is_gone_for_long_is_forgotten() -> None:
    witness = UserIdentifier(TWO, 10.0)
    for _ in range(5):
        gesture(witness, ANN)
    for _ in range(44):
        witness.step(None)
    assert witness.name == "ann"
    witness.step(None)
    assert witness.name == ""
    assert witness.confidence == pytest.approx(1 / 3)


def test_a_temperature_makes_evidence_weaker() -> None:
    said = evidence(ANN)
    sure = update_belief(uniform_belief(TWO), said, TWO)[1]
    less = update_belief(uniform_belief(TWO), said, dataclasses.replace(TWO, temperature=3.0))[1]
    assert sure > less > 1 / 3


@settings(deadline=None)
@given(
    st.lists(
        st.none() | st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3).map(np.array), max_size=60
    ),
    st.integers(0, 60),
)
def test_a_session_goes_on_exactly_after_a_cut(frames: list[np.ndarray | None], cut: int) -> None:
    whole, first, second = (UserIdentifier(TWO, 2.0) for _ in range(3))
    for frame in frames:
        whole.step(frame)
    for frame in frames[:cut]:
        first.step(frame)
    second.restore(first.state())
    for frame in frames[cut:]:
        second.step(frame)
    assert (second.name, second.confidence) == (whole.name, whole.confidence)
    assert 0.0 <= whole.confidence <= 1.0
    for key, array in whole.state().items():
        assert np.array_equal(array, second.state()[key])


def test_a_damaged_state_is_refused() -> None:
    witness = UserIdentifier(TWO, 10.0)
    for key, value in (
        ("belief", np.nan),
        ("belief", -1.0),
        ("sum", np.inf),
        ("counts", -1.0),
        ("counts", np.inf),
    ):
        state = witness.state()
        state[key] = np.full_like(state[key], value)
        with pytest.raises(ValueError, match="user identification is damaged"):
            witness.restore(state)


def test_nobody_in_particular_is_never_named() -> None:
    assert identify(np.array([0.98, 0.01, 0.01]), TWO) == 0
    assert identify(np.array([0.0, 0.5, 0.5]), TWO) == 0
    assert identify(np.array([0.05, 0.9, 0.05]), TWO) == 1


def test_an_hour_of_two_people_goes_as_it_went_and_can_be_continued_elsewhere() -> None:
    """The digest is that of every name and confidence; a new one stands in the failure."""
    script, witness, said = Random(1), UserIdentifier(TWO, 10.0), sha256()
    for number in range(400):
        guest = script.random() < 0.2
        for _ in range(1 + int(6 * script.random())):
            shares = np.array([0.5 if guest else 0.1, 0.2 + 0.6 * script.random(), 0.3])
            witness.step((shares / shares.sum()).astype(np.float32), counts=script.random() < 0.6)
        if number % 7 == 0:
            copy = UserIdentifier(TWO, 10.0)
            copy.restore(witness.state())
            witness = copy
        for _ in range(60 if script.random() < 0.05 else 2):
            witness.step(None)
            said.update(f"{witness.name} {witness.confidence:.4f}\n".encode())
    assert said.hexdigest()[:16] == "c66a154f7dd03f69"
