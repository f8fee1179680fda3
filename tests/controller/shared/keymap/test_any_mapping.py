"""Mappings: any file is read or refused in one sentence, and what is read presses only its keys.

Words that mappings are made of are drawn, so that most files are nearly right.
"""

from importlib import resources
from pathlib import Path
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import users_table
from controller.links.bluetooth.hid.reports import OUTPUTS
from controller.recognition.user_id import Users
from controller.shared.errors import UserError
from controller.shared.keymap import keymap
from controller.shared.keymap.key_state import KeyState
from controller.shared.keymap.keymap import GAMEPAD, KEYBOARD, KeyMap, KeyMapError, Outputs

LABELS: Final = ("null", "press", "pinch", "twist_cw")
TWO: Final = Users(names=("ann", "bob"))
KINDS: Final = (KEYBOARD, GAMEPAD, OUTPUTS)
WORDS: Final = (
    "\n", " = ", "{ ", " }", ", ", '"', "[everywhere]\n", "[profile.game]\n", "[profile.", "]\n",
    "left", "drop", "menu", "key", "pad", "arm", "true", "false", "profile", '"game"',
    "mode", '"hold"', '"tap"', '"repeat"', '"toggle"', "down_ms", "every_ms", "60", "1e999", "nan",
    "-1", "9" * 400, '"a"', '"ctrl+alt+delete"', '"alt+f4"', '"lb+a"', "allow = [", "]",
    "allow = ", '"f9"', "[[press]]\n", "command", '"down"', "below", "left_of",
    "1.5", "pinch", '"none"', "inf", "'''", '"\\u0007"', '"\\u001b[2J" = ',
    "[long]\n", "long_ms = ", '"\\u2028"', "#", "1979-05-27", "[[", ".",
    'left = "left"\n', 'menu = { arm = true }\n', 'down = { key = "down", mode = "hold" }\n',
    'pause = { profile = "game" }\n', "press", "null", "\r", "0x1f",
    "[users.ann]\n", "[users.", "[[users.bob.press]]\n", "users", "host", '"next"',
)  # fmt: skip
SHIPPED: Final = (resources.files("controller.shared.keymap") / "default.toml").read_text()
GESTURES: Final = """pinch = "hold"
[[press]]
command = "left"
left_of = 2.0
[[press]]
command = "right"
[users.ann]
pinch = "drop"
"""
words = st.lists(st.sampled_from(WORDS), max_size=80).map("".join)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file to write mappings into."""
    return tmp_path_factory.mktemp("any") / "mapping.toml"


@pytest.mark.parametrize("outputs", KINDS, ids=("keyboard", "gamepad", "hid"))
@pytest.mark.parametrize("start", ["", SHIPPED], ids=("empty", "shipped"))
def test_any_keys_are_read_or_refused_in_a_sentence(
    start: str, outputs: Outputs, file: Path
) -> None:
    @settings(deadline=None, max_examples=60)
    @given(words)
    def read(text: str) -> None:
        file.write_text(start + text)
        try:
            key_map = keymap.load(file, outputs)
        except (KeyMapError, UserError) as error:
            is_sentence(str(error))
        else:
            play(key_map)

    read()


@pytest.mark.parametrize("start", ["", GESTURES], ids=("empty", "people"))
def test_any_commands_of_gestures_are_read_or_refused_in_a_sentence(start: str, file: Path) -> None:
    @settings(deadline=None, max_examples=100)
    @given(words)
    def read(text: str) -> None:
        file.write_text(start + text)
        try:
            table, people = users_table.read_mapping(file, LABELS)
            TWO.overridden(table, people)
        except UserError as error:
            is_sentence(str(error))
        else:
            for own in (table, *people.values()):
                for label in LABELS:
                    for touch in (None, (0.0, 0.0), (4.0, 4.0)):
                        own.command(label, touch)

    read()


def is_sentence(words: str) -> None:
    assert words
    assert words.isprintable(), "a refusal must not reach the terminal with control codes"


def play(key_map: KeyMap) -> None:
    """Give every command in every profile, and look at what is pressed."""
    pressed, now_s = KeyState(key_map), 0.0
    for profile in key_map.profiles:
        pressed.switch(profile)
        pressed.arm("to try it")
        for command in key_map.profiles[profile]:
            pressed.command(command, now_s)
            now_s += 0.03
            pressed.tick(now_s)
            assert set(pressed.down) <= key_map.keys
    pressed.disarm("at the end")
    assert not pressed.down
    down: set[str] = set()
    for stroke in pressed.strokes:
        assert stroke.key in key_map.keys
        assert (stroke.key in down) is not stroke.down
        (down.add if stroke.down else down.remove)(stroke.key)
    assert not down
