"""Sentences of the orb and the trainer in the window's language."""

import pytest

from controller.shared.notices import TEMPLATES, Notice, listed, names, notice
from host.ui.naming import check_name, said
from tetris.kit.language import load

# Fields that a window shows on the page of details alone.
INSIDE = {"path", "folder", "row", "column", "places", "engine"}
LEFT_OUT = {"name", "why", "command"}  # may be missing


@pytest.mark.parametrize("language", ["en", "de", "fr"])
@pytest.mark.parametrize("code", TEMPLATES)
def test_every_notice_has_words(code: str, language: str) -> None:
    fields = [f"{number}7" for number in range(len(names(code)) or code == "list")]
    words = said(load(language), Notice(code, fields))
    assert words != f"said.{code}"
    assert "{" not in words
    shown = [
        one for name, one in zip(names(code), fields, strict=False) if name not in INSIDE | LEFT_OUT
    ]
    assert all(one in words for one in shown)


def test_figures_places_and_gestures_are_set_in() -> None:
    words = load("de")
    where = notice("taxel", 2, 1)
    assert said(words, notice("no_signal", where)) == "eine Stelle der Haut: kein Signal"
    press = notice("gesture", "press")
    causes = notice("also", notice("counted", 3, notice("too_short")), notice("taken_for", press))
    assert said(words, causes) == "3 zu kurz, gehalten für drücken"
    both = listed([press, notice("gesture", "my_own")])
    assert said(words, notice("wait", both, 0.3)) == (
        "drücken und my own warten darauf jetzt 0,30 s"
    )


def test_free_text_and_english_stay_as_they_are() -> None:
    assert said(load("de"), "the moon is full") == "the moon is full"
    made = notice("many_waiting", 60)
    assert said(load("en"), made) == str(made)


def test_names_of_checks_are_words_or_notices() -> None:
    assert check_name(load("de"), "leads") == "Leitungen"
    assert check_name(load("de"), notice("row", 2)) == "Zeile 2"
    assert check_name(load("fr"), "SPI bus") == "SPI bus"
