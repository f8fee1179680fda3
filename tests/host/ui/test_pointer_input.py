"""From a mouse or a touch screen to fingers on the virtual orb."""

import itertools
import math
from collections.abc import Sequence

import pytest

from controller.shared.protocol.messages import Contact, Contacts
from controller.simulator.virtual_orb import DEEPEST_MM
from host.ui import pointer_input
from host.ui.pointer_input import DomeArea, Mode, PointerInput


def positions(contacts: tuple[Contact, ...]) -> list[tuple[float, float]]:
    return [(round(contact.x, 3), round(contact.y, 3)) for contact in contacts]


def angle_of(contact: Contact) -> float:
    return math.degrees(math.atan2(contact.y - 2, contact.x - 2))


def test_left_button_holds_one_finger_where_the_pointer_is() -> None:
    touch = PointerInput()
    assert touch.press(1.0, 3.0, now_s=0.0)
    assert touch.contacts(0.0) == (
        Contact(0, 1.0, 3.0, pointer_input.PRESS_DEPTH_MM, pointer_input.FINGER_RADIUS_MM),
    )
    touch.move(1.5, 2.5)
    assert positions(touch.contacts(0.1)) == [(1.5, 2.5)]
    touch.release()
    assert touch.contacts(0.2) == ()


def test_a_finger_is_pressed_deeper_for_a_moment_and_not_lifted_in_it() -> None:
    touch = PointerInput()
    touch.press(2.0, 2.0, now_s=0.0)
    touch.deepen(1.0)
    touch.release()
    depths = [contact.depth_mm for at_s in (1.0, 1.15, 1.4) for contact in touch.contacts(at_s)]
    usual = pointer_input.PRESS_DEPTH_MM
    assert depths == [usual, usual + pointer_input.DEEPER_MM]
    touch.deepen(2.0)
    touch.press(2.0, 2.0, now_s=2.1)
    assert touch.contacts(2.1)[0].depth_mm == usual


def test_a_light_finger_leaves_room_to_be_pressed_deeper_and_two_are_as_firm_as_ever() -> None:
    touch = PointerInput(light=True)
    touch.press(2.0, 2.0, 1.0)
    light = pointer_input.PRESS_DEPTH_MM - pointer_input.LIGHTER_MM
    assert [finger.depth_mm for finger in touch.contacts(1.0)] == [light]
    touch.deepen(1.1)
    assert touch.contacts(1.2)[0].depth_mm == light + pointer_input.DEEPER_MM
    touch.release()
    touch.press(2.0, 2.0, 2.0, pinch=True)
    assert {finger.depth_mm for finger in touch.contacts(2.0)} == {pointer_input.PINCH_DEPTH_MM}


def test_a_second_finger_presses_the_one_that_aims_deeper_wherever_it_lands() -> None:
    touch = PointerInput(light=True)
    light = pointer_input.PRESS_DEPTH_MM - pointer_input.LIGHTER_MM
    touch.finger("first", 1.0, 2.0, down=True)
    assert [finger.depth_mm for finger in touch.contacts(1.0)] == [light]
    touch.finger("second", 3.0, 3.0, down=True)
    for at_s, deeper_mm in ((1.3, 0.0), (1.4, pointer_input.DEEPER_MM)):
        (finger,) = touch.contacts(at_s)
        assert (finger.x, finger.depth_mm) == (1.0, light + deeper_mm)
    touch.finger_up("second")
    assert [finger.depth_mm for finger in touch.contacts(1.5)] == [light]


def test_two_fingers_that_land_together_are_two_though_one_is_seen_first() -> None:
    touch = PointerInput(light=True)
    touch.finger("first", 1.0, 2.0, down=True)
    touch.contacts(1.0)
    touch.finger("second", 3.0, 2.0, down=True)
    for at_s in (1.1, 1.5):
        assert {finger.x for finger in touch.contacts(at_s)} == {1.0, 3.0}


def test_what_comes_down_beside_the_dome_touches_nothing() -> None:
    touch = PointerInput()
    assert not touch.press(2.0, 6.0, now_s=0.0)
    touch.finger(1, 2.0, 7.0, down=True)
    touch.finger(1, 2.0, 2.0)
    assert touch.contacts(0.0) == ()


