"""Keys while recording: from a terminal's bytes to what they say of each frame."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.capture.key_labels import (
    FIRST_REPEAT_S,
    HeldKeys,
    KeyChange,
    KeyLabels,
    LabelCorrection,
)
from controller.keymap.terminal_decoder import BACKSPACE, SPACE, Action, KeyEvent
from controller.recordings.recording import UNKNOWN, Mark
from tests.controller.keymap.test_terminal_decoder import pressed, released, typed

LABELS = 5  # null and four gestures


Feed = list[tuple[str, float]]  # "1" is typed, "+1" pressed, "-1" released, "" time that passes


def fed(feed: Feed) -> list[KeyChange]:
    """Return the changes that a keyboard's events make."""
    holds, changes = HeldKeys(), []
    for what, t_s in feed:
        stroke = {"+": pressed, "-": released}.get(what[:1], typed)(what.lstrip("+-"))
        changes += holds.take(stroke, t_s) if what else holds.pass_time(t_s)
    return changes


def repeats(key: str, first_s: float, until_s: float, delay_s: float = 0.5) -> Feed:
    """Return what a keyboard sends of a key that is held: a character, and repeats of it."""
    count = int((until_s - first_s - delay_s) / 0.03)
    return [(key, first_s), *((key, first_s + delay_s + i * 0.03) for i in range(count + 1))]


def down(t_s: float, key: str = "1") -> KeyChange:
    return KeyChange(key, True, t_s)


def up(t_s: float, tapped: bool = False) -> KeyChange:
    return KeyChange("1", False, t_s, tapped)


HELD: Feed = repeats("1", 2.0, 4.0)
LAST_S = HELD[-1][1]
STUTTER = (2.0, 2.5, 2.53, 2.56, 2.76, 2.77, 2.78, 3.1, 3.13, 3.4)


@pytest.mark.parametrize(
    ("feed", "changes"),
    [
        ([("+1", 2.0), ("", 60.0), ("-1", 61.0), ("-1", 62.0)], [down(2.0), up(61.0)]),
        # Characters mean that a key is down, and their end that it is up.
        ([*HELD, ("", LAST_S + 0.2)], [down(2.0)]),  # perhaps the next one is late
        ([*HELD, ("", LAST_S + 0.3)], [down(2.0), up(LAST_S)]),
        ([("1", t_s) for t_s in STUTTER], [down(2.0)]),  # over a network
        ([*HELD, ("2", 4.1)], [down(2.0), up(LAST_S), down(4.1, "2")]),
        # A key that was typed once has no length.
        ([("1", 2.0), ("", 2.0 + FIRST_REPEAT_S)], [down(2.0)]),
        ([("1", 2.0), ("", 2.1 + FIRST_REPEAT_S)], [down(2.0), up(2.0, True)]),
        ([("1", 2.0), ("1", 2.15)], [down(2.0), up(2.0, True), down(2.15)]),
    ],
)
def test_keyboard_events_are_keys_that_go_down_and_up(feed: Feed, changes: list[KeyChange]) -> None:
    assert fed(feed) == changes


def test_the_wait_for_the_first_repeat_is_learned() -> None:
    early = repeats("1", 2.0, 3.0, delay_s=0.25)
    assert fed([*early, ("", 5.0), ("1", 6.0), ("", 6.4)])[-1] == up(6.0, True)


def test_keys_are_let_go_of_when_nobody_looks() -> None:
    holds = HeldKeys()
    holds.take(pressed("1"), 2.0)
    assert holds.let_go(3.0) == [up(3.0)]
    assert holds.take(released("1"), 4.0) == []


ONE_STROKE = st.tuples(
    st.builds(KeyEvent, st.sampled_from("123 "), st.sampled_from(Action)), st.floats(0.0, 2.0)
)


@given(st.lists(ONE_STROKE))
def test_every_key_goes_down_as_often_as_up(told: list[tuple[KeyEvent, float]]) -> None:
    holds, now_s = HeldKeys(), 0.0
    changes: list[KeyChange] = []
    for stroke, later_s in told:
        now_s += later_s
        changes += holds.take(stroke, now_s)
    changes += holds.let_go(now_s)
    for key in "123 ":
        downs = [change.down for change in changes if change.key == key]
        # A key may be told of in both ways at once by this noise, so count.
        assert downs.count(True) == downs.count(False)


def test_a_digit_gives_its_label_while_it_is_held() -> None:
    keys = KeyLabels(LABELS)
    assert keys.label == UNKNOWN  # nobody has said anything yet
    keys.take(KeyChange("2", True, 1.0), 1.0)
    assert keys.label == 2
    keys.take(KeyChange("2", False, 2.0), 2.0)
    assert keys.label == 0


def test_a_digit_without_a_label_says_nothing() -> None:
    keys = KeyLabels(LABELS)
    for key in ("5", "9", "0"):
        assert keys.take(KeyChange(key, True, 1.0), 1.0) == []
    assert keys.label == UNKNOWN


def test_the_key_that_went_down_last_counts() -> None:
    keys = KeyLabels(LABELS)
    said = []
    for key, down in (("1", True), ("3", True), ("3", False), ("1", False)):
        keys.take(KeyChange(key, down, 1.0), 1.0)
        said.append(keys.label)
    assert said == [1, 3, 1, 0]


def test_a_release_that_is_noticed_late_is_put_where_it_belongs() -> None:
    keys = KeyLabels(LABELS)
    keys.take(KeyChange("1", True, 1.0), 1.0)
    assert keys.take(KeyChange("1", False, 2.31), 2.7) == [LabelCorrection("key", 2.31, 2.7, 0)]


def test_of_a_tap_nobody_knows_how_long_it_lasted() -> None:
    keys = KeyLabels(LABELS)
    keys.take(KeyChange("1", True, 1.0), 1.0)
    notes = keys.take(KeyChange("1", False, 1.0, tapped=True), 1.8)
    assert notes == [LabelCorrection("key", 1.0, 1.8, UNKNOWN)]
    assert keys.label == 0


def test_space_pauses_and_goes_on() -> None:
    keys = KeyLabels(LABELS)
    assert keys.take(KeyChange(SPACE, True, 1.0), 1.1) == [Mark(1.1, "key", "pause")]
    assert keys.paused
    assert keys.take(KeyChange(SPACE, False, 1.2), 1.2) == []
    assert keys.take(KeyChange(SPACE, True, 5.0), 5.0) == [Mark(5.0, "key", "go on")]
    assert not keys.paused


@pytest.mark.parametrize(
    ("again_s", "from_s"),
    [(11.0, 4.0), (12.9, 4.0), (13.5, 10.5)],  # soon: three seconds more; later: the last three
)
def test_backspace_drops_three_seconds_and_again_three_more(again_s: float, from_s: float) -> None:
    keys = KeyLabels(LABELS)
    drop, mark = keys.take(KeyChange(BACKSPACE, True, 10.0), 10.1)
    assert drop == LabelCorrection("excluded", 7.0, 10.1, True)
    assert mark == Mark(10.1, "key", "drop 7.000 to 10.000 s")
    drop, _ = keys.take(KeyChange(BACKSPACE, True, again_s), again_s)
    assert drop == LabelCorrection("excluded", from_s, again_s, True)


def test_nothing_before_the_beginning_is_dropped() -> None:
    drop, _ = KeyLabels(LABELS).take(KeyChange(BACKSPACE, True, 1.0), 1.0)
    assert drop == LabelCorrection("excluded", 0.0, 1.0, True)
