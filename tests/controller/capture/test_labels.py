"""Labels of each frame: button, keys and cues side by side, and the line for people."""

import io

import pytest

from controller.capture.cues import Cue, Phase
from controller.capture.key_labels import LabelCorrection
from controller.capture.labels import FrameLabels, Labeller
from controller.capture.status_line import StatusLine, describe
from controller.keymap.terminal import Timed
from controller.keymap.terminal_decoder import BACKSPACE, SPACE, Action, KeyEvent, Signal
from controller.recordings.recording import UNKNOWN, Mark
from tests.controller.capture.test_cues import cues as cued

LABELS = ("null", "press", "pinch")


def down(key: str, ago_s: float = 0.0) -> Timed:
    return ago_s, KeyEvent(key, Action.PRESSED)


def up(key: str, ago_s: float = 0.0) -> Timed:
    return ago_s, KeyEvent(key, Action.RELEASED)


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


def test_keys_have_a_column_of_their_own_and_excuse_frames() -> None:
    labeller = Labeller(LABELS)
    said = [
        labeller.label(1.0, button="null"),
        labeller.label(1.1, button="null", events=[down("1")]),
        labeller.label(1.2, button="pinch", events=[down(SPACE)]),
        labeller.label(1.3, button="pinch", events=[up("1"), up(SPACE)]),
    ]
    assert [(one.key, one.button, one.excluded) for one in said] == [
        (UNKNOWN, 0, False), (1, 0, False), (1, 2, True), (0, 2, True),
    ]  # fmt: skip
    assert said[2].marks == (Mark(1.2, "key", "pause"),)


def test_keys_that_changed_before_the_last_frame_correct_it() -> None:
    labeller = Labeller(LABELS)
    labeller.label(1.0, events=[down("1")])
    assert labeller.label(1.1, events=[up("1", ago_s=0.05)]).amends == ()  # since the last frame
    labeller.label(1.2, events=[down("1")])
    labeller.label(1.3)
    (amend,) = labeller.label(1.4, events=[up("1", ago_s=0.125)]).amends
    assert amend == LabelCorrection("key", 1.4 - 0.125, 1.4, 0)


def test_a_key_is_let_go_of_when_the_window_is_left() -> None:
    labeller = Labeller(LABELS)
    labeller.label(1.0, events=[down("1")])
    assert labeller.label(1.1, events=[(0.0, Signal.AWAY)]).key == 0


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
    assert late.amends == (LabelCorrection("excluded", 1.0, 3.0, True),)
    assert Mark(3.0, "cue", "again pinch: nothing was felt") in late.marks


def test_backspace_has_the_example_asked_for_again() -> None:
    labeller = Labeller(LABELS, cues=cued("pinch"))
    for k in range(35):
        labeller.label(k / 10, felt=True)
    said = labeller.label(3.5, events=[down(BACKSPACE)])
    assert said.asked is not None
    assert said.asked.more == {"pinch": 1}
    assert said.amends == (
        LabelCorrection("excluded", 0.5, 3.5, True),
        LabelCorrection("excluded", 1.0, 3.0, True),
    )


def test_a_pause_stops_the_cues_and_is_told() -> None:
    labeller = Labeller(LABELS, cues=cued("pinch"))
    labeller.label(0.0)
    said = [labeller.label(0.1, events=[down(SPACE)]), labeller.label(60.0)]
    assert [(one.fresh, one.cue, one.excluded) for one in said] == [
        (True, UNKNOWN, True),
        (False, UNKNOWN, True),
    ]
    on = labeller.label(60.1, events=[up(SPACE), down(SPACE)])
    assert (on.fresh, on.cue, on.excluded) == (True, 0, False)


class Screen(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_without_cues_the_line_says_what_the_keys_do() -> None:
    line = describe(FrameLabels(), 83.4, LABELS, keyboard=True)
    assert line == "1:23  hold 1 press, 2 pinch; space pauses, backspace drops"
    assert describe(FrameLabels(key=2, excluded=True), 3.0, LABELS, keyboard=True) == (
        "0:03  PAUSED, space goes on  key: pinch"
    )


def test_with_cues_the_line_shows_what_to_do_and_the_rest() -> None:
    cue = Cue(Phase.GO, "press", None, 1.4, {"press": 3, "pinch": 0})
    line = describe(FrameLabels(asked=cue), 3.0, LABELS, keyboard=True)
    assert line == "0:03  go: PRESS 2 s  3 left (press 3), enough pinch"
    waiting = describe(FrameLabels(asked=Cue(Phase.WAIT)), 0.5, LABELS, keyboard=True)
    assert waiting == "0:00  hands off: the sensor finds its rest"


def test_the_line_is_written_over_and_fits_the_screen() -> None:
    screen = Screen()
    status = StatusLine(screen, LABELS, keyboard=True)
    for text in ("a long line", "short", "short", "x" * 200):
        status.write(text)
    status.clear()
    lines = screen.getvalue().replace("\r\r", "\n").strip("\r").split("\n")
    assert lines == ["a long line", "short      ", "x" * 79, " " * 79]
    file = io.StringIO()  # no screen
    StatusLine(file, LABELS, keyboard=True).write("go")
    assert file.getvalue() == ""
