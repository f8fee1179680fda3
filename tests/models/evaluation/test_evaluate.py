"""Figures of streams: drawn ones whose every count is known, and simulated ones."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import bundle
from controller.shared.event_metric import Answer, Event, judge
from models.__main__ import main
from models.data.ground_truth import GroundTruth
from models.evaluation.evaluate import evaluate, summarise
from models.evaluation.event_counts import Tally, tally
from models.evaluation.replay import Stream
from models.reports import cards
from models.results import storage
from models.results.evaluation import Evaluation, numbers
from tests.support.plain_results import from_plain
from tests.support.pytest_types import Capture
from tests.support.recordings import LABELS, played

SHIPPED = bundle.read(bundle.default_path(10.0))
times = st.floats(0.0, 20.0).map(lambda x: round(x, 2))
kinds = st.sampled_from(LABELS[1:])


@st.composite
def streams_of_events(draw: st.DrawFn) -> tuple[list[Event], list[Answer]]:
    edges = sorted(draw(st.lists(times, min_size=0, max_size=12, unique=True)))
    pairs = zip(edges[::2], edges[1::2], strict=False)
    events = [Event(a, b, draw(kinds)) for a, b in pairs]
    when = sorted(draw(st.lists(times, max_size=12)))
    return events, [Answer(t, draw(kinds)) for t in when]


def drawn(
    events: list[Event], answers: list[Answer], seconds: float = 20.0, name: str = "it"
) -> Stream:
    """A stream at 10 Hz whose probabilities are always right; all presses are at (1, 2.5)."""
    t = np.arange(1, round(seconds * 10) + 1) / 10.0
    label = np.zeros(len(t), dtype=np.int64)
    place = np.full((len(t), 2), np.nan, dtype=np.float32)
    for event in events:
        inside = (t >= event.onset_s) & (t < event.release_s)
        label[inside] = LABELS.index(event.kind)
        if event.kind == "press":
            place[inside] = (1.0, 2.5)
    probabilities = np.eye(5, dtype=np.float32)[label]
    nobody = np.zeros(len(t), dtype=np.bool_)
    contact = tuple(event.onset_s - 0.1 for event in events)
    known = GroundTruth(name, "somebody", t, label, tuple(events), contact, place, nobody)
    still, far = np.zeros(len(t)), np.full(len(t), np.nan)
    places = place.astype(np.float64)
    return Stream(known, ~nobody, probabilities, still, still, places, far, tuple(answers))


@settings(deadline=None)
@given(streams_of_events())
def test_answers_match_events_as_the_metric_says(both: tuple[list[Event], list[Answer]]) -> None:
    events, answers = both
    score, counted = judge(events, answers), tally(drawn(events, answers), LABELS)
    assert counted.events == score.intended
    assert counted.hits == score.hits
    assert counted.wrong == score.wrong
    assert counted.duplicates == score.duplicates
    assert counted.false_alarms == score.false_alarms
    assert counted.latencies_s.tolist() == score.latencies_s


@pytest.mark.parametrize(
    ("null", "press", "pinch", "length_s", "reason"),
    [
        (0.6, 0.4, 0.0, 0.5, "too light"),
        (0.0, 0.6, 0.4, 0.5, "undecided"),
        (0.0, 0.9, 0.1, 0.2, "too short"),
        (0.0, 0.9, 0.1, 0.5, "unclear"),
    ],
)
def test_a_press_without_an_answer_has_a_reason(
    null: float, press: float, pinch: float, length_s: float, reason: str
) -> None:
    stream = drawn([Event(2.0, 2.0 + length_s, "press")], [])
    stream.probabilities[stream.truth.label == LABELS.index("press"), :3] = null, press, pinch
    found = summarise("drawn", LABELS, [tally(stream, LABELS)])
    assert [str(one) for one in found.verdict] == [f"press: 0 of 1 understood, {reason}"]


def test_every_event_and_every_false_alarm_stands_once_in_the_confusion() -> None:
    events = [Event(k, k + 0.5, kind) for k, kind in ((2, "press"), (5, "press"), (8, "pinch"))]
    answers = [
        Answer(1.0, "pinch"),  # to nothing
        Answer(2.2, "press"), Answer(2.6, "press"),  # a hit, and again
        Answer(5.1, "twist_cw"),  # wrong
    ]  # fmt: skip
    found = summarise("drawn", LABELS, [tally(drawn(events, answers), LABELS)])
    assert found.answered[0] == (0, 0, 1, 0, 0)
    assert found.answered[1] == (0, 1, 0, 1, 0)
    assert found.answered[2] == (1, 0, 0, 0, 0)
    assert found.recall.value == pytest.approx(1 / 3)
    assert found.precision.value == pytest.approx(1 / 4)
    assert found.f1.value == pytest.approx(2 / 7)
    assert found.missed.value == found.wrong.value == found.duplicates.value
    press = found.classes[0]
    assert (press.label, press.events) == ("press", 2)
    assert (press.recall.value, press.precision.value) == (0.5, 0.5)
    assert found.latency_s.value == pytest.approx(0.2)
    assert found.contact_latency_s.value == pytest.approx(0.3)


def test_idle_time_is_what_no_gesture_could_be_answered_in() -> None:
    events = [Event(2.0, 3.0, "press")]  # from 2.0 to 3.5: 16 frames
    counted = tally(drawn(events, []), LABELS)
    assert counted.minutes == pytest.approx(20 / 60)
    assert counted.idle_minutes == pytest.approx((20 - 1.6) / 60)


def test_what_is_excluded_neither_idles_nor_raises_alarms() -> None:
    stream = drawn([], [Answer(1.0, "press"), Answer(10.0, "press")])
    paused = stream.truth.t > 5.0
    counted = tally(replace(stream, truth=replace(stream.truth, excluded=paused)), LABELS)
    assert counted.false_alarms == 1
    assert counted.idle_minutes == pytest.approx(5 / 60)
    assert counted.frames == (50, 50)


def test_places_are_judged_once_a_press_on_the_sites_and_off_them() -> None:
    events = [Event(2.0, 3.0, "press"), Event(5.0, 6.0, "press")]
    stream = drawn(events, [])
    stream.touches[19:24] += 5.0  # an early estimate does not count
    stream.touches[29:30] = np.nan
    stream.touches[49:60] += (0.1, -0.3)
    counted = tally(stream, LABELS)
    np.testing.assert_allclose(counted.places, [[1, 2.5, 0, 0], [1, 2.5, 0.1, -0.3]], atol=1e-6)
    found = summarise("drawn", LABELS, [counted]).location
    assert found is not None
    assert found.error.value == pytest.approx(0.1)
    assert found.off_site.value == pytest.approx(0.1)  # y = 2.5 is between two taxels
    assert np.isnan(found.on_site.value)


def test_a_stream_that_is_always_right_and_sure_is_perfect() -> None:
    events = [Event(2.0 * k, 2.0 * k + 1.0, LABELS[1 + k % 4]) for k in range(1, 9)]
    answers = [Answer(event.onset_s + 0.3, event.kind) for event in events]
    sessions = [tally(drawn(events, answers, name=str(k)), LABELS) for k in range(3)]
    found = summarise("drawn", LABELS, sessions)
    for figure in (found.f1, found.event_accuracy, found.frame_accuracy):
        assert figure.value == 1.0
    assert found.calibration.error < 1e-9
    assert found.false_alarms_per_min.value == 0.0
    assert found.false_alarms_per_min.high > 0.0  # silence promises nothing for ever
    assert found.recall.low == pytest.approx(1.0 - 3.0 / 24)
    assert (found.sessions, found.users, len(found.by_session)) == (3, 1, 3)


def test_a_recording_that_cannot_be_judged_is_named_and_the_others_are_judged() -> None:
    good, left_out = played("nominal"), list[str]()
    foreign = replace(good, origin=replace(good.origin, unit="counts"))
    sessions = [("counts", foreign), ("good", good)]
    found = evaluate(SHIPPED, sessions, lambda line: None, left_out=left_out)
    assert [tally.name for tally in found] == ["good"]
    assert left_out[0].startswith("counts is left out: the recording is in counts")
    with pytest.raises(ValueError, match="there is nothing to judge; counts is left out"):
        evaluate(SHIPPED, sessions[:1], lambda line: None, left_out=left_out)


@pytest.fixture(scope="module")
def shipped() -> list[Tally]:
    sessions = ((str(seed), played("nominal", seed=seed)) for seed in range(2))
    return evaluate(SHIPPED, sessions, lambda line: None)


def test_the_shipped_bundle_recognises_people_it_never_met(shipped: list[Tally]) -> None:
    found = summarise("nominal", SHIPPED.labels, shipped)
    assert found.events > 50
    assert found.event_accuracy.value > 0.95
    assert found.f1.value > 0.95
    assert 0.1 < found.latency_s.value < found.contact_latency_s.value < 0.6
    assert found.location is not None
    assert found.location.error.value < 0.25


def test_a_result_becomes_a_card_and_json_where_the_unknown_is_null(shipped: list[Tally]) -> None:
    result = summarise("nominal", SHIPPED.labels, shipped[:1])
    debounce = numbers(SHIPPED.debounce)
    found = Evaluation("x.orb", SHIPPED.hash, {}, "models", SHIPPED.labels, debounce, (result,))
    text = cards.evaluation(found)
    assert "| **nothing** |" in text
    assert "false alarms per idle minute" in text
    assert "nan" not in text
    told = json.loads(storage.json_text(found))
    assert told["results"][0]["f1"]["value"] == pytest.approx(result.f1.value, abs=1e-6)
    assert told["results"][0]["location"]["error"]["low"] is None  # of one session
    assert len(told["results"][0]["answered"]) == len(SHIPPED.labels)
    again = from_plain(Evaluation, told)
    assert again.debounce == pytest.approx(debounce)
    assert again.results[0].verdict == result.verdict


def test_without_recordings_new_people_are_simulated(capsys: Capture) -> None:
    assert main(["evaluate", "--sessions", "2", "--minutes", "0.5"]) == 0
    card = capsys.readouterr().out
    assert "| figure | nominal | paper-snr |" in card
    assert "| sessions, users | 2, 2 | 2, 2 |" in card
