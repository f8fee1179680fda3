"""Gestures that are named rightly and not answered: the report and the advice say so."""

from dataclasses import replace

from models.reports import page
from models.reports.page import ReportData
from models.results import missed_gestures
from tests.models.reports.test_report import text
from tests.support.report_results import evaluation, training

LABELS = ("null", "press", "knock")
# Of twenty knocks one is answered as a press, and six not at all.
TABLE = ((0, 1, 0), (1, 59, 0), (6, 1, 13))


def test_a_gesture_fails_if_more_are_missed_than_chance_may_explain() -> None:
    assert missed_gestures.right(TABLE) == (72, 80)
    assert missed_gestures.failing(TABLE) == [2]
    assert missed_gestures.failing(((0, 0, 0), (5, 20, 0), (6, 1, 13))) == [2, 1]  # the worst first
    assert missed_gestures.failing(((0, 0), (1, 9))) == []  # a single one


def test_a_gesture_that_fails_is_named_with_its_figure_and_what_to_do() -> None:
    said = missed_gestures.advice(LABELS, TABLE, 2)
    assert said == (
        "knock is answered rightly in 13 of 20 (6 not at all, 1 as press): record more of it, make "
        "it firmer or more distinct from rest, or let models tune choose when it counts"
    )
    assert "): record 30 more, make" in missed_gestures.advice(LABELS, TABLE, 2, more=30)
    assert "): record more of it, make" in missed_gestures.advice(LABELS, TABLE, 2, more=1)
    assert "): more of it would help little: make" in missed_gestures.advice(
        LABELS, TABLE, 2, little=True
    )
    taken = ((0, 0, 0), (0, 60, 0), (1, 6, 13))
    assert "more distinct from press" in missed_gestures.advice(LABELS, taken, 2)


def first_tile(html: str) -> str:
    return text(html.partition('<div class="cards">')[2].partition("</div>")[0] + "</div>")


def test_the_first_tile_of_a_training_counts_what_is_answered_of_all() -> None:
    made = training()
    assert made.gesture is not None
    assert made.gesture.event_accuracy > 0.98  # all are named rightly, or nearly
    gesture = replace(made.gesture, answered=TABLE)
    html = page.html(ReportData(replace(made, labels=LABELS, gesture=gesture)))
    assert first_tile(html) == (
        "90.0 % of gestures answered rightly 72 of 80 in sessions it never saw; knock: 13 of 20"
    )
    assert text(html).count("13 of 20") == 2  # and in the table of gestures


def test_what_an_evaluation_finds_out_comes_before_the_praise_of_the_training() -> None:
    praise = "there is enough of every gesture, and none is confused with another"
    made = replace(training(), advice=(praise,))
    judged = evaluation("spared")
    result = replace(judged.results[0], labels=LABELS, answered=TABLE)
    html = page.html(ReportData(made, None, replace(judged, results=(result,))))
    assert first_tile(html).startswith(
        "90.0 % of gestures answered rightly 72 of 80 in spared; knock: 13 of 20"
    )
    assert "spared: knock is answered rightly in 13 of 20 (6 not at all, 1 as press)" in text(html)
    assert praise not in text(html)
    assert praise in text(page.html(ReportData(made, None, judged)))
