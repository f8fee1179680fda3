"""The report is one file that needs nothing else, and says what was found out, and no more."""

import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest

from models import formatting
from models.reports import figures, page
from models.results.evaluation import Evaluation, LocationFigures
from models.results.training import (
    Calibration,
    ClassRow,
    Epoch,
    HeldOutScore,
    Lateness,
    Training,
)
from tests.support.report_results import evaluation, figure, session, training

VOID = {"meta", "br", "link", "img", "input", "hr"}
MEGABYTE = 1_000_000


class Reader(HTMLParser):
    """Checks that every element that is opened is closed, and collects attributes and text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "script"):
            self.text += f"{data} "


def read(html: str) -> Reader:
    reader = Reader()
    reader.feed(html)
    reader.close()
    assert reader.open == []
    return reader


def text(html: str) -> str:
    return " ".join(read(html).text.split())


@pytest.mark.parametrize(
    "found",
    [training(), evaluation()],
    ids=["training", "evaluation"],
)
def test_a_page_is_well_formed_and_refers_to_nothing_outside_itself(
    found: Training | Evaluation,
) -> None:
    html = page.html(found)
    reader = read(html)
    names = {name for name, _ in reader.attributes}
    assert not names & {"src", "srcset", "onclick", "onload"}
    assert all(to.startswith("#") for name, to in reader.attributes if name == "href")
    assert not re.search(r"https?://|url\((?!#)|@import", html)
    for drawing in re.findall(r"<svg.*?</svg>", html, re.DOTALL):
        ElementTree.fromstring(drawing)


def test_a_large_training_still_fits_into_a_megabyte() -> None:
    touches = tuple((x % 4.0, x % 3.0, 0.123456, -0.2) for x in map(float, range(10_000)))
    location = training().location
    assert location is not None
    rows = tuple(session(i) for i in range(200))
    big = training(sessions=rows, location=replace(location, touches=touches))
    judged, one = evaluation(sessions=200), figure(0.1)
    place = LocationFigures(one, one, one, 0.1, 0.2, touches)
    result = replace(judged.results[0], location=place)
    for found in (big, replace(judged, results=(result, replace(result, name="b")))):
        assert len(page.html(found).encode()) < MEGABYTE


def test_the_honest_figure_and_the_papers_stand_side_by_side_with_the_gap_in_words() -> None:
    said = text(page.html(training()))
    assert "91.2 % of the windows rightly. By the paper’s protocol it would be 97.9 %" in said
    assert "6.7 points too good to be true" in said
    assert "0.040 grid units too good to be true" in said
    assert "96.5 % and 99.20 %" in said  # binary accuracy, as the paper may have counted


def test_what_could_not_be_had_is_a_dash_and_never_nan() -> None:
    nothing = Lateness()
    nan = HeldOutScore(math.nan, math.nan, math.nan, math.nan, math.nan, math.nan, 0, 0)
    gesture, location = training().gesture, training().location
    assert gesture is not None
    assert location is not None
    epochs = (Epoch(1, 0.5, 0.8, math.nan, math.nan, math.nan),)
    zeros = ((0, 0, 0),) * 3
    bare = training(
        sessions=(session(lateness=nothing),),
        classes=(ClassRow("press", 3, 2.0, math.nan, math.nan),),
        gesture=replace(gesture, epochs=epochs, honesty=nan, event_accuracy=math.nan,
                        confusion=zeros, event_confusion=zeros,
                        calibration=Calibration(1.0, math.nan, math.nan, ())),
        location=replace(location, epochs=epochs, honesty=nan, touches=()),
    )  # fmt: skip
    html = page.html(bare)
    assert not re.search(r"\bnan\b", html, re.IGNORECASE)
    assert formatting.NONE in text(html)


def test_what_recordings_say_is_shown_as_text_and_never_run() -> None:
    evil = "</script><script>alert(1)</script><b>"
    row = session(verdict="doubtful", findings=(evil,), labeller=evil, user=r"$\frac{安 <b>")
    html = page.html(training(name=evil, sessions=(row,), advice=(evil,), notes=(evil,)))
    assert "<script" not in html
    assert "alert(1)" in text(html)


def test_drawings_are_the_same_every_time_and_take_the_colours_of_the_page() -> None:
    drawing = figures.curves(training().gesture.epochs, share=True)  # type: ignore[union-attr]
    assert drawing == figures.curves(training().gesture.epochs, share=True)  # type: ignore[union-attr]
    assert "var(--unseen)" in drawing
    assert not re.search(r"#[0-9a-f]{6}", drawing)
    assert "learned" in drawing  # text stays text
