"""Labels of each frame: button and cues side by side, and the lines that say what to do."""

import pytest

from controller.capture.labels import FrameLabels, Labeller
from controller.capture.session_recorder import cue_lines
from controller.recordings.recording import UNKNOWN, Mark
from controller.shared.cues import Cue, Phase
from tests.controller.capture.test_cues import cues as cued

LABELS = ("null", "press", "pinch")


@pytest.mark.parametrize(
    ("says", "label"),
    [(None, UNKNOWN), ("null", 0), ("pinch", 2), ("", UNKNOWN), ("poke", UNKNOWN)],
)
def test_a_button_says_what_it_knows(says: str | None, label: int) -> None:
    assert Labeller(LABELS).label(0.1, button=says).button == label


def test_a_button_that_says_only_down_means_what_the_user_said() -> None:
    labeller = Labeller(LABELS, button_label="pinch")
    assert [labeller.label(k, button=says).button for k, says in enumerate(["null", ""])] == [0, 2]


def test_a_button_without_a_label_means_the_cue_until_released() -> None:
    labeller = Labeller(LABELS, button_label="pinch", cues=cued("press", "pinch"))
    said = []
    for k in range(60):
        says = "" if 15 <= k < 45 else "null"  # from the first go into the second get ready
        said.append(labeller.label(k / 10, button=says, felt=True).button)
    assert said == [0] * 15 + [1] * 30 + [0] * 15


def test_the_cue_has_its_label_at_go_only() -> None:
    labeller = Labeller(LABELS, cues=cued("pinch"))
    said = [labeller.label(k / 10, felt=True, ready=k >= 10) for k in range(52)]
    assert [one.cue for one in said] == [UNKNOWN] * 10 + [0] * 10 + [2] * 20 + [0] * 10 + [-1] * 2
    fresh = [(one.asked.phase, one.marks) for one in said if one.fresh and one.asked]
    assert fresh == [
        (Phase.WAIT, (Mark(0.0, "cue", "wait"),)),
        (Phase.GET_READY, (Mark(1.0, "cue", "get ready pinch"),)),
        (Phase.GO, (Mark(2.0, "cue", "go pinch"),)),
        (Phase.REST, (Mark(4.0, "cue", "rest pinch"),)),
        (Phase.DONE, (Mark(5.0, "cue", "done"),)),
    ]
    assert labeller.done


def test_nobody_learns_from_an_example_that_does_not_count() -> None:
    labeller = Labeller(LABELS, cues=cued("pinch"))
    said = [labeller.label(k / 10, felt=False) for k in range(35)]
    (late,) = [one for one in said if one.voids]
    assert [(void.from_s, void.to_s) for void in late.voids] == [(1.0, 3.0)]
    assert Mark(3.0, "cue", "again pinch: nothing was felt") in late.marks


@pytest.mark.parametrize(
    ("cue", "words"),
    [
        (Cue(Phase.WAIT), "hands off: the sensor finds its rest"),
        (Cue(Phase.GET_READY, "press", (1.0, 1.5), 0.7, {"press": 2}),
         "get ready: press at 1,1.5  (2 left)"),
        (Cue(Phase.GO, "press", None, 1.4), "GO: press 2 s"),
        (Cue(Phase.GO, "press", None, 1.4, then="pinch"), "GO: press 2 s; then: pinch"),
        (Cue(Phase.REST, "press"), "rest"),
        (Cue(Phase.DONE), "done"),
    ],
)  # fmt: skip
def test_whatever_is_asked_is_said_in_words(cue: Cue, words: str) -> None:
    assert [*cue_lines(FrameLabels(asked=cue, fresh=True), 61.0, {})] == [f"1:01  {words}"]


def test_each_change_of_the_cues_is_a_line() -> None:
    labeller, words = Labeller(LABELS, cues=cued("pinch")), {"pinch": "squeeze it"}
    said = [line for k in range(35) for line in cue_lines(labeller.label(k / 10), k / 10, words)]
    assert said == [
        "0:00  get ready: squeeze it  (1 left)",
        "0:01  GO: squeeze it 2 s",
        "pinch again: nothing was felt",
        "0:03  rest",
    ]