@pytest.mark.parametrize("pad", [DomeArea(), DomeArea(rows=4, columns=6, pitch_mm=8.0)])
def test_finger_is_on_every_taxel_at_once_even_at_the_corners(pad: DomeArea) -> None:
    for x, y in itertools.product(range(pad.columns), range(pad.rows)):
        touch = PointerInput(pad)
        touch.press(x, y, now_s=0.0)
        assert positions(touch.contacts(0.0)) == [(x, y)]


def fingers(touch: PointerInput, seconds: Sequence[float]) -> list[int]:
    """Return how many fingers are down at each time."""
    return [len(touch.contacts(at_s)) for at_s in seconds]


RIM = [
    (2 + reach * math.cos(math.radians(degrees)), 2 + reach * math.sin(math.radians(degrees)))
    for reach, apart in ((2.7, 90), (3.1, 15), (3.5, 15))
    for degrees in range(0, 360, apart)
]


@pytest.mark.parametrize("place", RIM)
def test_click_on_the_rim_is_one_finger_there_for_as_long_as_the_button_was_down(
    place: tuple[float, float],
) -> None:
    touch = PointerInput()
    assert touch.press(*place, now_s=0.0)
    assert fingers(touch, [0.0, 0.05, 0.14]) == [0, 0, 0]  # it could become a twist
    touch.release()
    for at_s in (0.15, 0.2, 0.29):
        (finger,) = touch.contacts(at_s)
        assert (finger.x, finger.y) == pytest.approx(place)
        assert touch.mode is Mode.PRESS
    assert fingers(touch, [0.3, 0.4]) == [0, 0]
    assert touch.mode is None


def test_very_short_click_on_the_rim_is_long_enough_to_be_felt() -> None:
    touch = PointerInput()
    touch.press(2.0, 5.5, now_s=0.0)
    touch.contacts(0.03)
    touch.release()
    assert fingers(touch, [0.05, 0.16, 0.05 + pointer_input.RIM_LEAST_S]) == [1, 1, 0]


def test_held_button_on_the_rim_presses_once_the_pointer_rests() -> None:
    touch = PointerInput()
    touch.press(2.0, -1.4, now_s=0.0)
    for step in range(4):  # a hand trembles
        touch.move(2.0 + 0.01 * (-1) ** step, -1.4)
        assert fingers(touch, [0.05 * step]) == [0]
    assert fingers(touch, [pointer_input.REST_S, 5.0]) == [1, 1]
    touch.release()
    assert fingers(touch, [5.1, 5.1 + pointer_input.REST_S]) == [1, 0]


def test_finger_that_waited_lands_where_the_button_went_down_and_follows_the_pointer() -> None:
    touch = PointerInput()
    touch.press(5.2, 2.0, now_s=0.0)
    assert fingers(touch, [0.05]) == [0]
    touch.move(3.0, 2.0)  # off the rim, so it is no turn
    after = [touch.contacts(0.1 + pointer_input.FOLLOW_S * share) for share in (0.0, 0.5, 1.0)]
    assert [contact.x for (contact,) in after] == pytest.approx([5.2, 4.1, 3.0])


def test_finger_presses_deeper_the_less_the_taxels_feel_of_it() -> None:
    depths = []
    for x in (2.0, 4.0, 4.5, 5.0, 5.5):
        touch = PointerInput()
        touch.finger("index", x, 2.0, down=True)  # on a touch screen as with the mouse
        (finger,) = touch.contacts(0.0)
        depths.append(finger.depth_mm)
    assert depths[:2] == [pointer_input.PRESS_DEPTH_MM, pytest.approx(9.0, abs=0.1)]
    assert depths == sorted(depths)
    assert depths[-1] == pointer_input.RIM_DEPTH_MM <= DEEPEST_MM


