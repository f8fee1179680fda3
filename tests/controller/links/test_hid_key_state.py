"""From commands to HID reports, on a clock that the tests own."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.links.bluetooth.hid.held_keys import GAP_S, HeldKeys
from controller.links.bluetooth.hid.reports import OUTPUTS, RELEASED, axes, gamepad, keyboard
from controller.shared.keymap.keymap import KeyMapError, load, parse
from controller.shared.protocol.messages import Command, ContactState, Telemetry

FRAME = Telemetry(1, bytes(25), (1.0,), None, "press", True, 40.0)
MAP = """
[everywhere]
menu = { host = "next" }
pause = { profile = "slides" }

[profile.game]
left = { pad = "left" }
right = { pad = "right", down_ms = 100 }
down = { key = "down", mode = "hold" }
drop = { pad = "a+stick_up", mode = "hold" }

[profile.slides]
right = { key = "ctrl+pagedown" }
hold = { host = 2 }
"""


def player_of(text: str = MAP) -> HeldKeys:
    """Return a player's keys by a mapping."""
    return HeldKeys(parse(tomllib.loads(text), OUTPUTS))


def test_two_quick_taps_are_two_presses_with_a_moment_in_between() -> None:
    player = player_of()
    player.command("left", 1.0)
    player.command("left", 1.01)
    assert player.reports() == [gamepad({"left"}), gamepad(())]
    player.tick(1.01 + GAP_S)
    assert player.reports() == [gamepad({"left"})]
    player.tick(1.01 + GAP_S + 0.05)
    assert player.reports() == [gamepad(())]


def test_keys_and_buttons_can_be_down_together() -> None:
    player = player_of()
    player.command("down", 1.0)
    player.command("left", 1.01)
    assert player.reports() == [keyboard(("down",)), gamepad({"left"})]


def test_a_key_is_up_300_ms_after_the_last_frame_and_only_a_new_touch_holds_it_again() -> None:
    keys = player_of()
    keys.take(Command("down", "press", 0.9, None, 1), 1.0)
    keys.take(FRAME, 1.025)
    assert keys.due_s == pytest.approx(1.325)
    keys.tick(1.326)
    assert keys.down == []
    keys.take(FRAME, 11.0)  # the loop goes on, and the finger is still there
    assert keys.down == []
    keys.take(Command("down", "press", 0.9, None, 2), 12.0)
    assert keys.down == ["down"]


FINGER = ContactState(1, 1.0, 3.0, depth_mm=6.0, fingers=1)


def test_a_contact_moves_the_axes_beside_the_buttons_and_its_end_centres_them() -> None:
    player = player_of()
    player.take(FINGER, 1.0)
    assert player.reports() == [gamepad((), axes(FINGER, (5, 5)))]
    player.take(FINGER, 1.025)
    assert player.reports() == []  # nothing has changed
    player.take(Command("left", "press", 0.9, None, 2), 1.05)
    assert player.reports() == [gamepad({"left"}, axes(FINGER, (5, 5)))]
    player.take(ContactState(1), 1.06)
    assert player.reports() == [gamepad({"left"})]


def test_axes_are_centred_300_ms_after_the_last_contact_and_for_another_host() -> None:
    player = player_of()
    player.take(FINGER, 1.0)
    player.reports()
    assert player.due_s == pytest.approx(1.3)
    player.tick(1.301)
    assert player.reports() == [gamepad(())]
    player.take(FINGER, 2.0)
    assert player.reset() == RELEASED
    player.take(FRAME, 2.01)
    assert player.reports() == []


def test_another_host_is_a_wish_and_lets_go_of_everything() -> None:
    player = player_of()
    player.command("left", 1.0)
    player.command("menu", 1.01)
    assert player.reports() == [gamepad({"left"}), gamepad(())]
    player.command("pause", 1.02)
    player.command("hold", 1.03)
    assert player.hosts == [0, 2]


steps = st.tuples(
    st.sampled_from(
        ["left", "right", "down", "drop", "hold", "pause", "menu", "state", "word", "touch"]
    ),
    st.floats(0.0, 0.3),
)


@settings(deadline=None)
@given(st.lists(steps))
def test_whatever_was_pressed_is_up_once_the_orb_is_silent(script: list[tuple[str, float]]) -> None:
    player, now_s = player_of(), 1.0
    for name, pause_s in script:
        now_s += pause_s
        if name == "state":
            player.state((), now_s)
        elif name == "touch":
            player.take(FINGER, now_s)
        elif name == "word":
            player.still_held(now_s)
        else:
            player.command(name, now_s)
    while (due_s := player.due_s) is not None:
        assert due_s > now_s
        now_s = due_s
        player.tick(now_s)
    latest = {report.id: report for report in [*RELEASED, *player.reports()]}
    assert latest == {report.id: report for report in RELEASED}


def test_a_quick_tap_after_a_repeated_key_waits_a_moment() -> None:
    player = player_of('[profile.a]\nleft = { key = "a", mode = "repeat" }\ndown = { key = "a" }')
    player.command("left", 1.0)
    player.command("down", 1.01)
    player.tick(1.01 + GAP_S)
    assert player.reports() == [keyboard(("a",)), keyboard(()), keyboard(("a",))]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("left = 'left'", 'as in { pad = "a" }'),
        ("left = { pad = 'c' }", "there is no pad button 'c'"),
        ("left = { pad = 'look_up' }", "there is no pad button 'look_up'"),
        ("left = { key = 'play' }", "there is no key 'play'"),
        ("left = { key = 'ctrl+altgr+f2' }", "ctrl+alt+f2 reaches past"),
        ("left = { arm = true }", "'arm' needs --target keyboard or gamepad"),
        ("left = { host = 'last' }", 'write "next", or 1 to 9'),
        ("left = { host = true }", "host is True"),
        ("left = { host = 0 }", "host is 0"),
    ],
)
def test_a_mistake_is_one_sentence_with_the_line(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(f"[profile.a]\n{text}")
    with pytest.raises(KeyMapError) as caught:
        load(file, OUTPUTS)
    assert str(caught.value).startswith(f"{file}, line 2 has [profile.a] left: ")
    assert said in str(caught.value)
    assert str(caught.value).endswith(" (orbtouch docs hid)")
