"""The plan of a session to train from, and its phases in time."""

from collections import Counter
from random import Random

from host.app.cues import NULL, UNTOUCHED, Cue, CueRun, plan
from host.ui.pointer_input import DomeArea

PAD = DomeArea()
STEP_S = 0.1


def run_of(count: int) -> CueRun:
    return CueRun([Cue("pinch", PAD.centre)] * count, Random(1))


def through(run: CueRun, *, touched: bool) -> list[str]:
    """Let one example pass; return its labels, step by step."""
    made, missed, labels = run.made, len(run._cues), []
    while True:
        labels.append(run.label)
        before = run.phase
        run.advance(STEP_S, touched=touched and before == "go")
        if before == "rest" and run.phase in ("ready", "over"):
            assert run.made == made + touched
            assert len(run._cues) == missed or touched
            return labels


def test_each_gesture_is_asked_for_as_often_in_an_order_that_the_seed_decides() -> None:
    labels = ["press", "pinch", NULL]
    cues = plan(labels, ["press"], 10, PAD, Random(1))
    assert Counter(cue.label for cue in cues) == dict.fromkeys(labels, 10)
    assert cues == plan(labels, ["press"], 10, PAD, Random(1))
    assert cues != plan(labels, ["press"], 10, PAD, Random(2))


def test_presses_lie_all_over_the_dome_and_pinches_in_its_middle() -> None:
    cues = plan(["press", "pinch"], ["press"], 30, PAD, Random(1))
    presses = [cue.place for cue in cues if cue.label == "press"]
    assert {cue.place for cue in cues if cue.label == "pinch"} == {PAD.centre}
    assert all(PAD.on_dome(*place) for place in presses)
    for axis in (0, 1):
        assert min(place[axis] for place in presses) < PAD.centre[axis] - 1.0
        assert max(place[axis] for place in presses) > PAD.centre[axis] + 1.0


def test_only_the_time_to_do_it_has_the_label() -> None:
    labels = through(run_of(1), touched=True)
    first, last = labels.index("pinch"), len(labels) - labels[::-1].index("pinch")
    assert 0.9 <= first * STEP_S <= 1.1
    assert 1.1 <= (last - first) * STEP_S <= 1.3
    assert set(labels[:first] + labels[last:]) == {NULL}


def test_a_run_is_over_when_all_were_touched() -> None:
    run = run_of(2)
    through(run, touched=True)
    assert (run.made, run.count, run.phase) == (1, 2, "ready")
    through(run, touched=True)
    assert (run.made, run.count, run.phase) == (2, 2, "over")


def test_an_example_without_a_touch_is_made_again() -> None:
    run = run_of(2)
    for touched in (True, False, True):
        through(run, touched=touched)
    assert (run.made, run.count, run.phase) == (2, 2, "over")


def test_it_pauses_where_nothing_is_felt() -> None:
    run = run_of(2)
    for _ in range(UNTOUCHED):
        assert not run.paused
        through(run, touched=False)
    assert run.paused
    left_s = run.left_s
    run.advance(STEP_S, touched=True)
    assert run.left_s == left_s


def test_another_touch_may_be_left_out() -> None:
    run = CueRun([Cue(NULL, PAD.centre)] * (UNTOUCHED + 1), Random(1))
    while run.phase != "over":
        run.advance(STEP_S, touched=False)
    assert (run.made, run.paused) == (UNTOUCHED + 1, False)
