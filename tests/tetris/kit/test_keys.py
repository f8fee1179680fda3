"""Hands: keys with auto-repeat, bindings by name, and pads that come and go."""

import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tetris.engine.game import Action
from tetris.kit import bindings, language
from tetris.kit.bindings import DueAction, Keys
from tetris.kit.pads import Pads, Press

LEFT, RIGHT = SHIFTS = Action.LEFT, Action.RIGHT


# -- keys ----------------------------------------------------------------------------------


def hands(das_s: float = 0.167, arr_s: float = 0.033) -> Keys[Action]:
    table = bindings.table(Action, bindings.KEYS)
    return Keys(table, das_s=das_s, arr_s=arr_s, shifts=SHIFTS)


def polled(keys: Keys[Action], time_s: float) -> list[Action]:
    """The actions that are due."""
    return [due.action for due in keys.due(time_s)]


@given(st.floats(0.0, 3.0), st.floats(0.016, 0.5), st.sampled_from([0.0, 0.05, 0.167]), st.data())
def test_a_tap_is_one_step_however_late_its_frame(
    before_s: float, frame_s: float, das_s: float, data: st.DataObject
) -> None:
    """A tap shorter than a frame: its press and release come together, or a frame apart."""
    keys, apart = hands(das_s=max(das_s, frame_s * 1.01)), data.draw(st.booleans())
    polled(keys, before_s)
    keys.press(pygame.K_RIGHT, before_s + frame_s)
    steps = polled(keys, before_s + frame_s) if apart else []
    up_s = before_s + frame_s * (2 if apart else 1)
    keys.release(pygame.K_RIGHT, up_s)
    steps += polled(keys, up_s)
    assert steps + polled(keys, up_s + 9.0) == [RIGHT]


@pytest.mark.parametrize("late_s", [0.05, 0.2, 0.5])
def test_a_late_frame_does_not_make_a_tap_a_run(late_s: float) -> None:
    keys = hands(das_s=0.05, arr_s=0.0)  # to the wall, once it repeats
    keys.press(pygame.K_RIGHT, 1.0)
    assert polled(keys, 1.0) == [RIGHT]
    keys.release(pygame.K_RIGHT, 1.0 + late_s)  # it was up long before
    assert polled(keys, 1.0 + late_s) == []


def test_a_key_acts_once_when_it_is_pressed() -> None:
    keys = hands()
    keys.press(pygame.K_UP, 0.0)
    keys.press(pygame.K_SPACE, 0.01)
    assert polled(keys, 0.02) == [Action.ROTATE_CW, Action.HARD_DROP]
    assert polled(keys, 9.0) == []


def test_a_held_shift_repeats_after_167_ms_and_then_every_33_ms() -> None:
    keys = hands()
    keys.press(pygame.K_LEFT, 0.0)
    assert polled(keys, 0.166) == [LEFT]
    assert polled(keys, 0.168) == [LEFT]
    assert polled(keys, 0.199) == []
    assert polled(keys, 0.201) == [LEFT]
    assert polled(keys, 0.301) == [LEFT] * 3
    keys.release(pygame.K_LEFT, 0.301)
    assert polled(keys, 9.0) == []


def test_repeats_between_two_frames_are_not_lost_and_keep_their_moments() -> None:
    keys = hands(das_s=0.125, arr_s=0.0625)
    keys.press(pygame.K_LEFT, 0.0)
    assert keys.due(0.2) == [
        DueAction(0.0, LEFT, held=frozenset({LEFT})),
        DueAction(0.125, LEFT, repeated=True, held=frozenset({LEFT})),
        DueAction(0.1875, LEFT, repeated=True, held=frozenset({LEFT})),
    ]


def test_of_two_held_directions_the_later_rules_and_the_other_then_starts_afresh() -> None:
    keys = hands()
    keys.press(pygame.K_LEFT, 0.0)
    keys.press(pygame.K_RIGHT, 0.1)
    assert polled(keys, 0.26) == [LEFT, RIGHT]
    assert polled(keys, 0.268) == [RIGHT]
    keys.release(pygame.K_RIGHT, 0.27)
    assert polled(keys, 0.43) == []
    assert polled(keys, 0.438) == [LEFT]


