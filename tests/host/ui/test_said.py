"""Sentences of the orb and the trainer in the window's language."""

import pytest

from controller.shared.notices import TEMPLATES, Notice, listed, notice
from host.ui.naming import check_name, said
from tetris.kit.language import load


@pytest.mark.parametrize("language", ["de", "fr"])
@pytest.mark.parametrize("code", TEMPLATES)
def test_every_notice_has_words(code: str, language: str) -> None:
    fields = ["7"] * max(TEMPLATES[code].count("{"), code == "list")
    made = Notice(code, fields)
    words = said(load(language), made)
    assert words != f"said.{code}"
    assert "{" not in words
    assert all(words.count(one) >= 1 for one in fields)


def test_figures_places_and_gestures_are_set_in() -> None:
    words = load("de")
    where = notice("taxel", 2, 1)
    assert said(words, notice("no_signal", where)) == "Taxel Zeile 2, Spalte 1: kein Signal"
    press = notice("gesture", "press")
    causes = notice("also", notice("counted", 3, notice("too_short")), notice("taken_for", press))
    assert said(words, causes) == "3 zu kurz, gehalten für drücken"
    both = listed([press, notice("gesture", "my_own")])
    assert said(words, notice("wait", both, 0.3)) == (
        "drücken und my own warten darauf jetzt 0.30 s"
    )


def test_free_text_and_english_stay_as_they_are() -> None:
    assert said(load("de"), "the moon is full") == "the moon is full"
    made = notice("many_waiting", 60)
    assert said(load("en"), made) == str(made)


def test_names_of_checks_are_words_or_notices() -> None:
    assert check_name(load("de"), "leads") == "Leitungen"
    assert check_name(load("de"), notice("row", 2)) == "Zeile 2"
    assert check_name(load("fr"), "SPI bus") == "SPI bus"
