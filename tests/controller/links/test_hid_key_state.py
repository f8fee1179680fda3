"""From commands to reports, on a clock that the tests own."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.links.bluetooth.hid.held import UP_S, WORD_S, Held
from controller.links.bluetooth.hid.mapping import HidMapError, parse, read
from controller.links.bluetooth.hid.reports import RELEASED, Report, gamepad, keyboard
from controller.protocol.messages import COMMANDS

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


def held(text: str = MAP) -> Held:
    """Return a player's keys by a mapping."""
    import tomllib

    return Held(parse(tomllib.loads(text)))


def taken(player: Held) -> list[Report]:
    """Take the reports that have gathered."""
    reports, player.output = player.output, []
    return reports


def test_a_tap_is_down_for_its_time_and_then_up() -> None:
    player = held()
    player.command("left", 10.0)
    assert taken(player) == [gamepad({"left"})]
    assert player.due_s == pytest.approx(10.05)
    player.tick(10.04)
    assert taken(player) == []
    player.tick(10.05)
    assert taken(player) == [gamepad(())]
    assert player.due_s is None


def test_each_tap_has_the_time_that_the_mapping_gives_it() -> None:
    player = held()
    player.command("right", 1.0)
    player.tick(1.09)
    assert taken(player) == [gamepad({"right"})]
    player.tick(1.1)
    assert taken(player) == [gamepad(())]


def test_two_quick_taps_are_two_presses_with_a_moment_in_between() -> None:
    player = held()
    player.command("left", 1.0)
    player.command("left", 1.01)
    assert taken(player) == [gamepad({"left"}), gamepad(())]
    player.tick(1.01 + UP_S)
    assert taken(player) == [gamepad({"left"})]
    player.tick(1.01 + UP_S + 0.05)
    assert taken(player) == [gamepad(())]


def test_what_is_held_stays_down_until_the_orb_says_otherwise() -> None:
    player = held()
    player.command("down", 1.0)
    player.state(("down",), 1.0)
    for frame in range(20):
        player.word(1.0 + frame / 10)
    assert taken(player) == [keyboard(("down",))]
    player.state((), 3.0)
    assert taken(player) == [keyboard(())]


def test_what_is_held_goes_up_when_the_orb_falls_silent() -> None:
    player = held()
    player.command("drop", 1.0)
    assert player.due_s == 1.0 + WORD_S
    player.tick(1.0 + WORD_S)
    assert taken(player) == [gamepad({"a", "stick_up"}), gamepad(())]
    assert player.told == ["drop was let go: the orb no longer says what is held"]


def test_keys_and_buttons_can_be_down_together() -> None:
    player = held()
    player.command("down", 1.0)
    player.command("left", 1.01)
    assert taken(player) == [keyboard(("down",)), gamepad({"left"})]


def test_another_profile_lets_go_of_everything_first() -> None:
    player = held()
    player.command("down", 1.0)
    player.command("pause", 1.2)
    player.command("right", 1.3)
    assert taken(player) == [keyboard(("down",)), *RELEASED, keyboard(("ctrl", "pagedown"))]
    assert player.told == ["profile slides"]


def test_another_host_is_a_wish_and_lets_go_of_everything() -> None:
    player = held()
    player.command("left", 1.0)
    player.command("menu", 1.01)
    assert taken(player) == [gamepad({"left"}), *RELEASED]
    player.command("pause", 1.02)
    player.command("hold", 1.03)
    assert [wish.number for wish in player.wishes] == [0, 2]


def test_a_command_that_the_mapping_does_not_name_does_nothing() -> None:
    player = held()
    player.command("rotate_cw", 1.0)
    assert taken(player) == []


def test_releasing_is_said_even_if_nothing_was_down() -> None:
    player = held()
    player.release()
    assert taken(player) == list(RELEASED)


def test_chords_that_only_two_commands_make_are_not_pressed() -> None:
    player = held("""
        [profile.one]
        left = { key = "alt", mode = "hold" }
        right = { key = "f4" }
    """)
    player.command("left", 1.0)
    player.command("right", 1.1)
    assert taken(player) == [keyboard(("alt",))]
    assert player.told == ["right was not pressed: alt+f4 would be down"]


