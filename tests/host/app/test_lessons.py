"""The host's side of teaching: what the orb said, what is to be sent, and how a trial went."""

from controller.shared.protocol.messages import Command, Request, Telemetry
from controller.shared.protocol.teaching import (
    DONE,
    LEARNING,
    Describe,
    ExampleDrop,
    ExampleEnd,
    ExampleStart,
    ExampleTaken,
    Forget,
    Learn,
    LearnStatus,
    LessonCost,
    Undo,
    Vocabulary,
)
from host.app.lessons import Lessons, Trial

BEFORE = Vocabulary(("null", "press"), ("left",), "", False, 0, "/data")
AFTER = Vocabulary(("null", "press", "swipe"), ("left", "hold"), "mine", True, 1, "/data")


def taken(number: int, label: str = "swipe", *, felt: bool = True) -> ExampleTaken:
    return ExampleTaken(number, label, felt, "" if felt else "nothing touched the orb", 0.4, b"")


def taught(first: int = 1) -> tuple[list[Request], Lessons]:
    sent: list[Request] = []
    return sent, Lessons(sent.append, first)


def flushed(sent: list[Request]) -> list[Request]:
    found = sent[:]
    sent.clear()
    return found


def held(label: str) -> Telemetry:
    return Telemetry(1, b"", (), None, label, True, 40.0)


def test_a_gesture_is_taught_and_forgotten() -> None:
    sent, lessons = taught(first=7)
    lessons.connected()
    assert flushed(sent) == [Describe()]
    lessons.take(BEFORE)
    assert lessons.begin_example("swipe") == 7
    lessons.end_example()
    assert flushed(sent) == [ExampleStart(7, "swipe"), ExampleEnd(7, True)]
    lessons.take(taken(7))
    assert [one.number for one in lessons.of("swipe")] == [7]
    lessons.change(Learn("swipe", "hold", "none", False, ""))
    assert flushed(sent) == [Learn("swipe", "hold", "none", False, "")]
    assert lessons.busy
    lessons.take(AFTER)
    lessons.take(LearnStatus(DONE, 1.0, "learned", (1.0, 0.9, 1.0)))
    assert not lessons.busy
    cost = LessonCost("swipe", "press", 20, 20, 0.15, 20, 0.4, 20, 0.15)
    lessons.take(cost)
    assert lessons.costs == {"press": cost}
    lessons.change(Forget("swipe"))
    lessons.take(BEFORE)
    assert flushed(sent) == [Forget("swipe")]
    assert lessons.of("swipe") == []


def test_examples_that_wait_on_the_orb_come_again_and_numbers_go_on_after_them() -> None:
    _, lessons = taught()
    lessons.take(taken(30))
    lessons.take(taken(31, felt=False))
    assert [one.number for one in lessons.of("swipe")] == [30]
    assert lessons.begin_example("swipe") == 32


def test_an_example_is_thrown_away_before_its_end_or_after() -> None:
    sent, lessons = taught()
    lessons.begin_example("swipe")
    lessons.begin_example("swipe")  # the first one was a mistake
    assert flushed(sent) == [
        ExampleStart(1, "swipe"), ExampleEnd(1, False), ExampleStart(2, "swipe")
    ]  # fmt: skip
    lessons.end_example()
    lessons.take(taken(2))
    lessons.drop(2)
    assert flushed(sent) == [ExampleEnd(2, True), ExampleDrop(2)]
    assert lessons.of("swipe") == []


def test_an_example_that_the_orb_ended_is_not_open_any_more() -> None:
    sent, lessons = taught()
    number = lessons.begin_example("swipe")
    lessons.take(taken(number, felt=False))
    assert lessons.open is None
    sent.clear()
    lessons.end_example()
    assert sent == []


def test_progress_is_not_an_outcome() -> None:
    _, lessons = taught()
    lessons.change(Undo())
    lessons.take(LearnStatus(LEARNING, 0.5, "learning"))
    assert lessons.busy
    assert lessons.costs == {}


def test_a_trial_has_what_was_meant_beside_what_was_understood() -> None:
    trial = Trial("swipe")
    for second, label in enumerate(("swipe", "press", "", "swipe")):
        trial.touch(True, second)
        trial.take(held(label), second + 0.1)
        trial.take(held(""), second + 0.2)
        trial.touch(False, second + 0.2)
        trial.advance(second + 0.9)
        assert len(trial.heard) == second
    trial.advance(9.0)
    assert trial.heard == [("swipe", label) for label in ("swipe", "press", "", "swipe")]
    assert trial.count("swipe") == (2, 4)


def test_a_touch_that_was_not_felt_is_no_attempt() -> None:
    trial = Trial("swipe")
    for felt in (False, True):
        trial.touch(True, 1.0)
        trial.touch(False, 1.5, felt=felt)
        trial.advance(9.0)
    assert trial.heard == [("swipe", "")]


def test_an_answer_may_come_after_the_touch() -> None:
    trial = Trial("double_tap")
    trial.touch(True, 0.25)
    trial.touch(False, 0.35)
    trial.take(Command("hold", "double_tap", 0.9, None, 1), 0.6)
    trial.advance(2.0)
    assert trial.heard == [("double_tap", "double_tap")]
    trial.take(held("press"), 3.0)  # nothing was touched
    trial.advance(9.0)
    assert trial.heard == [("double_tap", "double_tap")]
