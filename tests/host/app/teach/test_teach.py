"""Teach in the application, with a fake orb that answers its requests."""

import pygame
import pytest

from controller.shared.protocol.messages import Command
from controller.shared.protocol.teaching import (
    ExampleDrop,
    ExampleEnd,
    ExampleStart,
    Forget,
    Learn,
    SetCommand,
)
from host.app.screens.teach.examples import ExamplesPage
from host.app.screens.teach.new_gesture import DetailsPage, TryPage
from host.app.screens.teach.page import NamePage
from host.app.screens.teach.screen import TeachScreen
from host.connection.receiver import Connected, Delivered, Lost
from tests.support.app_window import WELCOME
from tests.support.teaching_window import DENT, Window
from tetris.window.play_screen import PlayScreen


@pytest.fixture
def window() -> Window:
    """Return the application on the page of the examples of a swipe."""
    window = Window()
    for item in ("Teach", "New gesture", "swipe"):
        window.choose(item)
    assert isinstance(window.screen, ExamplesPage)
    return window


def touch(window: Window, times: int = 3) -> None:
    """Make examples."""
    for _ in range(times):
        window.touch()


@pytest.mark.parametrize("by", ["click", "choose"])
def test_a_gesture_is_taught_by_mouse_or_keys_only(by: str) -> None:
    window = Window()
    take = getattr(window, by)
    for item, page in [
        ("Teach", TeachScreen),
        ("New gesture", NamePage),
        ("swipe", ExamplesPage),
    ]:
        take(item)
        assert isinstance(window.screen, page)
    touch(window)
    take("Next")
    assert isinstance(window.screen, DetailsPage)
    take("Learn")
    assert isinstance(window.screen, TryPage)
    assert window.sent(Learn) == [Learn("swipe", "hold", "none", False, "")]
    take("Play with it")
    assert isinstance(window.app.stage.screen, PlayScreen)


def test_a_gesture_is_taught_by_the_orb_only() -> None:
    window = Window()
    for item in ("Teach", "New gesture", "swipe"):
        window.make(item)
    touch(window, 5)
    window.pass_s(4.0)  # the next page comes by itself
    window.make("Learn")
    for _ in range(5):
        window.pass_s(0.2, image=DENT)
        window.pass_s(0.1, Delivered(Command("drop", "swipe", 0.9, None, 1), 0), image=DENT)
        window.pass_s(1.5)
    assert isinstance(window.screen, TryPage)
    window.make("Play with it")
    assert isinstance(window.app.stage.screen, PlayScreen)


def test_the_questions_come_from_three_examples_on_and_alone_after_five(
    window: Window,
) -> None:
    for count in range(5):
        assert (window.menu.items[0].do is not None) is (count >= 3)
        window.touch()
    window.pass_s(4.0)
    assert isinstance(window.screen, DetailsPage)


def test_the_questions_can_wait(window: Window) -> None:
    touch(window, 5)
    window.choose("Not yet")
    window.pass_s(10.0)
    assert isinstance(window.screen, ExamplesPage)


def test_a_double_tap_is_one_example(window: Window) -> None:
    window.pass_s(0.15, image=DENT)
    window.pass_s(0.2)
    window.pass_s(0.15, image=DENT)
    window.pass_s(1.0)
    assert len(window.sent(ExampleStart)) == len(window.sent(ExampleEnd)) == 1


def test_an_example_is_thrown_away_by_a_click_on_its_picture_or_by_keys(window: Window) -> None:
    touch(window)
    screen = window.screen
    assert isinstance(screen, ExamplesPage)
    place, example = screen._places[1]
    window.click_at(place.center)
    assert window.sent(ExampleDrop) == [ExampleDrop(example.number)]
    assert len(screen.examples) == 2
    window.choose("Throw away")
    assert len(screen.examples) == 1


def test_an_example_that_cannot_be_learned_says_why(window: Window) -> None:
    window.orb.weak = True
    window.touch()
    assert "too weak" in window.menu.notice
    assert window.menu.items[0].value == "0/5"


def test_gestures_take_no_step_while_examples_are_taken(window: Window) -> None:
    before = window.screen.selected
    for name in ("down", "drop", "pause"):
        window.pass_s(0.1, Delivered(Command(name, "press", 0.9, None, 1), 0))
    assert isinstance(window.screen, ExamplesPage)
    assert window.screen.selected == before
    window.pass_s(31.0)  # without a touch the orb steers again
    window.pass_s(0.1, Delivered(Command("pause", "pinch", 0.9, None, 1), 0))
    assert isinstance(window.screen, TeachScreen)


def test_the_trial_counts_what_is_understood_and_what_it_is_taken_for(window: Window) -> None:
    touch(window)
    window.choose("Next")
    window.choose("Learn")
    for label in ("swipe", "swipe", "press", "", "swipe"):
        window.pass_s(0.2, image=DENT)
        if label:
            window.pass_s(0.1, Delivered(Command("hold", label, 0.9, None, 1), 0), image=DENT)
        window.pass_s(1.0)
    assert [row.cells for row in window.menu.table] == [
        ("understood", "3 of 5"),
        ("taken for", "press ×1, nothing ×1"),
        ("older gestures kept", "100 %"),
        ("least: press", "98 %"),
    ]
    assert "waits" in window.menu.notice


