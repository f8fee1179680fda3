"""The verdict of an evaluation: the same words in the report, on a terminal and in JSON."""

import json
from dataclasses import replace

import pytest

from models.reports import cards, page
from models.results import storage, verdict
from models.results.evaluation import Evaluation
from models.results.verdict import GestureVerdict, judge
from tests.models.reports.test_report import text
from tests.support.report_results import evaluation, training

LABELS = ("null", "press", "knock")
# Of sixty presses and twenty knocks, seven knocks are not answered: they are too short.
ANSWERED = ((0, 1, 0), (0, 60, 0), (7, 0, 13))
UNANSWERED = ((0, 0, 0, 0), (0, 0, 0, 0), (0, 7, 0, 0))  # columns: `verdict.REASONS`
KNOCK = "knock: 13 of 20 understood, too short; 10 more examples or 0.2 s longer"
PRESS = "press: 60 of 60 understood"


def lines(answered: verdict.Table, unanswered: verdict.Table = ()) -> list[str]:
    return [str(one) for one in judge(LABELS, answered, unanswered)]


def test_each_gesture_gets_a_line_the_worst_first() -> None:
    assert lines(ANSWERED, UNANSWERED) == [KNOCK, PRESS]
    assert judge(LABELS, ANSWERED, UNANSWERED)[0] == GestureVerdict(
        "knock", 13, 20, "too short", "10 more examples or 0.2 s longer"
    )


@pytest.mark.parametrize(
    ("answered", "unanswered", "said"),
    [
        ((0, 7, 13), (0, 0, 0, 0), "taken for press; 10 more examples or a movement "
         "less like press"),
        ((7, 0, 13), (7, 0, 0, 0), "too light; 10 more examples or a firmer touch"),
        ((7, 0, 13), (0, 0, 7, 0), "undecided; 10 more examples or a movement less "
         "like the others"),
        ((7, 0, 13), (0, 0, 0, 7), "unclear; 10 more examples or a more distinct movement"),
        # The most frequent cause comes first, and its remedy is advised.
        ((6, 1, 13), (1, 5, 0, 0), "5 too short, 1 taken for press, 1 too light; 10 more examples "
         "or 0.2 s longer"),
    ],
)  # fmt: skip
def test_the_line_tells_why_events_were_missed_and_what_helps(
    answered: tuple[int, ...], unanswered: tuple[int, ...], said: str
) -> None:
    nothing = (0, 0, 0, 0)
    made = lines(((0, 0, 0), (0, 0, 0), answered), (nothing, nothing, unanswered))
    assert made == [f"knock: 13 of 20 understood, {said}"]  # press was not made at all


def test_a_reason_that_is_not_known_is_not_made_up() -> None:
    assert lines(ANSWERED)[0].startswith("knock: 13 of 20 understood, not answered; 10 more")


def test_a_single_miss_may_be_chance_and_needs_no_advice() -> None:
    made = judge(LABELS, ((0, 0, 0), (1, 59, 0), (0, 0, 20)), ((0,) * 4, (0, 0, 0, 1), (0,) * 4))
    assert [str(one) for one in made] == [
        "press: 59 of 60 understood, unclear", "knock: 20 of 20 understood",
    ]  # fmt: skip
    assert not any(one.advice for one in made)


def first_tile(html: str) -> str:
    return text(html.partition('<div class="cards">')[2].partition("</div>")[0] + "</div>")


def judged(answered: verdict.Table = ANSWERED) -> Evaluation:
    """Return an evaluation on a spared session."""
    found = evaluation("spared")
    result = replace(found.results[0], labels=LABELS, verdict=judge(LABELS, answered, UNANSWERED))
    return replace(found, results=(result,))


def test_a_report_begins_with_what_was_understood_and_its_worst_gesture() -> None:
    html = page.html(judged())
    assert first_tile(html) == (
        "91.2 % of gestures understood 73 of 80 in spared; worst: knock, 13 of 20"
    )
    assert f"What is understood: spared {KNOCK} {PRESS}" in text(html)


def test_nothing_but_all_is_a_hundred_per_cent() -> None:
    all_of_them = ((0, 0, 0), (0, 60, 0), (0, 0, 20))
    html = page.html(judged(all_of_them))
    assert first_tile(html) == "100 % of gestures understood 80 of 80 in spared"
    one_missed = ((0, 0, 0), (1, 99_999, 0), (0, 0, 20))
    assert first_tile(page.html(judged(one_missed))).startswith("99.99 % of gestures understood")


def test_a_training_is_headed_by_what_its_bundle_understands_in_the_hold_out() -> None:
    made = training()
    assert made.gesture is not None
    assert made.gesture.event_accuracy > 0.98  # all are named rightly, or nearly
    gesture = replace(made.gesture, verdict=judge(LABELS, ANSWERED, UNANSWERED))
    html = page.html(replace(made, labels=LABELS, gesture=gesture))
    assert first_tile(html).startswith("91.2 % of gestures understood 73 of 80 in sessions it")
    assert f"What is understood: in sessions it never saw {KNOCK} {PRESS}" in text(html)


def test_card_and_json_have_the_same_verdict() -> None:
    found = judged()
    assert f"## spared\n\n- {KNOCK}\n- {PRESS}\n" in cards.evaluation(found)
    assert json.loads(storage.json_text(found))["results"][0]["verdict"][0] == {
        "label": "knock",
        "understood": 13,
        "of": 20,
        "why": {"text": "too short", "code": "too_short", "arguments": []},
        "advice": {
            "text": "10 more examples or 0.2 s longer",
            "code": "more_or",
            "arguments": ["10", {"text": "0.2 s longer", "code": "longer", "arguments": []}],
        },
    }
