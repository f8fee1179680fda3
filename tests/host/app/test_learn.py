"""The introduction: steps from the orb's own gestures; only the right gesture goes on."""

import math
import os
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import pygame

from controller.shared.protocol.messages import Command
from controller.shared.protocol.teaching import CommandRule, GestureInfo, Vocabulary
from host.app.screens.learn import LearnScreen, Step, steps
from host.connection.receiver import Delivered, Lost
from host.ui.pointer_input import DomeArea
from tests.support.app_window import FELT, LABELS, Finger, Window, shipped_gestures

PAD = DomeArea()
FREE = (math.inf, -math.inf, math.inf, -math.inf)  # no bound: left_of, right_of, below, above
ON_S = 1.8  # after which a step that went well has made room for the next one


def info(label: str, *rules: CommandRule, say: str = "") -> GestureInfo:
    return GestureInfo(label, say or label, False, 0, b"", rules)


def made(label: str, command: str) -> Delivered:
    return Delivered(Command(command, label, 0.99, None, 1), 0)


def test_the_steps_of_the_shipped_mapping_press_three_places_pinch_and_twist() -> None:
    found = steps(shipped_gestures(), PAD)
    assert [(step.label, step.command) for step in found] == [
        ("press", "left"),
        ("press", "right"),
        ("press", "down"),
        ("pinch", "drop"),
        ("twist_cw", "rotate_cw"),
    ]
    assert [step.side(PAD) for step in found] == ["left", "right", "low", "middle", "middle"]
    assert [step.located for step in found] == [True, True, True, False, False]


def test_the_steps_of_a_described_orb_are_its_gestures_at_places_of_its_mapping() -> None:
    high = CommandRule("down", *FREE[:3], 2.5)
    infos = [
        info("press", high, CommandRule("rotate_cw", *FREE)),
        info("knock", CommandRule("hold", *FREE), say="knock on it"),
        info("pinch", CommandRule("pause", *FREE)),  # which a piece cannot show
        info("wave"),
    ]
    found = steps(infos, PAD)
    assert [(s.label, s.command, s.side(PAD), s.say) for s in found] == [
        ("press", "down", "high", "press"),
        ("press", "rotate_cw", "low", "press"),
        ("knock", "hold", "middle", "knock on it"),
    ]


def test_a_rule_that_others_leave_no_room_is_no_step() -> None:
    left = CommandRule("left", 3.0, *FREE[1:])
    hidden = CommandRule("right", 2.0, *FREE[1:])
    found = steps([info("press", left, hidden)], PAD)
    assert [step.command for step in found] == ["left"]


class Pupil(Window):
    """A window that shows the introduction to one of the controls."""

    def __init__(self, control: str = "buttons") -> None:
        super().__init__()
        stage = self.app.stage
        stage.change(replace(stage.settings, control=control))
        self.pass_s(0.1, FELT)
        self.learn = LearnScreen(self.app.stage, self.app)
        self.app.stage.push(self.learn)
        self.pass_s(0.1)

    @property
    def step(self) -> Step:
        assert self.learn.step
        return self.learn.step

    @property
    def said(self) -> str:
        """All that stands beside the board."""
        return " ".join(line.text for line in self.learn.lines(self.now_s))


def test_the_right_gesture_moves_the_piece_and_goes_on_by_itself() -> None:
    pupil = Pupil()
    x = pupil.learn.game.piece.x
    assert pupil.step.command == "left"
    pupil.pass_s(0.1, made("press", "left"))
    assert pupil.learn.game.piece.x == x - 1
    assert "The piece moved left" in pupil.said
    pupil.pass_s(ON_S)
    assert pupil.step.command == "right"


def test_a_wrong_gesture_acts_too_and_is_named_but_does_not_go_on() -> None:
    pupil = Pupil()
    x = pupil.learn.game.piece.x
    pupil.pass_s(0.1, made("press", "right"))
    assert pupil.learn.game.piece.x == x + 1
    assert "for “right”. Aim at the left side" in pupil.said
    pupil.pass_s(0.1, made("twist_cw", "rotate_cw"))
    assert "understood as twist right" in pupil.said
    pupil.pass_s(ON_S)
    assert pupil.step.command == "left"


def test_all_steps_lead_to_the_end_where_the_orb_steers_the_menu_again() -> None:
    pupil = Pupil()
    for step in pupil.learn.steps:
        assert pupil.step is step
        assert pupil.app.zones == (step.label == "press")
        pupil.pass_s(ON_S, made(step.label, step.command))
    assert pupil.learn.step is None
    pupil.pass_s(1.0)  # in which the last gesture may still be held
    pupil.pass_s(0.1, made("pinch", "drop"))
    assert pupil.app.stage.screen is not pupil.learn