def test_without_a_repeat_time_a_held_direction_reaches_any_wall_at_once() -> None:
    keys = hands(das_s=0.1, arr_s=0.0)
    keys.press(pygame.K_LEFT, 0.0)
    assert polled(keys, 0.05) == [LEFT]
    assert polled(keys, 0.11) == [LEFT] * 9


def test_held_down_is_one_row_and_then_a_soft_drop() -> None:
    keys = hands()
    keys.press(pygame.K_DOWN, 0.0)
    assert polled(keys, 0.0) == [Action.DOWN]
    assert Action.DOWN in keys.held
    keys.release(pygame.K_DOWN, 0.3)
    assert Action.DOWN not in keys.held


def test_a_window_that_loses_the_focus_lets_go_of_everything() -> None:
    keys = hands()
    keys.press(pygame.K_LEFT, 0.0)
    keys.press(pygame.K_DOWN, 0.0)
    keys.release_all()
    assert polled(keys, 9.0) == []
    assert Action.DOWN not in keys.held


def test_each_action_knows_what_was_held_at_its_moment_and_not_what_came_after() -> None:
    keys = hands()
    keys.press(pygame.K_SPACE, 0.0)
    keys.press(pygame.K_UP, 0.0)
    keys.release(pygame.K_SPACE, 0.0)
    keys.press(pygame.K_c, 0.0)
    assert [(due.action, set(due.held)) for due in keys.due(0.0)] == [
        (Action.HARD_DROP, {Action.HARD_DROP}),
        (Action.ROTATE_CW, {Action.HARD_DROP, Action.ROTATE_CW}),
        (Action.HOLD, {Action.ROTATE_CW, Action.HOLD}),
    ]


def test_unknown_keys_do_nothing() -> None:
    keys = Keys({pygame.K_a: LEFT}, das_s=0.1, arr_s=0.05, shifts=SHIFTS)
    keys.press(pygame.K_LEFT, 0.0)
    keys.press(pygame.K_a, 0.0)
    assert polled(keys, 0.151) == [LEFT] * 3


@given(
    st.lists(st.tuples(st.booleans(), st.sampled_from([pygame.K_LEFT, pygame.K_RIGHT])), max_size=9)
)
def test_all_repeats_come_in_the_order_of_time(steps: list[tuple[bool, int]]) -> None:
    keys, now_s = hands(das_s=0.02, arr_s=0.01), 0.0
    for down, key in steps:
        now_s += 0.03
        (keys.press if down else keys.release)(key, now_s)
    times = [due.time_s for due in keys.due(now_s)]
    assert times == sorted(times)


# -- bindings ------------------------------------------------------------------------------


def test_bindings_are_written_by_name_and_several_keys_do_the_same() -> None:
    table = bindings.table(Action, {"left": ["a", "kp4"], "hold": ["pad_l1"]})
    assert table == {pygame.K_a: LEFT, pygame.K_KP4: LEFT, "pad_l1": Action.HOLD}


def test_names_that_mean_nothing_are_left_out() -> None:
    assert bindings.table(Action, {"left": ["no such key"], "fly": ["a"]}) == {}


def test_a_key_bound_anew_is_taken_from_what_it_did_before() -> None:
    names = bindings.bound({"left": ("a",), "right": ("d",)}, "right", "a")
    assert names == {"left": (), "right": ("d", "a")}


def test_the_last_binding_of_an_action_can_be_taken_away() -> None:
    names = bindings.unbound({"left": ("a", "left"), "right": ()}, "left")
    assert names == {"left": ("a",), "right": ()}
    assert bindings.unbound(names, "right")["right"] == ()


