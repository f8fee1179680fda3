"""Teach in the application, with a fake orb that answers its requests."""

import pygame
import pytest

from controller.shared.protocol.messages import Command, ContactState
from controller.shared.protocol.teaching import (
    ExampleDrop,
    ExampleEnd,
    ExampleStart,
    Forget,
    Learn,
    SetCommand,
    SetWaiting,
)
from host.app.screens.teach.gesture import GesturePage
from host.app.screens.teach.page import NamePage
from host.app.screens.teach.screen import TeachScreen
from host.connection.receiver import Connected, Delivered, Lost, Stale
from tests.support.app_window import WELCOME
from tests.support.teaching_window import DENT, Window
from tetris.window.play_screen import PlayScreen


@pytest.fixture
def window() -> Window:
    """Return the application on the page of the examples of a swipe."""
    window = Window()
    for item in ("Teach", "New gesture", "swipe"):
        window.choose(item)
    assert isinstance(window.screen, GesturePage)
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
        ("swipe", GesturePage),
    ]:
        take(item)
        assert isinstance(window.screen, page)
    assert window.menu.items[0].do is None  # three examples are the least
    touch(window)
    take("Learn")
    assert window.sent(Learn) == [Learn("swipe", "hold", "none", False, "")]
    take("Play with it")
    assert isinstance(window.app.stage.screen, PlayScreen)


def test_a_mouse_is_not_asked_for_gestures_of_several_fingers() -> None:
    window = Window()
    for item in ("Teach", "New gesture"):
        window.choose(item)
    assert not {"squeeze", "knock"} & {item.label for item in window.menu.items}


def test_the_mouse_presses_as_lightly_as_in_the_game_that_follows(window: Window) -> None:
    window.pass_s(0.1, Delivered(ContactState(1), 0))  # the orb can play by Aim
    assert window.app.touch.light
    window.choose("Back")
    assert not window.app.touch.light


def test_a_double_tap_is_one_example(window: Window) -> None:
    window.pass_s(0.15, image=DENT)
    window.pass_s(0.2)
    window.pass_s(0.15, image=DENT)
    window.pass_s(1.0)
    assert len(window.sent(ExampleStart)) == len(window.sent(ExampleEnd)) == 1


def test_an_example_is_thrown_away_by_a_click_on_its_picture_or_by_keys(window: Window) -> None:
    touch(window)
    screen = window.screen
    assert isinstance(screen, GesturePage)
    example = screen.examples[1]
    window.click_at(screen._places[1][0].center)
    assert window.sent(ExampleDrop) == [ExampleDrop(example.number)]
    assert len(screen.examples) == 2
    window.choose("Throw away")
    assert len(screen.examples) == 1


def test_an_example_that_cannot_be_learned_says_why(window: Window) -> None:
    window.orb.weak = True
    window.touch()
    assert "too weak" in window.menu.notice
    assert window.menu.items[0].value == "0/5"


def understood(window: Window, label: str) -> None:
    """Touch the dome; it is taken for a gesture."""
    window.pass_s(0.2, image=DENT)
    window.pass_s(0.1, *[Delivered(Command("hold", label, 0.9, None, 1), 0)] * bool(label))
    window.pass_s(1.5)


def test_an_example_that_looks_like_another_gesture_is_questioned(window: Window) -> None:
    screen = window.screen
    assert isinstance(screen, GesturePage)
    touch(window)
    understood(window, "press")
    assert screen.doubt
    assert screen._cue() == "Looks like press. Keep it?"
    window.choose("Throw it away")
    assert [len(screen.examples), screen.doubt] == [3, None]
    understood(window, "press")
    window.choose("Keep it")
    understood(window, "press")  # as one that was kept
    assert [len(screen.examples), screen.doubt] == [5, None]


def test_no_gesture_is_a_step_or_ends_the_trial(window: Window) -> None:
    screen = window.screen
    assert isinstance(screen, GesturePage)
    touch(window)
    window.choose("Learn")
    for name in ("down", "drop", "pause") * 3:
        window.pass_s(0.1, Delivered(Command(name, "press", 0.9, None, 1), 0))
    assert (window.screen, screen.mode, screen.selected) == (screen, "trial", 0)
    window.choose("End the trial")
    assert screen.mode == "examples"


