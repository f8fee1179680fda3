"""Cue-guided sessions: plans, and what is asked when."""

from collections import Counter

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from controller.shared.cues import (
    Cue,
    CueSession,
    CueTiming,
    DiscardedExample,
    ExampleRequest,
    Phase,
)

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")
PACE = CueTiming(get_ready_s=1.0, go_s=2.0, rest_s=1.0, jitter_s=0.0)  # four seconds an example


def cues(*labels: str, pace: CueTiming = PACE) -> CueSession:
    """Return cues for these examples, in this order."""
    asks = [ExampleRequest(label) for label in labels]
    return CueSession(asks, pace, np.random.default_rng(1))


def play(
    session: CueSession, from_s: float, to_s: float, *, felt: bool = True
) -> list[DiscardedExample]:
    """Let ten frames a second pass; return what turned out void."""
    voids = []
    for k in range(round(from_s * 10), round(to_s * 10) + 1):
        voids += session.advance(k / 10, felt=felt)
    return voids


# --- what is asked --------------------------------------------------------------------------------


def test_an_example_is_get_ready_go_and_rest() -> None:
    session = cues("press", "pinch")
    seen: list[tuple[float, str, str]] = []
    for k in range(90):
        session.advance(k / 10, felt=True)
        cue = session.at(k / 10)
        if not seen or seen[-1][1:] != (cue.phase.value, cue.label):
            seen.append((k / 10, cue.phase.value, cue.label))
    assert seen == [
        (0.0, "get ready", "press"), (1.0, "go", "press"), (3.0, "rest", "press"),
        (4.0, "get ready", "pinch"), (5.0, "go", "pinch"), (7.0, "rest", "pinch"),
        (8.0, "done", ""),
    ]  # fmt: skip
    assert session.done


def test_before_the_first_example_the_sensor_finds_its_rest() -> None:
    session = cues("press")
    assert session.at(5.0).phase is Phase.WAIT
    session.advance(7.0, felt=False)  # time begins with the first step, whenever that is
    assert session.at(7.0) == Cue(Phase.GET_READY, "press", None, 1.0, {"press": 1})


def test_a_cue_has_its_length_and_the_examples_left() -> None:
    session = cues("press", "pinch", "press")
    play(session, 0.0, 1.5)
    cue = session.at(1.5)
    assert (cue.phase, cue.left_s, cue.left) == (Phase.GO, 1.5, 3)
    assert cue.more == {"press": 2, "pinch": 1}
    play(session, 1.6, 8.0)
    cue = session.at(8.0)
    assert (cue.phase, cue.label, cue.left_s) == (Phase.GET_READY, "press", 1.0)
    assert cue.more == {"press": 1, "pinch": 0}


def test_a_place_is_asked_for_where_the_protocol_wants_one() -> None:
    session = CueSession([ExampleRequest("press", (1.0, 3.0))], PACE, np.random.default_rng(1))
    session.advance(0.0, felt=False)
    assert session.at(0.0).place == (1.0, 3.0)


def test_rests_vary_within_a_run_and_repeat_from_run_to_run() -> None:
    pace, asks = CueTiming(0.0, 1.0, 1.0, 1.0), [ExampleRequest("press")] * 20

    def ends() -> list[float]:
        session, times = CueSession(asks, pace, np.random.default_rng(1)), []
        left = 20
        for k in range(1000):
            session.advance(k / 10, felt=True)
            if session.at(k / 10).left != left:
                left = session.at(k / 10).left
                times.append(k / 10)
        return times

    gaps = np.diff(ends())
    assert 2.0 <= gaps.min() < 2.3
    assert 2.7 < gaps.max() <= 3.1
    assert ends() == ends()


QUICK = CueTiming(0.5, 2.0, 0.5, 0.0, still_s=0.4)


def quick(*labels: str) -> CueSession:
    return cues(*labels, pace=QUICK)


def phases(session: CueSession, touched: set[int], frames: int = 60) -> list[tuple[float, str]]:
    """Return when which phase begins, with a touch in these frames, ten a second."""
    seen: list[tuple[float, str]] = []
    for k in range(frames):
        session.advance(k / 10, felt=k in touched)
        if (phase := session.at(k / 10).phase.value) != (seen[-1][1] if seen else ""):
            seen.append((k / 10, phase))
    return seen