steps = st.tuples(
    st.sampled_from(["left", "right", "down", "drop", "hold", "pause", "menu", "state", "word"]),
    st.floats(0.0, 0.3),
)


@settings(deadline=None)
@given(st.lists(steps))
def test_whatever_was_pressed_is_up_once_the_orb_is_silent(script: list[tuple[str, float]]) -> None:
    player, now_s = held(), 1.0
    for name, pause_s in script:
        now_s += pause_s
        if name == "state":
            player.state((), now_s)
        elif name == "word":
            player.word(now_s)
        else:
            player.command(name, now_s)
    while (due_s := player.due_s) is not None:
        assert due_s > now_s
        now_s = due_s
        player.tick(now_s)
    latest = {report.id: report for report in [*RELEASED, *taken(player)]}
    assert latest == {report.id: report for report in RELEASED} == player.latest


@pytest.mark.parametrize("name", ["gamepad", "keyboard"])
def test_the_mappings_that_ship_press_something_for_every_command(name: str) -> None:
    entries = next(iter(read(name).profiles.values()))
    assert set(entries) == set(COMMANDS)
    presses = list(entries.values())
    assert len({str(press) for press in presses}) == len(presses)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "it has no profile; write [profile.NAME] above the commands"),
        ("x = 1", "'x' is unknown; a mapping has allow, everywhere and profile"),
        ("profile = 1", "profile is no table; write [profile] above its entries"),
        ("[profile.a]\nLeft = 1", "[profile.a] Left: a command is a name in small letters"),
        ("[profile.a]\nleft = 'left'", 'write { pad = "a" }; it has one of key, pad, profile'),
        ("[profile.a]\nleft = { pad = 'c' }", "[profile.a] left: there is no pad button 'c'"),
        ("[profile.a]\nleft = { key = 'ctrl+ctrl' }", "names one twice"),
        ("[profile.a]\nleft = { key = 3 }", "3 is no name of a key"),
        ("[profile.a]\nleft = { key = 'alt+f4' }", 'write allow = ["alt+f4"] at the top'),
        ("[profile.a]\nleft = { key = 'ctrl+altgr+f2' }", "ctrl+alt+f2 reaches past"),
        ("[profile.a]\nleft = { key = 'a', mode = 'x' }", "mode is 'x', not tap or hold"),
        ("[profile.a]\nleft = { key = 'a', down_ms = 5 }", "down_ms is 5, not 10 to 1000"),
        ("[profile.a]\nleft = { key = 'a', down_ms = true }", "down_ms is True, not a number"),
        ("[profile.a]\nleft = { key = 'a', down_ms = nan }", "down_ms is nan, not 10 to 1000"),
        ("[profile.a]\nleft = { key = 'a', mode = 'hold', down_ms = 50 }", "has no meaning"),
        ("[profile.a]\nleft = { host = 'last' }", 'write "next", or 1 to 9'),
        ("[profile.a]\nleft = { host = true }", "host is True"),
        ("[profile.a]\nleft = { profile = 'b' }", "there is no profile 'b'; there are: a"),
        ("[profile.a]\nleft = { profile = 'a', mode = 'tap' }", "no place beside 'profile'"),
        ("allow = 'meta'\n[profile.a]", 'allow is no list; write allow = ["alt+f4"]'),
    ],
)
def test_a_mistake_is_told_in_one_sentence(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(HidMapError) as caught:
        read(str(file))
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(file))
    assert "\n" not in str(caught.value)


def test_a_dangerous_chord_can_be_allowed() -> None:
    player = held('allow = ["alt+f4"]\n[profile.a]\nleft = { key = "alt+f4" }')
    player.command("left", 1.0)
    assert taken(player) == [keyboard(("alt", "f4"))]


def test_a_file_that_is_not_there_is_told_with_what_ships() -> None:
    with pytest.raises(HidMapError, match=r"cannot read no\.toml: .*gamepad or keyboard"):
        read("no.toml")