def test_a_ghost_shows_the_gesture_until_the_player_touches() -> None:
    pupil = Pupil()
    pupil.pass_s(0.8)
    assert [(one.x, one.y) for one in pupil.app.ghost] == [pupil.step.place]
    pupil.app.touch.press(*PAD.centre, pupil.now_s)
    pupil.app.outgoing(pupil.now_s)
    pupil.pass_s(0.1)
    assert pupil.app.ghost == ()


def test_after_some_seconds_there_is_a_further_hint() -> None:
    pupil = Pupil()
    assert "a little longer" not in pupil.said
    pupil.pass_s(9.0)
    assert "a little longer" in pupil.said


def test_enter_takes_the_next_step_and_escape_leaves_without_a_trace() -> None:
    pupil = Pupil()
    pupil.key(pygame.K_RETURN)
    assert pupil.step.command == "right"
    pupil.pass_s(1.0)
    assert pupil.app.ghost
    pupil.key(pygame.K_ESCAPE)
    assert pupil.app.stage.screen is not pupil.learn
    assert (pupil.app.ghost, pupil.app.zones) == ((), False)


def test_a_described_orb_is_taught_by_its_own_mapping() -> None:
    pupil = Pupil()
    infos = [info(label) for label in LABELS[1:-1]]
    infos.append(info("twist_ccw", CommandRule("hold", *FREE)))
    said = [Vocabulary(LABELS, ("hold",), "", False, 0, ""), *infos]
    pupil.pass_s(0.1, *(Delivered(message, 0) for message in said))
    assert [(step.label, step.command) for step in pupil.learn.steps] == [("twist_ccw", "hold")]


def test_it_waits_for_the_orb_and_says_when_it_is_lost() -> None:
    pupil = Pupil()
    pupil.pass_s(0.1, Lost("the cable is out"))
    assert "link to the orb is lost" in pupil.said


def test_the_words_are_others_for_a_mouse_a_touch_screen_and_a_hand() -> None:
    pupil = Pupil()
    assert "Click the left side" in pupil.said
    pupil.app.handle(pygame.event.Event(pygame.FINGERDOWN, x=0.1, y=0.3, finger_id=1), 0.0)
    pupil.pass_s(0.1)
    assert "Tap the left side" in pupil.said


def test_where_a_touch_points_at_a_column_the_steps_are_its_touches() -> None:
    """Each is taken from what it does in the game, the twist from its command."""
    pupil = Pupil("aim")
    finger, twist = Finger(pupil), made("twist_cw", "rotate_cw")
    done = []
    while step := pupil.learn.step:
        done.append((step.label, step.command))
        if step.label == "twist_cw":
            pupil.pass_s(0.1, twist)
        else:
            x, y = step.place
            finger.hold(0.4, x, 8.0, y)
            if step.label == "deeper":
                assert not pupil.learn.game.pieces_placed
                finger.hold(0.2, x, 13.0, y)
            finger.lift()
        pupil.pass_s(ON_S)
    touches = [("touch", "point"), ("twist_cw", "rotate_cw"), ("deeper", "drop"), ("press", "hold")]
    assert done == touches
    game = pupil.learn.game
    assert (game.pieces_placed, game.hold is None) == (1, False)


def test_an_orb_without_contacts_is_taught_by_its_presses_where_pointing_is_chosen() -> None:
    pupil = Pupil("aim")
    assert "Hold the left button on a column" in pupil.said
    assert pupil.app.orb.columns
    pupil.pass_s(0.1, made("press", "left"))
    pupil.pass_s(0.1)
    assert "Click the left side" in pupil.said
    assert pupil.app.orb.columns is None


def test_fingers_on_a_screen_close_to_drop_since_they_press_no_deeper() -> None:
    pupil = Pupil("aim")
    pupil.app.screen_touched = True
    pupil.learn.number = [step.label for step in pupil.learn.steps].index("deeper")
    pupil.pass_s(0.8)
    assert "Close two fingers" in pupil.said
    assert len(pupil.app.ghost) == 2


def test_the_first_start_offers_it_once(tmp_path: Path) -> None:
    first = Window(config=tmp_path)
    screen = first.app.stage.screen
    assert isinstance(screen, LearnScreen)
    first.pass_s(0.1, made("press", "down"), made("pinch", "drop"))  # the orb chooses "Later"
    assert not isinstance(first.app.stage.screen, LearnScreen)
    assert not isinstance(Window(config=tmp_path).app.stage.screen, LearnScreen)


def test_without_figures_there_is_no_card_for_them() -> None:
    pupil = Pupil()
    view = pupil.learn._game_view
    assert view is not None
    assert view.layout.stats.size == (0, 0)