def test_go_ends_a_while_after_the_touch() -> None:
    assert phases(quick("press"), {8, 9, 10, 12, 13}) == [
        (0.0, "get ready"), (0.5, "go"), (1.7, "rest"), (2.2, "done"),
    ]  # fmt: skip


def test_go_lasts_while_nothing_was_felt_and_while_the_touch_lasts() -> None:
    assert phases(quick("press"), set(), 26)[-1] == (2.5, "rest")
    assert phases(quick("press"), set(range(8, 60)), 26)[-1] == (2.5, "rest")


def test_a_touch_that_lasts_does_not_end_the_next_example() -> None:
    session = quick("press", "pinch")
    seen = phases(session, {*range(6, 34), 38, 39, 40}, 60)
    # The first touch lasts beyond its go and its rest; go of the second begins at 3.5 s, still
    # touched until 3.3 s, and ends by the touch at 3.8 s.
    assert seen[-3:] == [(3.5, "go"), (4.4, "rest"), (4.9, "done")]
    lingering = phases(quick("press", "pinch"), set(range(6, 38)), 60)
    assert lingering[-2:] == [(3.5, "go"), (5.5, "rest")]


def test_the_next_example_is_said_beforehand_and_stays_the_next() -> None:
    rng = np.random.default_rng(1)
    session = CueSession(
        [ExampleRequest("press"), ExampleRequest("pinch"), ExampleRequest("twist_cw")], PACE, rng
    )
    for k in range(30):
        session.advance(k / 10, felt=False)
        assert session.at(k / 10).then == "pinch"
    assert session.advance(3.0, felt=False)  # nothing was felt, so press is asked for again
    assert session.at(3.0).then == "pinch"
    play(session, 3.1, 30.0)
    assert session.at(30.0).then == ""


# --- what does not count --------------------------------------------------------------------------


def test_an_example_in_which_nothing_was_felt_is_asked_for_again() -> None:
    session = cues("press", "pinch")
    assert play(session, 0.0, 4.0, felt=False) == [
        DiscardedExample("press", 1.0, 3.0, "nothing was felt")
    ]
    cue = session.at(4.0)
    assert (cue.label, cue.then, cue.left) == ("pinch", "press", 2)


def test_one_frame_of_noise_is_no_touch() -> None:
    session = cues("press")
    play(session, 0.0, 1.4, felt=False)
    session.advance(1.5, felt=True)
    (void,) = play(session, 1.6, 4.0, felt=False)
    assert void.why == "nothing was felt"


def test_where_no_touch_is_asked_for_none_needs_to_be_felt() -> None:
    session = cues("null")
    assert play(session, 0.0, 4.0, felt=False) == []
    assert session.done


def test_an_example_of_which_frames_are_missing_begins_anew() -> None:
    session = cues("press")
    play(session, 0.0, 2.0)
    assert session.advance(9.0, felt=True) == [
        DiscardedExample("press", 1.0, 9.0, "frames were missed")
    ]


EVENTS = st.lists(st.sampled_from(["felt", "quiet"]), max_size=300)


@given(EVENTS)
def test_every_example_is_done_or_still_asked_for(events: list[str]) -> None:
    asked = [ExampleRequest(label) for label in ("press", "pinch", "press")]
    pace = CueTiming(0.2, 0.5, 0.5, 0.0)
    session = CueSession(asked, pace, np.random.default_rng(1))
    counted: Counter[str] = Counter()
    before = session.at(0.0).left
    assert before == 3
    for k, event in enumerate(events):
        t_s = k / 10
        voids = session.advance(t_s, felt=event == "felt")
        cue = session.at(t_s)
        assert cue.left_s >= 0.0
        assert 0 <= cue.left <= 3
        assert session.done == (cue.phase is Phase.DONE)
        assert not (session.done and cue.left)
        counted.update(void.label for void in voids)
    assert set(counted) <= {"press", "pinch"}
