"""The event metric, on streams small enough to judge by eye."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.shared.event_metric import Answer, Event, Score, judge

EVENTS = [Event(1.0, 2.0, "left"), Event(4.0, 5.0, "drop"), Event(5.2, 6.0, "left")]


def counts(score: Score) -> tuple[int, int, int, int, int]:
    return score.hits, score.wrong, score.missed, score.false_alarms, score.duplicates


def test_right_answers_are_hits_with_their_latency() -> None:
    score = judge(EVENTS, [Answer(1.4, "left"), Answer(4.5, "drop"), Answer(5.5, "left")])
    assert counts(score) == (3, 0, 0, 0, 0)
    assert [round(latency, 6) for latency in score.latencies_s] == [0.4, 0.5, 0.3]
    assert score.f1 == 1.0


@pytest.mark.parametrize(
    ("events", "answers", "expected"),
    [
        # Up to half a second after the release, and no later; before any onset never.
        (EVENTS[:1], [Answer(2.5, "left")], (1, 0, 0, 0, 0)),
        (EVENTS[:1], [Answer(2.51, "left")], (0, 0, 1, 1, 0)),
        (EVENTS[:1], [Answer(0.99, "left")], (0, 0, 1, 1, 0)),
        # Another class is wrong, and the event stays missed until it is answered rightly.
        (EVENTS[:1], [Answer(1.5, "right")], (0, 1, 1, 0, 0)),
        (EVENTS[:1], [Answer(1.2, "right"), Answer(1.6, "left")], (1, 1, 0, 0, 0)),
        (EVENTS[:1], [Answer(1.2, "left"), Answer(1.9, "left")], (1, 0, 0, 0, 1)),
        # From its onset on an answer belongs to the next event.
        (EVENTS[1:], [Answer(5.3, "drop")], (0, 1, 2, 0, 0)),
        (EVENTS[1:], [Answer(5.2, "left")], (1, 0, 1, 0, 0)),
    ],
)
def test_each_answer_belongs_to_one_event_or_to_none(
    events: list[Event], answers: list[Answer], expected: tuple[int, ...]
) -> None:
    assert counts(judge(events, answers)) == expected


def test_precision_and_recall_are_shares_of_answers_and_of_events() -> None:
    score = Score(intended=8, hits=6, wrong=1, missed=2, false_alarms=2, duplicates=3)
    assert (score.precision, score.recall) == (0.5, 0.75)
    assert score.f1 == 0.6
    assert (Score().precision, Score().recall) == (1.0, 1.0)


def test_streams_are_pooled_count_by_count() -> None:
    pooled = Score(8, 6, 1, 2, 2, 3, [0.5])
    pooled.add(Score(10, 20, 30, 40, 50, 60, [0.25]))
    assert pooled == Score(18, 26, 31, 42, 52, 63, [0.5, 0.25])


@given(st.lists(st.tuples(st.floats(0, 10), st.sampled_from(["left", "drop"])), max_size=12))
def test_answers_count_once_and_events_are_hit_or_missed(answers: list[tuple[float, str]]) -> None:
    score = judge(EVENTS, [Answer(t, kind) for t, kind in sorted(answers)])
    assert score.hits + score.wrong + score.false_alarms + score.duplicates == len(answers)
    assert score.hits + score.missed == score.intended == len(EVENTS)