@pytest.mark.parametrize(
    "way", [[(2.0, 2.0)], [(3.9, 2.0), (2.5, 2.2)], [(5.5, 2.1)], [(4.2, 3.0), (3.0, 3.3)]]
)
def test_straight_drag_from_the_rim_inwards_or_outwards_never_turns(
    way: list[tuple[float, float]],
) -> None:
    touch = PointerInput()
    before = 5.0, 2.0
    touch.press(*before, now_s=0.0)
    for number, to in enumerate(way):
        for step in range(1, 31):
            share = step / 30
            touch.move(*(a + share * (b - a) for a, b in zip(before, to, strict=True)))
            assert len(touch.contacts(number + step / 60)) <= 1
        before = to
    assert touch.mode is Mode.PRESS


def test_finger_slides_along_the_edge_and_never_leaves_the_dome() -> None:
    touch = PointerInput()
    touch.press(2.0, 2.0, now_s=0.0)
    edge = 3.8 * pointer_input.EDGE
    for pointer, finger in (((9.0, 2.0), (2 + edge, 2.0)), ((2.0, -9.0), (2.0, 2 - edge))):
        touch.move(*pointer)
        (contact,) = touch.contacts(0.1)
        assert (contact.x, contact.y) == pytest.approx(finger)


def test_pinch_closes_in_while_the_button_is_held() -> None:
    touch = PointerInput()
    touch.press(2.0, 2.0, now_s=1.0, pinch=True)
    assert positions(touch.contacts(1.0)) == [(0.3, 2.0), (3.7, 2.0)]
    assert positions(touch.contacts(1.05)) == [(0.8, 2.0), (3.2, 2.0)]
    assert positions(touch.contacts(1.1)) == [(1.3, 2.0), (2.7, 2.0)]
    assert touch.contacts(9.0) == touch.contacts(1.1)
    touch.release()
    assert touch.contacts(9.1) == ()


@pytest.mark.parametrize("place", [(2.0, 2.2), (4.0, 4.0), *RIM])
def test_pinch_is_about_the_middle_wherever_the_button_went_down(
    place: tuple[float, float],
) -> None:
    touch = PointerInput()
    touch.press(*place, now_s=0.0, pinch=True)
    left, right = touch.contacts(0.0)
    middle = (left.x + right.x) / 2, (left.y + right.y) / 2
    away, meant = (math.dist(one, (2.0, 2.0)) for one in (middle, place))
    assert away == pytest.approx(min(meant, pointer_input.PINCH_REACH))
    assert right.x - left.x == pytest.approx(3.4)


def test_short_right_click_is_a_whole_pinch() -> None:
    touch = PointerInput()
    touch.press(2.0, 2.0, now_s=0.0, pinch=True)
    touch.contacts(0.03)
    touch.release()
    touch.move(3.0, 3.0)  # the pointer has left
    assert positions(touch.contacts(0.1)) == [(1.3, 2.0), (2.7, 2.0)]
    assert touch.contacts(pointer_input.PINCH_LEAST_S) == ()


def test_next_click_may_come_while_the_last_one_still_ends() -> None:
    touch = PointerInput()
    touch.press(2.0, 2.0, now_s=0.0, pinch=True)
    touch.contacts(0.03)
    touch.release()
    assert touch.press(1.0, 1.0, now_s=0.05)
    assert positions(touch.contacts(0.05)) == [(1.0, 1.0)]


def mode_of_a_press(touch: PointerInput, now_s: float) -> Mode | None:
    touch.press(2.0, 2.0, now_s)
    mode = touch.mode
    touch.release()
    touch.contacts(now_s + 0.5)
    return mode


def test_tap_of_the_two_finger_key_switches_the_left_button() -> None:
    touch = PointerInput()
    touch.hold_two(True)
    touch.hold_two(False)
    assert mode_of_a_press(touch, 0.0) is Mode.PINCH
    assert mode_of_a_press(touch, 1.0) is Mode.PINCH
    touch.hold_two(True)
    touch.hold_two(False)
    assert mode_of_a_press(touch, 2.0) is Mode.PRESS
    touch.hold_two(True)  # held, it is forgotten after one touch
    assert mode_of_a_press(touch, 3.0) is Mode.PINCH
    touch.hold_two(False)
    assert mode_of_a_press(touch, 4.0) is Mode.PRESS


def go_round(touch: PointerInput, turn_deg: float, steps: int = 10) -> None:
    for step in range(steps + 1):
        angle = math.radians(turn_deg * step / steps)
        touch.move(2 + 3.2 * math.cos(angle), 2 + 3.2 * math.sin(angle))


