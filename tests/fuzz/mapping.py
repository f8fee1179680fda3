"""Mappings: any file is read, or refused in one sentence, and what is read presses only its keys.

The bytes choose from words that mappings are made of, so that most inputs are nearly right; or
they are the file itself. Both tables are fed: command to key, and gesture to command.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from importlib import resources
from pathlib import Path
from typing import Final

from controller.bundles import users_table
from controller.links.bluetooth.hid.reports import OUTPUTS
from controller.recognition.user_id import Users
from controller.shared.errors import UserError
from controller.shared.keymap import keymap
from controller.shared.keymap.key_state import KeyState
from controller.shared.keymap.keymap import GAMEPAD, KEYBOARD, KeyMap, KeyMapError

from .choices import Choices

LABELS: Final = ("null", "press", "pinch", "twist_cw")
TWO: Final = Users(names=("ann", "bob"))
KINDS: Final = (KEYBOARD, GAMEPAD, OUTPUTS)
WORDS: Final = (
    "\n", " = ", "{ ", " }", ", ", '"', "[everywhere]\n", "[profile.game]\n", "[profile.", "]\n",
    "left", "drop", "menu", "key", "pad", "text", "arm", "true", "false", "profile", '"game"',
    "mode", '"hold"', '"tap"', '"repeat"', '"toggle"', "down_ms", "every_ms", "60", "1e999", "nan",
    "-1", "9" * 400, '"a"', '"ctrl+alt+delete"', '"alt+f4"', '"lb+a"', "allow = [", "]",
    "arm_key = ", "profile_key", '"f9"', "[[press]]\n", "command", '"down"', "below", "left_of",
    "1.5", "pinch", '"none"', "inf", "'''", '"\\u0007"', '"\\u001b[2J" = ',
    "[long]\n", "long_ms = ", '"\\u2028"', "#", "1979-05-27", "[[", ".",
    'left = "left"\n', 'menu = { arm = true }\n', 'down = { key = "down", mode = "hold" }\n',
    'say = { text = "Hi!" }\n', 'pause = { profile = "game" }\n', "press", "null", "\r", "0x1f",
    "[users.ann]\n", "[users.", "[[users.bob.press]]\n", "users", "host", '"next"',
)  # fmt: skip
_KEYS: Final = b"""[everywhere]
menu = { arm = true }
[profile.game]
left = "left"
"""
_GESTURES: Final = b"""pinch = "hold"
[[press]]
command = "left"
left_of = 2.0
[[press]]
command = "right"
[users.ann]
pinch = "drop"
"""
DICTIONARY: tuple[bytes, ...] = ()
_PLACE: Final = tempfile.TemporaryDirectory(prefix="orbtouch-fuzz-")
_FILE: Final = Path(_PLACE.name) / "mapping.toml"


def seeds() -> Iterable[bytes]:
    """Return inputs to begin with: the shipped mappings, and words in order."""
    for which in range(2):
        yield bytes([2 * which + 1]) + _KEYS
    yield b"\5" + (resources.files("controller.shared.keymap") / "default.toml").read_bytes()
    yield b"\7" + _GESTURES
    yield b"\0" + bytes([7, 56, 57, 58, 59])
    yield b"\6" + bytes([46, 1, 11, 0, 42, 43, 1, 44])


def one(data: bytes) -> None:
    """Read a mapping, and play with it if there is one."""
    choices = Choices(data)
    how = choices.number() % 8
    raw, kind = how % 2, how // 2
    content = (
        choices.rest() if raw else "".join(WORDS[n % len(WORDS)] for n in choices.rest()).encode()
    )
    _FILE.write_bytes(content)
    try:
        if kind == len(KINDS):
            table, people = users_table.read_mapping(_FILE, LABELS)
            TWO.overridden(table, people)
            for own in (table, *people.values()):
                for label in LABELS:
                    for touch in (None, (0.0, 0.0), (4.0, 4.0)):
                        own.command(label, touch)
            return
        key_map = keymap.load(_FILE, KINDS[kind])
    except (KeyMapError, UserError) as error:
        _is_sentence(str(error))
        return
    _play(key_map)


def _is_sentence(words: str) -> None:
    assert words
    assert words.isprintable(), "a refusal must not reach the terminal with control codes"


def _play(key_map: KeyMap) -> None:
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
