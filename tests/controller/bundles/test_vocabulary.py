"""Vocabularies: what somebody teaches, read from a file."""

from pathlib import Path

import pytest

from controller.bundles import bundle, vocabulary
from controller.bundles.vocabulary import VocabularyError


def test_the_paper_s_gestures_ship_and_ask_for_what_the_bundle_does() -> None:
    paper = vocabulary.shipped()
    orb = bundle.read(bundle.default_path())
    assert paper.labels == orb.labels
    assert paper.mapping == orb.mapping
    assert paper.located == ("press",)
    mirrors = {entry.label: entry.mirror for entry in paper.entries if entry.mirror != "self"}
    assert mirrors == {"twist_cw": "twist_ccw", "twist_ccw": "twist_cw"}
    assert {(entry.rotations, entry.shifts) for entry in paper.entries} == {("all", False)}


KNOCK = """
name = "mine"
[[gesture]]
label = "press"
located = true
shifts = true
[[gesture]]
label = "knock"
say = "knock twice"
command = "hold"
file = "knock.toml"
"""


def test_a_vocabulary_is_read_with_its_commands_and_files(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(KNOCK)
    mine = vocabulary.read(path)
    assert mine.labels == ("null", "press", "knock")
    assert mine.table == {"knock": "hold"}
    assert mine.mapping.command("knock", None) == "hold"
    assert mine.files == (tmp_path / "knock.toml",)
    assert [entry.say for entry in mine.entries] == ["press", "knock twice"]
    assert [entry.shifts for entry in mine.entries] == [True, False]
    assert mine.text == KNOCK


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "has no gestures"),
        ("gesture = 3", "has no gestures"),
        ("gesture = [3]", "gesture 1 is 3"),
        ("[[gesture]]", "label = None"),
        ('[[gesture]]\nlabel = "null"', "not null"),
        ('[[gesture]]\nlabel = "Press"', "small letters"),
        ('[[gesture]]\nlabel = "a"\n[[gesture]]\nlabel = "a"', "two gestures 'a'"),
        ('[[gesture]]\nlabel = "a"\nmood = 1', r"gesture 1 \(a\) has the unknown key 'mood'"),
        ('[[gesture]]\nlabel = "a"\nsay = "x\\ny"', "write one line"),
        ('[[gesture]]\nlabel = "a"\nrotations = "some"', "one of none, half, all"),
        ('[[gesture]]\nlabel = "a"\nmirror = "b"', "does not name it in turn"),
        ('[[gesture]]\nlabel = "a"\nlocated = 1', "true or false"),
        ('[[gesture]]\nlabel = "a"\nshifts = "all"', "true or false"),
        ('[[gesture]]\nlabel = "a"\ncommand = "Jump!"', "is no command"),
        ('[[gesture]]\nlabel = "a"\ncommand = []', "no rules"),
        ('[[gesture]]\nlabel = "a"\ncommand = 7', "7"),
        ('[[gesture]]\nlabel = "a"\nfile = 3', "not the name"),
        ("[[gesture]", "mine.toml, line 1: expected"),
        ('extends = "mine"\n[[gesture]]\nlabel = "a"', "one of paper"),
        ('extends = "paper"\n[[gesture]]\nlabel = "press"', "two gestures 'press'"),
        ("colour = 1", "unknown key 'colour'"),
    ],
)
def test_a_mistake_is_told_with_where_it_is(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(VocabularyError, match=complaint):
        vocabulary.read(path)


def test_a_file_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    with pytest.raises(VocabularyError, match="cannot read"):
        vocabulary.read(tmp_path / "absent.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(VocabularyError, match="not text in UTF-8"):
        vocabulary.read(tmp_path / "binary.toml")
