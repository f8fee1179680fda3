"""From a mouse or a touch screen to fingers on the virtual orb."""

import math

import pytest

from controller.protocol.messages import Contact, Contacts
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


def test_what_comes_down_beside_the_dome_touches_nothing() -> None:
    touch = PointerInput()
    assert not touch.press(2.0, 6.0, now_s=0.0)
    touch.finger(1, 2.0, 7.0, down=True)
    touch.finger(1, 2.0, 2.0)
    assert touch.contacts(0.0) == ()


@pytest.mark.parametrize(
    ("pad", "pressed", "twisted"),
    [
        (DomeArea(), [(x, y) for x in range(5) for y in range(5)], [(5.2, 2.0)]),
        (DomeArea(rows=4, columns=6, pitch_mm=8.0), [(5.0, 3.0), (2.5, 1.5)], [(2.5, 3.9)]),
    ],
)
def test_every_taxel_even_at_the_corners_is_pressed_and_the_rim_is_turned(
    pad: DomeArea, pressed: list[tuple[float, float]], twisted: list[tuple[float, float]]
) -> None:
    for mode, places in ((Mode.PRESS, pressed), (Mode.TWIST, twisted)):
        for x, y in places:
            touch = PointerInput(pad)
            touch.press(x, y, now_s=0.0)
            assert touch.mode is mode


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
    touch.press(4.0, 4.0, now_s=0.0, pinch=True)  # near the rim: both fingers stay on the dome
    left, right = touch.contacts(0.0)
    assert touch.pad.on_dome(right.x, right.y)
    assert right.x - left.x == pytest.approx(3.4)


def mode_of_a_press(touch: PointerInput, now_s: float) -> Mode | None:
    touch.press(2.0, 2.0, now_s)
    mode = touch.mode
    touch.release()
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


@pytest.mark.parametrize("turn_deg", [-60, 60])
def test_drag_round_the_rim_turns_the_whole_hand(turn_deg: int) -> None:
    touch = PointerInput()
    touch.press(5.2, 2.0, now_s=0.0)
    assert touch.mode is Mode.TWIST
    before = touch.contacts(0.0)
    assert len(before) == len(pointer_input.TWIST_FINGERS_DEG)
    for step in range(1, 11):
        angle = math.radians(turn_deg * step / 10)
        touch.move(2 + 3.2 * math.cos(angle), 2 + 3.2 * math.sin(angle))
    for old, new in zip(before, touch.contacts(0.5), strict=True):
        turned = math.remainder(angle_of(new) - angle_of(old), 360)
        assert turned == pytest.approx(turn_deg)
        assert math.hypot(new.x - 2, new.y - 2) == pytest.approx(1.8)


def test_a_hand_comes_down_as_the_pointer_stands_and_does_not_jump_when_it_moves() -> None:
    touch = PointerInput()
    touch.press(2.0, 5.2, now_s=0.0)  # a quarter turn from the right
    before = touch.contacts(0.0)
    assert positions(before)[0] == (3.8, 2.0)  # the thumb, which starts below: one quarter further
    for place in ((2.0, 5.1), (2.1, 2.2)):  # across the very centre nothing spins, either
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
