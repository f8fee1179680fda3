"""Messages of the phone's page, good and bad."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from host.phone import messages
from host.phone.messages import Finger, PhoneMessageError, RateLimit, View, Zone

# JSON of every kind, NaN and infinity among them.
ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=6) | st.dictionaries(st.text(max_size=2), inner),
    max_leaves=40,
)


def test_a_message_lists_the_fingers_on_the_dome() -> None:
    assert messages.fingers("[[0, -0.5, 0.25, 0.1, 0.5], [3, 0, 1, 0, 1]]") == (
        Finger(0, -0.5, 0.25, 0.1, 0.5),
        Finger(3, 0, 1, 0, 1),
    )
    assert messages.fingers("[]") == ()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "7",
        "[7]",
        "[[0, 0, 0, 0]]",  # four numbers
        "[[0, 0, 0, 0, 0, 0]]",
        "[[10, 0, 0, 0, 0]]",  # one finger too many
        "[[0.0, 0, 0, 0, 0]]",
        "[[true, 0, 0, 0, 0]]",
        "[[0, 0.8, 0.8, 0, 0]]",  # beside the dome
        "[[0, NaN, 0, 0, 0]]",
        "[[0, 0, -Infinity, 0, 0]]",
        "[[0, 1e999, 0, 0, 0]]",
        "[[0, 0, 0, -0.1, 0]]",
        "[[0, 0, 0, 0, 2]]",
        '[[0, "0", 0, 0, 0]]',
        "[[1, 0, 0, 0, 0], [1, 0.5, 0, 0, 0]]",  # one number, two fingers
        json.dumps([[number % 10, 0, 0, 0, 0] for number in range(11)]),
        "[" * messages.MAX_BYTES,
    ],
)
def test_what_is_no_list_of_fingers_is_refused(text: str) -> None:
    with pytest.raises(PhoneMessageError):
        messages.fingers(text)


def test_bytes_are_no_message() -> None:
    with pytest.raises(PhoneMessageError):
        messages.fingers(b"[]")


@given(ANY_JSON)
def test_whatever_is_taken_lies_on_the_dome(value: Any) -> None:
    try:
        found = messages.fingers(json.dumps(value))
    except PhoneMessageError:
        return
    assert len(found) <= messages.MAX_FINGERS
    for finger in found:
        assert finger.x**2 + finger.y**2 <= 1 + 1e-9
        assert 0 <= finger.radius <= 1
        assert 0 <= finger.pressure <= 1


@given(st.text(max_size=200))
def test_any_text_is_a_message_or_refused(text: str) -> None:
    for read in (messages.fingers, messages.key):
        try:
            read(text)
        except PhoneMessageError:
            continue


def test_the_first_message_is_a_short_key() -> None:
    assert messages.key('""') == ""
    assert messages.key('"abc"') == "abc"
    for text in ("[]", '"' + "a" * 65 + '"', "abc"):
        with pytest.raises(PhoneMessageError):
            messages.key(text)


def test_a_flood_is_over_the_rate_and_a_picture_a_message_is_not() -> None:
    steady = RateLimit(rate_hz=100.0, burst=10)
    assert all(steady.take(number / 100) for number in range(1000))
    flood = RateLimit(rate_hz=100.0, burst=10)
    assert [flood.take(0.0) for _ in range(12)] == [True] * 10 + [False] * 2
    assert flood.take(10.0)  # after a pause


def test_a_view_is_a_json_object() -> None:
    view = View({"lost": "lost"}, "live", zones=(Zone(-1, 0, -1, 1, "left", (-0.5, 0)),))
    assert json.loads(view.json(key="k")) == {
        "words": {"lost": "lost"},
        "status": "live",
        "last": "",
        "commanded_s": 0.0,
        "zones": [
            {"left": -1, "right": 0, "bottom": -1, "top": 1, "command": "left", "at": [-0.5, 0]}
        ],
        "key": "k",
    }
