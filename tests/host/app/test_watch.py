"""The demo in the window: it is judged by what the hand meant, and can be taken over."""

from dataclasses import replace

import pygame

from controller.shared.protocol.messages import Command, GroundTruth, Perform
from host.app.screens.watch import WatchScreen
from host.connection.receiver import Connected, Delivered, Lost
from tests.support.app_window import FELT, WELCOME, Window
from tetris.engine.game import Phase
from tetris.window.play_screen import PlayScreen


class Watching(Window):
    """A window that shows the demo, and the orb at the other end."""

    def __init__(self) -> None:
        super().__init__()
        self.pass_s(0.1, FELT)
        self.watch = WatchScreen(self.app.stage, self.app, self.app.game.flow.go_on)
        self.app.stage.push(self.watch)

    def wished(self) -> Perform:
        """Return what the hand is asked to do next."""
        for _ in range(200):
            self.pass_s(1 / 60)
            for message in self.app.outgoing(self.now_s):
                if isinstance(message, Perform):
                    return message
        raise AssertionError("the hand has nothing to do")

    def answer(self, name: str) -> None:
        self.pass_s(0.3, Delivered(Command(name, "press", 0.99, None, 1), 0))

    def end(self, performance: Perform) -> None:
        """Let the hand leave the dome, by a clock of the orb's own."""
        truth = GroundTruth(performance.number, performance.label, 70_000, 70_900)
        self.pass_s(0.1, Delivered(truth, 0))


def test_the_hand_plays_and_what_was_understood_is_judged_by_what_it_meant() -> None:
    window = Watching()
    watch, meant = window.watch, window.watch.record.meant
    first = window.wished()
    window.answer(meant[first.number])
    window.end(first)
    assert (watch.score.intended, watch.score.hits, watch.score.missed) == (1, 1, 0)
    second = window.wished()
    window.answer("pause")  # which no hand means
    window.end(second)
    third = window.wished()
    window.end(third)
    assert (watch.score.intended, watch.score.hits) == (3, 1)
    assert (watch.score.wrong, watch.score.missed) == (1, 2)
    said = " ".join(line.text for line in watch.lines(window.now_s))
    assert "1 of 3 understood" in said
    assert watch.game.phase is Phase.RUNNING


def test_only_recognised_commands_move_the_piece() -> None:
    window = Watching()
    window.wished()
    x = window.watch.game.piece.x
    window.pass_s(1.0)
    assert window.watch.game.piece.x == x
    window.answer("left")
    assert window.watch.game.piece.x == x - 1


def test_a_touch_of_the_dome_takes_the_same_game_over_and_stops_the_hand() -> None:
    window = Watching()
    window.wished()
    window.answer("drop")
    window.app.touch.press(2.0, 2.0, window.now_s)
    window.app.outgoing(window.now_s)
    window.pass_s(0.1)
    screen = window.app.stage.screen
    assert isinstance(screen, PlayScreen)
    assert window.game.pieces_placed == 1
    assert not screen.session.ranked
    sent = [each for each in window.app.outgoing(window.now_s) if isinstance(each, Perform)]
    assert [each.label for each in sent] == [""]


def test_the_pinch_that_opens_the_demo_does_not_take_it_over() -> None:
    window = Watching()
    window.app.touch.press(2.0, 2.0, window.now_s, pinch=True)
    window.app.outgoing(window.now_s)
    window.pass_s(0.3)
    assert window.app.stage.screen is window.watch
    window.app.touch.release()
    assert window.wished().label


def test_leaving_stops_the_hand_and_its_last_gesture_steers_no_menu() -> None:
    window = Watching()
    window.wished()
    window.key(pygame.K_ESCAPE)
    sent = [each for each in window.app.outgoing(window.now_s) if isinstance(each, Perform)]
    assert [each.label for each in sent] == [""]
    title = window.app.stage.screen
    window.answer("drop")
    assert window.app.stage.screen is title
    window.pass_s(1.0)
    window.answer("drop")
    assert window.app.stage.screen is not title


def test_a_lost_link_stops_the_game_until_the_orb_is_back() -> None:
    window = Watching()
    window.wished()
    window.pass_s(0.1, Lost("the cable is out"))
    time_s = window.watch.game.time_s
    window.pass_s(5.0)
    assert window.watch.game.time_s == time_s
    assert "away" in " ".join(line.text for line in window.watch.lines(window.now_s))
    window.pass_s(0.1, Connected(replace(WELCOME)), FELT)
    assert window.wished().number == 1  # another connection, another hand


def test_the_panel_and_the_board_say_that_it_is_a_demo() -> None:
    window = Watching()
    window.pass_s(0.1)
    assert "Demo" in window.app.note
    window.key(pygame.K_ESCAPE)
    assert window.app.note == ""


def test_a_game_that_has_not_begun_can_be_taken_over() -> None:
    window = Watching()
    take_over = window.watch.menu.items[0].do
    assert take_over
    take_over()
    window.pass_s(1.5)
    assert isinstance(window.app.stage.screen, PlayScreen)
    assert window.game.phase is Phase.RUNNING
