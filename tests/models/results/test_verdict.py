"""The verdict of an evaluation: the same words on a card, on a terminal and in JSON."""

import json
from dataclasses import replace

import pytest

from models.reports import cards
from models.results import storage, verdict
from models.results.evaluation import Evaluation
from models.results.verdict import GestureVerdict, judge
from tests.support.report_results import evaluation

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


def judged(answered: verdict.Table = ANSWERED) -> Evaluation:
    """Return an evaluation on a spared session."""
    found = evaluation("spared")
    result = replace(found.results[0], labels=LABELS, verdict=judge(LABELS, answered, UNANSWERED))
    return replace(found, results=(result,))


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