def test_a_name_is_typed() -> None:
    window = Window()
    window.choose("Teach")
    window.choose("New gesture")
    window.key(pygame.K_w, pygame.K_a, pygame.K_x, pygame.K_BACKSPACE, pygame.K_MINUS, pygame.K_x)
    window.key(pygame.K_SPACE, pygame.K_y, pygame.K_RETURN)  # a space does not end it
    screen = window.screen
    assert isinstance(screen, ExamplesPage)
    assert screen.plan.label == "wa_x_y"


def test_a_gesture_of_the_same_name_is_taught_anew_only_if_that_is_confirmed() -> None:
    window = Window()
    window.orb.taught["wa"] = "hold"
    window.pass_s(0.1, Connected(WELCOME))
    window.choose("Teach")
    for answer, page in (("No", TeachScreen), ("Yes", ExamplesPage)):
        window.choose("New gesture")
        window.key(pygame.K_w, pygame.K_a, pygame.K_RETURN)
        assert "before" in window.menu.title
        window.choose(answer)
        assert isinstance(window.screen, page)


def test_the_pictures_choose_how_it_may_be_turned(window: Window) -> None:
    touch(window)
    window.choose("Next")
    screen = window.screen
    assert isinstance(screen, DetailsPage)
    half, mirror = screen._pictures[1][0], screen._pictures[3][0]
    window.click_at(half.center)
    window.click_at(mirror.center)
    assert (screen.plan.rotations, screen.plan.mirrored) == ("half", True)


def test_a_taught_gesture_is_removed_when_that_is_confirmed() -> None:
    window = Window()
    window.orb.taught["swipe"] = "hold"
    window.pass_s(0.2, Connected(WELCOME))
    window.choose("Teach")
    for item in ("swipe", "Remove", "Yes"):
        window.choose(item)
    assert window.sent(Forget) == [Forget("swipe")]
    assert "swipe" not in [item.label for item in window.menu.items]
    assert window.menu.notice == "forgotten"


def test_a_lost_link_leaves_the_page_and_the_examples(window: Window) -> None:
    window.touch()
    window.pass_s(1.0, Lost("gone"))
    assert "lost" in window.menu.notice
    window.pass_s(0.2, Connected(WELCOME))
    screen = window.screen
    assert isinstance(screen, ExamplesPage)
    assert window.menu.notice == ""
    assert len(screen.examples) == 1


def test_what_cannot_be_learned_leads_back_to_the_examples(window: Window) -> None:
    touch(window)
    window.orb.objects = True
    window.choose("Next")
    window.choose("Learn")
    screen = window.screen
    assert isinstance(screen, ExamplesPage)
    assert len(screen.examples) == 3
    assert "too different" in window.menu.notice


def test_what_the_examples_suggest_is_chosen_and_one_press_accepts_it(window: Window) -> None:
    window.orb.guess = "half", True
    touch(window)
    window.choose("Next")
    assert [item.value for item in window.menu.items][2:4] == [
        "half turn: same",
        "is the same gesture",
    ]
    window.key(pygame.K_RETURN)
    assert window.sent(Learn) == [Learn("swipe", "hold", "half", True, "")]


def test_more_examples_can_be_taken_after_the_questions(window: Window) -> None:
    touch(window)
    window.choose("Next")
    window.choose("Take more examples")
    screen = window.screen
    assert isinstance(screen, ExamplesPage)
    assert len(screen.examples) == 3


def values(window: Window) -> dict[str, str]:
    return {item.label: item.value for item in window.menu.items if item.value}


def test_a_user_gets_a_command_and_goes_back_to_those_of_all() -> None:
    window = Window()
    window.orb.users = {"ann": {}, "bob": {"pinch": "hold"}}
    window.pass_s(0.2, *(Delivered(each, 0) for each in window.orb.described()))
    window.choose("Teach")
    window.choose("Users")
    assert values(window) == {"ann": "as everybody", "bob": "own commands"}
    window.choose("bob")
    assert values(window)["pinch"] == "hold"
    window.choose("press")
    window.choose("nothing")
    assert window.sent(SetCommand) == [SetCommand("press", "", "bob")]
    assert values(window)["press"] == "nothing"
    window.choose("Use everybody's commands")
    assert window.sent(SetCommand)[1:] == [SetCommand("", "", "bob")]
    assert (values(window)["press"], values(window)["pinch"]) == ("left", "drop")


def test_without_users_the_entry_says_how_to_get_them() -> None:
    window = Window()
    window.choose("Teach")
    entry = window.menu.items[window.number("Users")]
    assert entry.do is None
    assert "knows no people" in entry.hint
