"""The page of the touch strength, with a fake orb whose presses are of other depths."""

import pygame

from controller.shared.protocol.messages import Command
from controller.shared.protocol.teaching import SetStrength
from host.app.screens.teach.screen import TeachScreen
from host.app.screens.teach.strength import StrengthPage
from host.connection.receiver import Connected, Delivered, Lost
from tests.support.app_window import WELCOME
from tests.support.teaching_window import DENT, Window

FIRM = bytes([128] * 5 + [58] * 15 + [128] * 5)  # as firm as the training's presses
LIGHT = bytes([128] * 5 + [100] * 15 + [128] * 5)  # 0.4 times as firm
PRESS = Delivered(Command("down", "press", 0.9, None, 1), 0)


def opened(*items: str) -> Window:
    """Return the application on a page below Teach; users are ann and bob."""
    window = Window()
    window.orb.usual, window.orb.users = FIRM, {"ann": {}, "bob": {}}
    window.pass_s(0.2, *(Delivered(each, 0) for each in window.orb.described()))
    for item in ("Teach", *items):
        window.choose(item)
    window.pass_s(1.0)
    return window


def press(window: Window, image: bytes, times: int = 5) -> None:
    for _ in range(times):
        window.pass_s(0.3, image=image)
        window.pass_s(0.1, PRESS, image=image)
        window.pass_s(0.9)


def value(window: Window, label: str) -> str:
    return window.menu.items[window.number(label)].value


def count(window: Window) -> str:
    return next(row.cells[1] for row in window.menu.table if row.cells[0] == "presses")


def test_five_light_presses_set_the_strength_of_everybody() -> None:
    window = opened("Touch strength")
    assert isinstance(window.screen, StrengthPage)
    selected = window.screen.selected
    press(window, LIGHT, 4)
    assert (count(window), window.screen.selected) == ("4 of 5", selected)  # and are no steps
    assert window.sent(SetStrength) == []
    press(window, LIGHT, 3)  # two more than are needed
    assert window.sent(SetStrength) == [SetStrength(0.4)]
    window.key(pygame.K_ESCAPE)
    assert isinstance(window.screen, TeachScreen)
    assert value(window, "Touch strength") == "light, 0.40"


def test_a_user_gets_a_strength_and_goes_back_to_that_of_all() -> None:
    window = opened("Users", "bob", "Touch strength")
    assert window.menu.title == "bob: Touch strength"
    press(window, bytes([128] * 5 + [16] * 15 + [128] * 5))
    assert window.sent(SetStrength) == [SetStrength(1.6, "bob")]
    assert window.orb.strengths == {"": 1.0, "bob": 1.6}
    window.choose("Use everybody's strength")
    assert window.orb.strengths == {"": 1.0}
    assert window.menu.items[window.number("Use everybody's")].do is None


def test_presses_are_counted_again_after_a_first_result() -> None:
    window = opened("Touch strength")
    press(window, LIGHT)
    window.choose("Press again")
    window.pass_s(1.0)
    press(window, FIRM)
    assert window.sent(SetStrength) == [SetStrength(0.4), SetStrength(1.0)]


def test_a_strength_that_is_set_already_changes_nothing() -> None:
    window = opened("Touch strength")
    press(window, FIRM)
    assert (count(window), window.sent(SetStrength)) == ("5 of 5", [])


def test_presses_go_on_after_a_lost_link() -> None:
    window = opened("Touch strength")
    press(window, LIGHT, 4)
    window.pass_s(1.0, Lost("gone"))
    window.pass_s(0.2, Connected(WELCOME))
    assert window.sent(SetStrength) == []
    press(window, LIGHT, 1)
    assert window.sent(SetStrength) == [SetStrength(0.4)]


def test_presses_of_a_page_that_was_left_are_forgotten() -> None:
    window = opened("Touch strength")
    press(window, LIGHT, 4)
    window.key(pygame.K_ESCAPE)
    window.choose("Touch strength")
    window.pass_s(1.0)
    press(window, LIGHT, 1)
    assert (count(window), window.sent(SetStrength)) == ("1 of 5", [])


def test_the_touch_that_opened_the_page_is_no_press() -> None:
    window = opened()
    window.make("Touch strength")
    window.pass_s(0.5, image=DENT)
    window.pass_s(1.5)
    assert count(window) == "0 of 5"


def test_an_orb_without_the_setting_offers_none() -> None:
    window = opened()
    window.orb.strengths = {}
    window.pass_s(0.5, *(Delivered(each, 0) for each in window.orb.described()))
    assert window.menu.items[window.number("Touch strength")].do is None
