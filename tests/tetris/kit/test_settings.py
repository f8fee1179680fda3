"""The player's settings: read from a file that anybody may have edited, written safely."""

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tetris.kit import settings as file
from tetris.kit.settings import CHOICES, LIMITS, Settings, parse, stepped


def test_round_trip() -> None:
    chosen = Settings(
        mode="sprint",
        das_ms=100,
        arr_ms=0,
        theme="safe",
        patterns=True,
        language="de",
        keys={**Settings().keys, "left": ("a", "left"), "undo": ()},
    )
    assert parse(file.format_toml(chosen)) == chosen


@given(
    st.builds(
        Settings,
        mode=st.text(st.characters(codec="utf-8"), max_size=9),
        theme=st.sampled_from(CHOICES["theme"]),
        das_ms=st.integers(0, 500),
        motion=st.booleans(),
        effects=st.integers(0, 100),
    )
)
def test_any_words_and_numbers_survive_the_file(chosen: Settings) -> None:
    assert parse(file.format_toml(chosen)) == chosen


def test_an_empty_file_is_everything_as_it_comes() -> None:
    assert parse("") == Settings()


@pytest.mark.parametrize(
    "words",
    [
        "[handling]\ndas_ms = 9999",
        "[handling]\ndas_ms = -1",
        "[handling]\ndas_ms = true",
        '[handling]\ndas_ms = "fast"',
        "[screen]\ntheme = 7",
        '[screen]\ntheme = "dawn"\nlanguage = "xx"',
        "handling = 3",
        "keys = 3",
        "[keys]\nleft = 3",
        "[another]\nthing = 1",
    ],
)
def test_what_makes_no_sense_is_as_if_it_were_not_there(words: str) -> None:
    assert parse(words) == Settings()


def test_bindings_keep_what_they_know_and_drop_the_rest() -> None:
    keys = parse('[keys]\nleft = ["a", "nonsense", 3, "pad_a"]\nfly = ["b"]').keys
    assert keys["left"] == ("a", "pad_a")
    assert keys["right"] == Settings().keys["right"]
    assert "fly" not in keys


@given(st.text(max_size=60))
def test_no_text_breaks_the_reader(words: str) -> None:
    with contextlib.suppress(ValueError):
        assert isinstance(parse(words), Settings)


def test_a_file_is_made_with_its_folder_and_read_again(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "folder" / file.FILE_NAME
    assert file.load(path) == (Settings(), "")
    assert file.save(path, Settings(level=7)) == ""
    assert file.load(path) == (Settings(level=7), "")
    assert [each.name for each in path.parent.iterdir()] == [file.FILE_NAME]


@pytest.mark.parametrize("content", [b"not = = toml", b"\xff\xfe\x00", b"a = [" + b"[" * 5000])
def test_a_damaged_file_is_put_aside_with_a_sentence(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / file.FILE_NAME
    path.write_bytes(content)
    settings, sentence = file.load(path)
    assert settings == Settings()
    assert "put aside" in sentence
    (aside,) = tmp_path.iterdir()
    assert aside.name != file.FILE_NAME
    assert aside.read_bytes() == content


def test_a_folder_that_cannot_be_written_is_a_sentence(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    assert "cannot save" in file.save(blocked / file.FILE_NAME, Settings())
    assert "cannot read" in file.load(tmp_path)[1]


@pytest.mark.parametrize("name", sorted(LIMITS))
def test_a_number_steps_within_its_limits(name: str) -> None:
    least, most, step = LIMITS[name]
    settings = Settings()
    for _ in range((most - least) // step + 2):
        settings = stepped(settings, name, 1)
    assert getattr(settings, name) == most
    for _ in range((most - least) // step + 2):
        settings = stepped(settings, name, -1)
    assert getattr(settings, name) == least


def test_a_switch_turns_by_a_step_either_way() -> None:
    assert stepped(Settings(), "patterns", -1).patterns
    assert not stepped(Settings(patterns=True), "patterns", 1).patterns
