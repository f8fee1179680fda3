"""Words for people: no sentence of the window is a command line, a path or an identifier."""

import re
from collections.abc import Iterator

import pytest

from controller.shared.notices import TEMPLATES
from tests.host.ui.test_said import INSIDE
from tetris.kit import language

# By key: the lab is for those who build an orb, and places there are numbers.
DETAILS = ("lab.", "fault.")
FORBIDDEN = {
    "a command": r"\b(controller|models|orbtouch|pip|python) +(-|[a-z]+\b)|\bhost -",
    "an option": r"(^|\s)--?\w",
    "a path": r"\w/\w+\.|\.(md|toml|orb|npz|tetris)\b",
    "an identifier": r"(?<![{\w])[a-z]+_[a-z]+|\b[a-z]{2,}[A-Z]\w*|\b[A-Z][a-z]+[A-Z](?!ouch)\w*",
    "an extra": r"\[\w+\]|onnxruntime|torch\b",
    "a taxel's number": r"(?i)taxel\w* *(\(|\d|\{row|row|zeile|ligne)",
    "a question without an object": r"(?i)^(are you sure|really|wirklich|êtes-vous sûr)",
}


def sentences(name: str) -> Iterator[tuple[str, str]]:
    """Yield every sentence of the window in a language, by key."""
    words = language.load(name)
    keys = {**words.spare, **words.table, **{f"said.{code}": "" for code in TEMPLATES}}
    for key in keys:
        said = words(key)
        if not key.startswith(DETAILS):
            yield key, TEMPLATES[key.removeprefix("said.")] if said == key else said


@pytest.mark.parametrize("name", language.names())
@pytest.mark.parametrize("kind", FORBIDDEN)
def test_no_sentence_shows(kind: str, name: str) -> None:
    found = {key: said for key, said in sentences(name) if re.search(FORBIDDEN[kind], said)}
    assert not found


@pytest.mark.parametrize("name", language.names())
def test_no_sentence_has_a_path_or_an_engine_set_in(name: str) -> None:
    fields = {key: set(re.findall(r"\{(\w+)", said)) & INSIDE for key, said in sentences(name)}
    assert not {key for key, shown in fields.items() if shown}


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        ("a command", "Run: controller doctor"),
        ("an option", "give both the same --key FILE"),
        ("a path", "See docs/hardware.md."),
        ("an identifier", "double_tap is learned"),
        ("an identifier", "TypeError on the orb"),
        ("an extra", "reinstall onnxruntime"),
        ("a taxel's number", "taxel row 4, column 2"),
    ],
)
def test_such_sentences_are_found(kind: str, sentence: str) -> None:
    assert re.search(FORBIDDEN[kind], sentence)
