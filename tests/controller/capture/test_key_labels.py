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


# --- keys that are held ---------------------------------------------------------------------------


def type_at(holds: HeldKeys, key: str, *times: float) -> list[KeyChange]:
    return [change for t_s in times for change in holds.take(typed(key), t_s)]


def repeats(
    first_s: float, until_s: float, delay_s: float = 0.5, every_s: float = 0.03
) -> list[float]:
    """Return when a keyboard sends the characters of a key that is held."""
    count = int((until_s - first_s - delay_s) / every_s)
    return [first_s, *(first_s + delay_s + i * every_s for i in range(count + 1))]


def test_a_terminal_that_tells_releases_is_taken_at_its_word() -> None:
    holds = HeldKeys()
    assert holds.take(pressed("1"), 2.0) == [KeyChange("1", True, 2.0)]
    assert holds.pass_time(60.0) == []
    assert holds.take(released("1"), 61.0) == [KeyChange("1", False, 61.0)]
    assert holds.take(released("1"), 62.0) == []  # it was down before we came


def test_characters_mean_a_key_is_down_and_their_end_up() -> None:
    holds = HeldKeys()
    times = repeats(2.0, 4.0)
    assert type_at(holds, "1", *times) == [KeyChange("1", True, 2.0)]
    assert holds.pass_time(times[-1] + 0.2) == []  # perhaps the next one is late
    assert holds.pass_time(times[-1] + 0.3) == [KeyChange("1", False, times[-1])]


def test_over_a_network_that_stutters_a_key_stays_down() -> None:
    holds = HeldKeys()
    times = [2.0, 2.5, 2.53, 2.56, 2.76, 2.77, 2.78, 3.1, 3.13, 3.4]
    assert type_at(holds, "1", *times) == [KeyChange("1", True, 2.0)]


def test_a_key_that_was_typed_once_has_no_length() -> None:
    holds = HeldKeys()
    type_at(holds, "1", 2.0)
    assert holds.pass_time(2.0 + FIRST_REPEAT_S) == []
    assert holds.pass_time(2.1 + FIRST_REPEAT_S) == [KeyChange("1", False, 2.0, tapped=True)]


def test_the_wait_for_the_first_repeat_is_learned() -> None:
    holds = HeldKeys()
    type_at(holds, "1", *repeats(2.0, 3.0, delay_s=0.25))
    holds.pass_time(5.0)
    type_at(holds, "1", 6.0)
    assert holds.pass_time(6.4) == [KeyChange("1", False, 6.0, tapped=True)]


def test_a_key_typed_twice_at_once_went_down_twice() -> None:
    holds = HeldKeys()
    up_down = [KeyChange("1", False, 2.0, tapped=True), KeyChange("1", True, 2.15)]
    assert type_at(holds, "1", 2.0, 2.15) == [KeyChange("1", True, 2.0), *up_down]


def test_another_key_ends_the_first_because_its_characters_do() -> None:
    holds = HeldKeys()
    times = repeats(2.0, 3.0)
    type_at(holds, "1", *times)
    change = [KeyChange("1", False, times[-1]), KeyChange("2", True, 3.1)]
    assert type_at(holds, "2", 3.1) == change


def test_keys_are_let_go_of_when_nobody_looks() -> None:
    holds = HeldKeys()
    holds.take(pressed("1"), 2.0)
    assert holds.let_go(3.0) == [KeyChange("1", False, 3.0)]
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


# --- what they mean -------------------------------------------------------------------------------


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
def test_backspace_drops_the_last_three_seconds_and_again_three_more(
    again_s: float, from_s: float
) -> None:
    keys = KeyLabels(LABELS)
    drop, mark = keys.take(KeyChange(BACKSPACE, True, 10.0), 10.1)
    assert drop == LabelCorrection("excluded", 7.0, 10.1, True)
    assert mark == Mark(10.1, "key", "drop 7.000 to 10.000 s")
    drop, _ = keys.take(KeyChange(BACKSPACE, True, again_s), again_s)
    assert drop == LabelCorrection("excluded", from_s, again_s, True)


def test_nothing_before_the_beginning_is_dropped() -> None:
    drop, _ = KeyLabels(LABELS).take(KeyChange(BACKSPACE, True, 1.0), 1.0)
    assert drop == LabelCorrection("excluded", 0.0, 1.0, True)
