"""Sentences of the orb and the trainer in the window's language."""

import ast
import re
from collections.abc import Iterator

import pytest

from controller.diagnostics import report
from host.ui.naming import said
from models.results import verdict
from tests.support import ROOT
from tetris.kit.language import load, table

SENT = (  # what the orb sends to a window, by module
    "controller/remote/teacher.py",
    "controller/remote/examples.py",
    "controller/remote/link_recording.py",
    "controller/adapt/few_shot.py",
    "controller/adapt/commands.py",
    "controller/adapt/correction.py",
    "controller/adapt/process.py",
)
CALLS = ("AdaptError", "BundleError", "SensorError", "ExampleError", "RecordingError")
CHECKS = (
    "controller/diagnostics/skin_checks.py",
    "controller/diagnostics/calibration.py",
    "controller/remote/link_check.py",
)
ANSWERS = ("_failed", "_status", "untaken")
BOARD = ("swapped_rows", "swapped_columns", "mirrored", "turned", "stiff")


def text(node: ast.expr) -> str:
    """Return a text with 7 in place of what is set into it; "" if it is none."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(text(part) or "7" for part in node.values)
    return ""


def sent() -> Iterator[str]:
    """Yield the sentences that these modules make, except nested ones."""
    for path in SENT:
        for node in ast.walk(ast.parse((ROOT / path).read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                if node.func.id in (*CALLS, *ANSWERS):
                    yield from (text(one) for one in node.args if " " in text(one))
                if node.func.id == "LearnStatus":
                    yield from (text(one) for one in node.args[2:3] if text(one))


def checks() -> Iterator[str]:
    """Yield what the checks that run over a link find and advise."""
    for path in CHECKS:
        for node in ast.walk(ast.parse((ROOT / path).read_text())):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "Row":
                yield from (text(one) for one in node.args[2:4] if " " in text(one))
    for code in BOARD:
        found, advice = report.FAULTS[code].values()
        figures = {"mirrored": "top to bottom", "swapped_rows": "row 3, and the other way round",
                   "swapped_columns": "column 3, and the other way round"}  # fmt: skip
        yield from (found.format(figures.get(code, "7")), advice)


VERDICTS = [
    *verdict.REASONS,
    *verdict.REASONS.values(),
    *verdict._UNKNOWN,
    "3 too short, 2 taken for press; 10 more examples or a firmer touch",
    "taken for press; a movement less like press",
]
FAULTS = (
    "taxel row 0, column 3: no signal, play goes on without; fasten the lead",
    "a lead crackles: it was off and on again several times; fasten leads and plug",
    "row 3 has drifted by -20 %; look at its lead",
    "taxel row 1, column 2: drifted by +49 %; the film may be cracking",
    "no quiet second since the start; take hands and things off the orb",
)
ALL = sorted({*sent(), *checks(), *VERDICTS, *FAULTS} - {"7: 7", "air: 7"})


@pytest.mark.parametrize("language", ["de", "fr"])
@pytest.mark.parametrize("sentence", ALL)
def test_every_sentence_has_words(sentence: str, language: str) -> None:
    assert said(load(language), sentence) != sentence


def test_figures_places_and_gestures_are_set_in() -> None:
    words = load("de")
    assert said(words, "row 2, column 1: no signal") == "Zeile 2, Spalte 1: kein Signal"
    assert said(words, "3 too short, 2 taken for press; 10 more examples or 0.2 s longer") == (
        "3 zu kurz, 2 gehalten für drücken; 10 Beispiele mehr oder 0,2 s länger"
    )


def test_an_unknown_sentence_stays_english() -> None:
    assert said(load("de"), "the moon is full") == "the moon is full"


def test_english_is_its_own_template() -> None:
    english = {key: line for key, line in table("en").items() if key.startswith("said.")}
    for key, line in english.items():
        filled = re.sub(r"\{\w+\}", "7", line)
        assert said(load("en"), filled) == filled, key
