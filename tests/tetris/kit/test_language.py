"""The window's words: every language says all that there is to say."""

import re
import string
from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from controller.shared.notices import TEMPLATES
from tetris.engine.events import Action
from tetris.engine.modes import MODES
from tetris.kit import bindings, language, theme
from tetris.kit.theme import PALETTES

OTHERS = [name for name in language.names() if name != language.FALLBACK]


def fields(words: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(words) if name}


def test_there_are_english_and_two_more() -> None:
    assert language.names()[0] == "en"
    assert {"de", "fr"} <= set(language.names())


@pytest.mark.parametrize("name", OTHERS)
def test_every_language_has_the_same_keys_and_the_same_gaps_to_fill(name: str) -> None:
    notices = {f"said.{code}": template for code, template in TEMPLATES.items()}
    english, other = {**notices, **language.table("en")}, language.table(name)
    assert set(other) == set(english)
    assert {key: fields(words) for key, words in other.items()} == {
        key: fields(words) for key, words in english.items()
    }


@pytest.mark.parametrize(
    ("name", "score", "time", "share"),
    [
        ("en", "12,345.6", "1:05.20", "85 %"),
        ("de", "12.345,6", "1:05,20", "85 %"),
        ("fr", "12\u202f345,6", "1:05,20", "85 %"),
    ],
)
def test_numbers_have_the_signs_of_the_language(
    name: str, score: str, time: str, share: str
) -> None:
    words = language.load(name)
    assert words.number(12345.6, ",.1f") == score
    assert words.number("1:05.20") == time
    assert words.number(0.85, ".0%") == share


def literal_keys() -> Iterator[str]:
    folder = Path(language.__file__).parent.parent
    for file in folder.rglob("*.py"):
        yield from re.findall(r"words\(\s*\"([a-z_.0-9]+)\"", file.read_text("utf-8"))
        yield from re.findall(r"Figure\(\s*\"([a-z_.0-9]+)\"", file.read_text("utf-8"))


def test_every_word_that_the_window_asks_for_is_there() -> None:
    asked = set(literal_keys())
    assert len(asked) > 40
    asked |= {f"modes.{mode}.{part}" for mode in MODES for part in ("title", "text")}
    asked |= {f"settings.theme_{name}" for name in PALETTES}
    asked |= {f"actions.{action}" for action in bindings.ACTIONS}
    asked |= {f"actions.{action.value}" for action in Action}
    assert asked - set(language.table("en")) == set()


def test_a_word_that_a_language_lacks_is_english_and_one_that_none_has_is_its_key() -> None:
    words = language.Words("xx", {"menu.play": "Ludi"}, language.table("en"))
    assert words("menu.play") == "Ludi"
    assert words("menu.quit") == "Quit"
    assert words("no.such.key") == "no.such.key"


@pytest.mark.parametrize(
    ("environment", "name"),
    [
        ({"LANG": "de_AT.UTF-8"}, "de"),
        ({"LANG": "fr"}, "fr"),
        ({"LC_ALL": "C", "LANG": "de_DE.UTF-8"}, "en"),
        ({"LANG": "tlh"}, "en"),
        ({}, "en"),
    ],
)
def test_the_language_of_the_system_is_taken(environment: dict[str, str], name: str) -> None:
    assert language.of_system(environment) == name


def test_a_language_that_is_gone_is_english() -> None:
    assert language.load("klingon").name == "en"


@pytest.mark.parametrize("name", language.names())
def test_the_font_has_every_letter_of_every_language(name: str) -> None:
    pygame.font.init()
    letters = sorted(set("".join(language.table(name).values())))
    missing = [
        letter
        for letter, metrics in zip(letters, theme.font(30).metrics("".join(letters)), strict=True)
        if metrics is None
    ]
    assert missing == []


def test_the_font_has_every_sign_on_the_keys() -> None:
    pygame.font.init()
    names = [name for by in (bindings.KEYS, bindings.PADS) for each in by.values() for name in each]
    signs = "".join(bindings.caption(name, language.load("de")) for name in names)
    assert None not in theme.font(30).metrics(signs)
