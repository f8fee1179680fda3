"""Key mapping files: valid entries, and the message for invalid ones."""

from pathlib import Path

import pytest

from controller.links.bluetooth.hid.reports import OUTPUTS
from controller.shared.keymap import keymap
from controller.shared.keymap.key_names import DANGEROUS, KEYS, PAD, Chord, danger
from controller.shared.protocol.messages import COMMANDS
from tests.support import ROOT


def mapping(tmp_path: Path, text: str, outputs: keymap.Outputs = keymap.KEYBOARD) -> keymap.KeyMap:
    file = tmp_path / "keys.toml"
    file.write_text(text)
    return keymap.load(file, outputs)


def test_command_presses_a_key_or_a_chord(tmp_path: Path) -> None:
    found = mapping(
        tmp_path,
        """
        [everywhere]
        menu = { arm = true }
        pause = { profile = "slides" }

        [profile.game]
        left = "Left"
        down = { key = "down", mode = "hold" }
        drop = { key = "space", mode = "repeat", down_ms = 40, every_ms = 200 }
        hold = { key = "ctrl+shift+t", mode = "toggle" }

        [profile.slides]
        drop = "pagedown"
        """,
    )
    game, slides = found.profiles["game"], found.profiles["slides"]
    assert found.first == "game"
    assert game["left"] == keymap.Press(("left",))
    assert game["down"] == keymap.Press(("down",), keymap.Mode.HOLD)
    assert game["drop"] == keymap.Press(("space",), keymap.Mode.REPEAT, 0.04, 0.2)
    assert game["hold"] == keymap.Press(("ctrl", "shift", "t"), keymap.Mode.TOGGLE)
    assert slides["drop"] == keymap.Press(("pagedown",))
    assert game["menu"] == slides["menu"] == keymap.Arm()
    assert game["pause"] == keymap.Switch("slides")
    assert found.keys == {"left", "down", "space", "ctrl", "shift", "t", "pagedown"}


def test_command_that_is_held_for_long_arms_or_changes_the_profile(tmp_path: Path) -> None:
    found = mapping(
        tmp_path,
        """
        long_ms = 2000
        [profile.game]
        drop = "space"
        [long]
        drop = { arm = true }
        hold = { profile = "game" }
        """,
    )
    assert found.long == {"drop": keymap.Arm(), "hold": keymap.Switch("game")}
    assert found.long_s == 2.0
    assert found.keys == {"space"}


SHIPPED = [
    ("keyboard", keymap.KEYBOARD),
    ("gamepad", keymap.GAMEPAD),
    ("keyboard", OUTPUTS),
    ("gamepad", OUTPUTS),
]


@pytest.mark.parametrize(("name", "outputs"), SHIPPED)
def test_shipped_mappings_press_a_key_for_each_command(name: str, outputs: keymap.Outputs) -> None:
    [entries] = keymap.load(Path(name), outputs).profiles.values()
    presses = {str(entries[command]) for command in COMMANDS}
    assert len(presses) == len(COMMANDS)


@pytest.mark.parametrize(("name", "outputs"), SHIPPED[:2])
def test_shipped_mapping_is_armed_by_every_orb(name: str, outputs: keymap.Outputs) -> None:
    from controller.bundles import bundle

    shipped = keymap.load(Path(name), outputs)
    [command] = shipped.long
    assert shipped.long == {command: keymap.Arm()}
    assert command in bundle.read(bundle.default_path()).mapping.commands


def test_pad_has_buttons_a_hat_and_sticks(tmp_path: Path) -> None:
    found = mapping(
        tmp_path,
        """
        [profile.pad]
        left = "stick_left"
        drop = { pad = "lb+a", mode = "hold" }
        """,
        keymap.GAMEPAD,
    )
    assert found.profiles["pad"]["drop"] == keymap.Press(("pad_lb", "pad_a"), keymap.Mode.HOLD)
    assert found.keys == {"pad_lb", "pad_a", "pad_stick_left"}


