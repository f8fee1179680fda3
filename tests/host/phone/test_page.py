"""Messages of the phone's page, good and bad, and what the page shows of the orb."""

import base64
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.shared.protocol.messages import Command, Contact
from host.phone import page
from host.phone.server import MAX_BYTES
from host.ui.orb_state import OrbState
from host.ui.pointer_input import FINGER_RADIUS_MM, DomeArea, PointerInput
from tests.support.app_window import WELCOME, shipped_gestures
from tetris.kit import language

PAD = DomeArea()  # 5×5 taxels, so the middle is at (2, 2) and the radius 3.8
ENGLISH = language.load("en")

# JSON of every kind, NaN and infinity among them.
ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=6) | st.dictionaries(st.text(max_size=2), inner),
    max_leaves=40,
)


def orb() -> OrbState:
    state = OrbState()
    state.connected(WELCOME)
    state.ready = True
    for gesture in shipped_gestures():
        state.described(gesture)
    return state


@pytest.mark.parametrize(("x", "y"), [(-0.25, 0.25), (0.0, 0.6), (0.7, -0.6)])
def test_a_finger_without_further_sensors_touches_as_one_on_the_screen_does(
    x: float, y: float
) -> None:
    screen = PointerInput(PAD)
    screen.finger("index", 2 + x * 3.8, 2 + y * 3.8, down=True)
    (touch,) = screen.contacts(0.0)
    (found,) = page.contacts(f"[[0, {x}, {y}, 0, 0.5]]", PAD)
    assert (found.x, found.y) == pytest.approx((touch.x, touch.y))
    assert (found.depth_mm, found.radius_mm) == (touch.depth_mm, FINGER_RADIUS_MM)
    assert found.id == 32
    assert page.contacts("[]", PAD) == ()


def test_pressure_sinks_in_and_width_is_a_fingertips() -> None:
    light, firm = page.contacts("[[0, 0, 0, 0.01, 0], [1, 0, 0.5, 0.9, 1]]", PAD)
    assert (light.depth_mm, firm.depth_mm) == (7.0, 11.0)
    assert (light.radius_mm, firm.radius_mm) == (6.0, 8.5)


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
        "[[-1, 0, 0, 0, 0]]",
        "[[0.5, 0, 0, 0, 0]]",
        "[[true, 0, 0, 0, 0]]",
        "[[0, 0.8, 0.8, 0, 0]]",  # beside the dome
        "[[0, NaN, 0, 0, 0]]",
        "[[NaN, 0, 0, 0, 0]]",
        "[[0, 0, -Infinity, 0, 0]]",
        "[[0, 1e999, 0, 0, 0]]",
        f"[[0, {10**400}, 0, 0, 0]]",
        "[[0, 0, 0, -0.1, 0]]",
        "[[0, 0, 0, NaN, 0]]",
        "[[0, 0, 0, 0, 2]]",
        '[[0, "0", 0, 0, 0]]',
        "[[1, 0, 0, 0, 0], [1, 0.5, 0, 0, 0]]",  # one number, two fingers
        json.dumps([[number % 10, 0, 0, 0, 0] for number in range(11)]),
        "[" * MAX_BYTES,
        b"[]",
    ],
)
def test_what_is_no_list_of_fingers_is_refused(text: str | bytes) -> None:
    with pytest.raises(ValueError):
        page.contacts(text, PAD)


@given(ANY_JSON)
def test_whatever_is_taken_lies_on_the_dome(value: Any) -> None:
    try:
        found = page.contacts(json.dumps(value), PAD)
    except ValueError:
        return
    assert len(found) <= page.MAX_FINGERS
    assert all(PAD.on_dome(contact.x, contact.y) for contact in found)


@given(st.lists(st.tuples(*[st.floats(-1.2, 1.2)] * 2), max_size=12))
def test_fingers_are_taken_if_they_are_on_the_dome_and_ten_at_most(
    places: list[tuple[float, float]],
) -> None:
    text = json.dumps([[number, x, y, 0, 0.5] for number, (x, y) in enumerate(places)])
    if len(places) <= 10 and all(x * x + y * y < 0.999 for x, y in places):
        assert len(page.contacts(text, PAD)) == len(places)
    elif len(places) > 10 or any(x * x + y * y > 1.001 for x, y in places):
        with pytest.raises(ValueError):
            page.contacts(text, PAD)


@given(st.text(max_size=200))
def test_any_text_is_a_message_or_refused(text: str) -> None:
    try:
        page.contacts(text, PAD)
    except ValueError:
        return


def test_the_page_shows_the_state_of_the_orb_in_the_windows_language() -> None:
    state = OrbState()
    assert page.view(state, ENGLISH, PAD, 0.0)["status"] == "connecting"
    state = orb()
    assert page.view(state, ENGLISH, PAD, 0.0)["status"].startswith("Touch the dome")
    assert page.view(state, language.load("de"), PAD, 0.0)["status"].startswith("Berühre die")
    state.ready = False
    assert "do not touch" in page.view(state, ENGLISH, PAD, 0.0)["status"]
    state.silent("lost", "gone")
    assert page.view(state, ENGLISH, PAD, 0.0)["status"] == "no link"


def test_the_page_shows_a_command_while_it_is_news_and_counts_it_for_longer() -> None:
    state = orb()
    assert page.view(state, ENGLISH, PAD, 0.0)["commanded_s"] == 0.0
    state.command(Command("drop", "pinch", 0.9, None, 1), 5.0)
    soon, late = page.view(state, ENGLISH, PAD, 5.5), page.view(state, ENGLISH, PAD, 60.0)
    assert (soon["last"], late["last"]) == ("pinch → drop", "")
    assert soon["commanded_s"] == late["commanded_s"] == 5.0


def test_the_zones_of_the_dome_are_a_picture_in_the_view() -> None:
    kind, _, data = page.view(orb(), ENGLISH, PAD, 0.0)["zones"].partition(",")
    assert kind == "data:image/png;base64"
    assert base64.b64decode(data).startswith(b"\x89PNG")
    assert page.view(OrbState(), ENGLISH, PAD, 0.0)["zones"] == ""


def test_the_zone_under_a_finger_is_lit() -> None:
    state = orb()
    dark = page.view(state, ENGLISH, PAD, 0.0)["zones"]
    state.contacts = (Contact(32, 0.5, 2.0, 9.0, 7.0),)
    assert page.view(state, ENGLISH, PAD, 0.0)["zones"] != dark


def test_the_board_is_shown_in_the_colours_of_the_pieces() -> None:
    state = orb()
    state.board = ["..T.", ".TTT"]
    view = page.view(state, ENGLISH, PAD, 0.0)
    assert view["board"] == ["..T.", ".TTT"]
    assert view["colours"]["T"].startswith("rgb(")


def test_a_view_and_its_words_are_json() -> None:
    view = page.view(orb(), ENGLISH, PAD, 0.0)
    assert json.loads(json.dumps(view)) == view
    assert set(view["words"]) == {"language", "connecting", "lost", "taken", "ended"}