@pytest.mark.parametrize("turn_deg", [-60, 60])
def test_going_round_the_rim_puts_a_whole_hand_down_that_turns_on(turn_deg: int) -> None:
    touch = PointerInput()
    touch.press(5.2, 2.0, now_s=0.0)
    go_round(touch, math.copysign(7.9, turn_deg))
    assert fingers(touch, [0.1]) == [0]
    go_round(touch, math.copysign(8.1, turn_deg))
    before = touch.contacts(0.2)
    assert len(before) == len(pointer_input.TWIST_FINGERS_DEG)
    go_round(touch, turn_deg)
    for old, new in zip(before, touch.contacts(0.5), strict=True):
        turned = math.remainder(angle_of(new) - angle_of(old), 360)
        assert turned == pytest.approx(turn_deg - math.copysign(8.1, turn_deg))
        assert math.hypot(new.x - 2, new.y - 2) == pytest.approx(1.8)
    touch.release()
    assert fingers(touch, [0.51]) == [0]


def test_slow_pointer_goes_round_without_a_press_before() -> None:
    touch = PointerInput()
    touch.press(5.2, 2.0, now_s=0.0)
    for tick in range(90):  # 12 degrees a second
        angle = math.radians(12 * tick / 60)
        touch.move(2 + 3.2 * math.cos(angle), 2 + 3.2 * math.sin(angle))
        assert len(touch.contacts(tick / 60)) in (0, 4)
    assert touch.mode is Mode.TWIST


def test_fingers_of_a_twist_do_not_spin_when_the_pointer_crosses_the_centre() -> None:
    touch = PointerInput()
    touch.press(5.2, 2.0, now_s=0.0)
    go_round(touch, 90.0)
    before = touch.contacts(0.0)
    assert positions(before)[0] == (3.8, 2.0)  # the thumb, which starts below: one quarter further
    for place in ((2.0, 5.1), (2.1, 2.2)):
        touch.move(*place)
        assert touch.contacts(0.1) == before


def test_fingers_of_a_touch_screen_pass_through_side_by_side() -> None:
    touch = PointerInput()
    touch.finger("thumb", 1.0, 2.0, down=True)
    touch.finger("index", 3.0, 2.0, down=True)
    touch.finger("thumb", 1.4, 2.0)
    assert positions(touch.contacts(0.0)) == [(1.4, 2.0), (3.0, 2.0)]
    assert len({contact.id for contact in touch.contacts(0.0)}) == 2
    touch.finger_up("thumb")
    assert positions(touch.contacts(0.0)) == [(3.0, 2.0)]


def test_no_more_fingers_than_a_packet_carries() -> None:
    touch = PointerInput()
    touch.press(5.2, 2.0, now_s=0.0)
    for number in range(30):
        touch.finger(number, 2.0, 2.0, down=True)
    assert len(touch.contacts(0.0)) <= 16


def test_moves_are_sent_at_most_sixty_times_a_second() -> None:
    touch = PointerInput()
    touch.press(2.0, 2.0, now_s=0.0)
    sent = 0
    for millisecond in range(1000):
        touch.move(2.0 + millisecond / 1000, 2.0)
        sent += touch.update(millisecond / 1000) is not None
    assert 50 <= sent <= 60


def test_resting_finger_is_repeated_ten_times_a_second() -> None:
    touch = PointerInput()
    touch.press(2.0, 2.0, now_s=0.0)
    sent = [tick for tick in range(60) if touch.update(tick / 60)]
    assert sent == list(range(0, 60, 6))
    touch.release()  # lifting is sent at once, and only once
    assert touch.update(1.001) == Contacts(())
    assert touch.update(5.0) is None


def test_losing_the_focus_lifts_everything() -> None:
    touch = PointerInput()
    touch.press(2.0, 2.0, now_s=0.0)
    touch.finger(7, 1.0, 1.0, down=True)
    touch.update(0.0)
    touch.hold_two(True)
    touch.lift_all()
    assert touch.update(0.1) == Contacts(())
    assert mode_of_a_press(touch, 1.0) is Mode.PRESS