def test_every_action_has_a_key_and_no_key_has_two_actions() -> None:
    for names in (bindings.KEYS, bindings.PADS):
        assert set(names) == set(bindings.ACTIONS)
        given = [name for bound in names.values() for name in bound]
        assert len(given) == len(set(given))
        assert all(bindings.is_name(name) for name in given)
    assert all(bindings.KEYS.values())


@pytest.mark.parametrize(
    ("name", "caption"),
    [
        ("left", "←"),
        ("a", "A"),
        ("kp7", "Num 7"),
        ("pad_left", "←"),
        ("pad_l1", "L1"),
        ("stick_up", "Stick ↑"),
        ("kp_enter", "Num ⏎"),
        ("pad_lb", "LB"),
        ("space", "Leer"),
        ("lctrl", "Strg L"),
    ],
)
def test_a_key_is_shown_as_what_stands_on_it(name: str, caption: str) -> None:
    assert bindings.caption(name, language.load("de")) == caption


def test_every_key_of_pygame_can_be_bound_by_its_name() -> None:
    name = bindings.key_name(pygame.K_F5)
    assert name == "f5"
    assert bindings.table(Action, {"undo": [name]}) == {pygame.K_F5: Action.UNDO}
    assert bindings.key_name(-1) is None


# -- pads ----------------------------------------------------------------------------------


def button(down: bool, number: int, pad: int = 0) -> pygame.event.Event:
    kind = pygame.CONTROLLERBUTTONDOWN if down else pygame.CONTROLLERBUTTONUP
    return pygame.event.Event(kind, instance_id=pad, button=number)


def stick(value: int, axis: int = pygame.CONTROLLER_AXIS_LEFTX) -> pygame.event.Event:
    return pygame.event.Event(pygame.CONTROLLERAXISMOTION, instance_id=0, axis=axis, value=value)


def test_a_pads_buttons_have_names() -> None:
    pads = Pads()
    assert pads.take(button(True, pygame.CONTROLLER_BUTTON_A)) == [Press("pad_a", True)]
    assert pads.take(button(False, pygame.CONTROLLER_BUTTON_A)) == [Press("pad_a", False)]


def test_a_stick_is_two_buttons_and_its_trembling_none() -> None:
    pads = Pads()
    assert pads.take(stick(-30_000)) == [Press("stick_left", True)]
    assert pads.take(stick(-16_000)) == []
    assert pads.take(stick(-30_000)) == []
    assert pads.take(stick(0)) == [Press("stick_left", False)]


def test_a_stick_thrown_across_comes_up_on_one_side_and_goes_down_on_the_other() -> None:
    pads = Pads()
    pads.take(stick(-30_000))
    assert pads.take(stick(30_000)) == [Press("stick_left", False), Press("stick_right", True)]


def test_a_trigger_is_a_button() -> None:
    axis = pygame.CONTROLLER_AXIS_TRIGGERLEFT
    assert Pads().take(stick(32_000, axis)) == [Press("pad_l2", True)]


def test_a_pad_that_is_pulled_out_lets_go_of_its_buttons() -> None:
    pads = Pads()
    pads.take(button(True, pygame.CONTROLLER_BUTTON_DPAD_LEFT, pad=3))
    gone = pygame.event.Event(pygame.JOYDEVICEREMOVED, instance_id=3)
    assert pads.take(gone) == [Press("pad_left", False)]
    assert pads.take(gone) == []


def test_a_button_held_on_two_pads_comes_up_with_the_last() -> None:
    pads = Pads()
    pads.take(button(True, pygame.CONTROLLER_BUTTON_A, pad=1))
    pads.take(button(True, pygame.CONTROLLER_BUTTON_A, pad=2))
    assert pads.take(button(False, pygame.CONTROLLER_BUTTON_A, pad=1)) == []
    assert pads.take(button(False, pygame.CONTROLLER_BUTTON_A, pad=2)) == [Press("pad_a", False)]


def test_events_of_other_devices_mean_nothing_to_pads() -> None:
    assert Pads().take(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_a)) == []