GAME = "[profile.game]\n"
BROKEN = "[profile.game\n"


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("", "", "a table [profile.NAME]"),
        ("[profile]\n", "", "no profile"),
        ("[profil.game]\n", ", line 1", "unknown key 'profil'"),
        (GAME + 'left = "a"\nlef = "b"\n[lang]\n', ", line 4", "unknown key 'lang'"),
        (GAME + '"turn left" = "a"', ", line 2", "turn left: a command is a name in small"),
        ('[profile]\n\ngame.left = "lefft"', ", line 3", "[profile.game] left: there is no key"),
        ('[profile.game.left]\nmode = "hold"\nkey = "lefft"', ", line 1", "no key 'lefft'"),
        ('[profile]\ngame = {left = "a", right = "rigt"}', ", line 2", "no key 'rigt'"),
        ('[profile."my game"]\nleft = "lefft"', ", line 2", "no key 'lefft'"),
        (GAME + 'Left = "a"', ", line 2", "small letters"),
        (GAME + 'left = "lefft"', ", line 2", "there is no key 'lefft'"),
        (GAME + 'a = "b"\nleft = ""', ", line 3", "there is no key ''"),
        (GAME + 'left = "a+a"', ", line 2", "names a key twice"),
        (GAME + "left = 3", ", line 2", "must have one of key, pad, arm, profile"),
        (GAME + 'left = {key = "a", arm = true}', ", line 2", "must have one of"),
        (GAME + 'left = {key = "a", why = 1}', ", line 2", "unknown key 'why'"),
        (GAME + 'left = {arm = true, mode = "tap"}', ", line 2", "no place beside 'arm'"),
        (GAME + 'left = {key = "a", mode = "hit"}', ", line 2", "tap, hold, repeat, toggle"),
        (GAME + 'left = {key = "a", down_ms = 9}', ", line 2", "a number from 10 to 1000"),
        (
            GAME + 'left = {key = "a", mode = "repeat", down_ms = 80, every_ms = 80}',
            ", line 2",
            "every_ms must be more",
        ),
        (GAME + '"\\u001b[2J" = "a"', ", line 1", r"[profile.game] '\x1b[2J': a command is a name"),
        ('[profile."\\u0007"]\nX = 1', "", r"profile '\x07', whose name has control characters"),
        ("long_ms = 100\n" + GAME, ", line 1", "a number from 500 to 10000"),
        (GAME + '[long]\ndrop = "a"', ", line 3", "only arm and profile can wait"),
        (GAME + '[long]\ndrop = {profile = "x"}', ", line 3", "profile is 'x'"),
        (GAME + "left = {arm = false}", ", line 2", "write arm = true"),
        (GAME + 'left = {profile = "x"}', ", line 2", "profile is 'x'; there are: game"),
        (GAME + 'left = {pad = "a"}', ", line 2", "needs --target gamepad"),
        (GAME + 'left = "alt+f4"', ", line 2", 'write allow = ["alt+f4"]'),
        (GAME + 'left = "super+l"', ", line 2", "meta reaches past"),
        ('allow = "alt+f4"\n' + GAME, ", line 1", "expected is a list"),
        ('allow = ["alt+f44"]\n' + GAME, ", line 1", "there is no key 'f44'"),
        (BROKEN, ", line 1: ", "expected"),
    ],
)
def test_mistake_is_told_with_its_place(tmp_path: Path, text: str, line: str, said: str) -> None:
    with pytest.raises(keymap.KeyMapError) as refused:
        mapping(tmp_path, text)
    told = str(refused.value)
    assert told.startswith(f"{tmp_path / 'keys.toml'}{line}{'' if text == BROKEN else ' has '}")
    assert said in told
    assert "\n" not in told


def test_file_that_is_missing_or_no_text_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(keymap.KeyMapError, match="cannot read"):
        keymap.load(tmp_path / "none.toml", keymap.KEYBOARD)
    (tmp_path / "keys.toml").write_bytes(b"\xff")
    with pytest.raises(keymap.KeyMapError, match="it is not text in UTF-8"):
        keymap.load(tmp_path / "keys.toml", keymap.KEYBOARD)
    (tmp_path / "keys.toml").write_bytes(b"#" * 70_000)
    with pytest.raises(keymap.KeyMapError, match="more than 65536 bytes"):
        keymap.load(tmp_path / "keys.toml", keymap.KEYBOARD)


def test_keyboard_s_entries_do_not_fit_a_pad(tmp_path: Path) -> None:
    with pytest.raises(keymap.KeyMapError, match="needs --target keyboard"):
        mapping(tmp_path, GAME + 'left = {key = "a"}', keymap.GAMEPAD)


def test_dangerous_chord_that_is_allowed_can_be_pressed(tmp_path: Path) -> None:
    found = mapping(tmp_path, 'allow = ["alt+f4"]\n' + GAME + 'left = "alt+f4"')
    assert found.profiles["game"]["left"] == keymap.Press(("alt", "f4"))


@pytest.mark.parametrize("chord", DANGEROUS)
def test_every_dangerous_chord_is_seen_whatever_lies_beside_it(chord: Chord) -> None:
    assert danger(chord, ())
    assert danger({*chord, "x"}, ())
    assert danger({*chord, "x"}, [tuple(chord)])
    assert not danger(chord, [tuple(chord)])


def test_either_side_s_modifier_is_the_same_danger() -> None:
    assert danger({"rctrl", "altgr", "delete"}, ()) == "ctrl+alt+delete"
    assert not danger({"ctrl", "shift", "delete"}, ())


def test_no_name_is_a_key_and_a_button() -> None:
    assert not set(KEYS) & set(PAD)


def test_mappings_in_the_documentation_can_be_read(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "keys.md").read_text(encoding="utf-8")
    blocks = [block.split("```")[0] for block in text.split("```toml\n")[1:]]
    assert blocks
    for block in blocks:
        outputs = keymap.GAMEPAD if "--target gamepad" in block else keymap.KEYBOARD
        assert mapping(tmp_path, block, outputs).keys