def test_the_trial_shows_what_was_meant_and_understood(window: Window) -> None:
    screen = window.screen
    assert isinstance(screen, GesturePage)
    touch(window)
    window.choose("Learn")
    for label in ("swipe", "press", ""):
        understood(window, label)
    assert screen.trial.heard == [("swipe", "swipe"), ("swipe", "press"), ("swipe", "")]
    assert screen._cue() == "swipe: 1 of 3 understood"
    window.choose("Meant")  # the next gesture of the orb, which is the first one
    understood(window, "press")
    assert screen.trial.heard[-1] == ("press", "press")
    assert "waits" in str(screen.lessons.status)


def test_what_a_lesson_costs_is_shown_and_waiting_is_a_choice(window: Window) -> None:
    screen = window.screen
    assert isinstance(screen, GesturePage)
    touch(window)
    window.choose("Learn")
    press, swipe = screen.costs
    assert screen._cost(press) == ["20 of 20", "0.25 s later"]
    window.choose("Others wait")
    assert window.sent(SetWaiting) == [SetWaiting("swipe", False)]
    assert screen._cost(press) == ["20 of 20"]
    assert screen._cost(swipe) == ["6 of 20"]


def test_a_name_is_typed() -> None:
    window = Window()
    window.choose("Teach")
    window.choose("New gesture")
    window.key(pygame.K_w, pygame.K_a, pygame.K_x, pygame.K_BACKSPACE, pygame.K_MINUS, pygame.K_x)
    window.key(pygame.K_SPACE, pygame.K_y, pygame.K_RETURN)  # a space does not end it
    screen = window.screen
    assert isinstance(screen, GesturePage)
    assert screen.plan.label == "wa_x_y"
    assert window.menu.title == "wa x y"


def test_a_gesture_of_the_same_name_is_taught_anew_only_if_that_is_confirmed() -> None:
    window = Window()
    window.orb.taught["wa"] = "hold"
    window.pass_s(0.1, Connected(WELCOME))
    window.choose("Teach")
    for answer, page in (("No", TeachScreen), ("Yes", GesturePage)):
        window.choose("New gesture")
        window.key(pygame.K_w, pygame.K_a, pygame.K_RETURN)
        assert "before" in window.menu.title
        assert [item.label for item in window.menu.items] == ["No", "Yes"]
        window.choose(answer)
        assert isinstance(window.screen, page)


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
    assert isinstance(screen, GesturePage)
    assert window.menu.notice == ""
    assert len(screen.examples) == 1


def test_learning_goes_on_while_the_orb_is_silent_but_not_in_another(window: Window) -> None:
    touch(window)
    screen = window.screen
    assert isinstance(screen, GesturePage)
    screen._learn()
    window.app.tick(window.now_s, [Stale()])
    assert window.menu.items[0].label == "Learning"
    window.orb.taught.clear()
    window.app.tick(window.now_s, [Connected(WELCOME)])
    window.app.tick(window.now_s, [Delivered(each, 0) for each in window.orb.described()])
    assert window.menu.items[0].label == "Learn"


def test_what_cannot_be_learned_leads_back_to_the_examples(window: Window) -> None:
    touch(window)
    window.orb.objects = True
    window.choose("Learn")
    screen = window.screen
    assert isinstance(screen, GesturePage)
    assert (screen.mode, len(screen.examples)) == ("examples", 3)
    assert "too different" in window.menu.notice


def test_what_the_examples_suggest_is_chosen_until_it_is_changed(window: Window) -> None:
    window.orb.guess = "half", True
    touch(window)
    assert {"half turn: same", "same"} < set(values(window).values())
    window.choose("Mirrored")
    touch(window)
    window.choose("Learn")
    assert window.sent(Learn) == [Learn("swipe", "hold", "half", False, "")]


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


def test_without_users_the_entry_says_so() -> None:
    window = Window()
    window.choose("Teach")
    entry = window.menu.items[window.number("Users")]
    assert entry.do is None
    assert "knows no people" in entry.hint
