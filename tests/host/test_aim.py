"""Aim: the touched column, the drop by a deeper press, and what takes a touch back."""

import random
from dataclasses import replace

import pytest

from controller.shared.protocol.messages import ContactState
from host.aim import Aim
from tests.support.rise import Rise
from tetris.engine.game import Action, Config, Game

FRAME_S = 1 / 40
FIRM_MM = 9.0


def contact(
    x: float, y: float, depth_mm: float, *, fingers: int = 1, place_sigma: float = 0.0
) -> ContactState:
    return ContactState(0, x, y, place_sigma, depth_mm, fingers=fingers, fingers_sure=1.0)


class Play:
    """A game without gravity, and a finger on the dome."""

    def __init__(self, board: str = "", seed: int = 2) -> None:
        self.game = Game(seed, Config(gravity=False, lock_resets=None, board=board))
        self.game.update(0.0)
        self.aim, self.now_s = Aim(), 0.0
        self.rise = Rise()
        self.done: list[Action] = []

    def hold(
        self,
        seconds: float,
        x: float,
        depth_mm: float = FIRM_MM,
        *,
        y: float = 2.0,
        to_x: float | None = None,
        to_mm: float | None = None,
        fingers: int = 1,
    ) -> None:
        """Hold a finger, or move it evenly to another place and depth."""
        frames = round(seconds / FRAME_S)
        for number in range(1, frames + 1):
            share = number / frames
            here = x + share * ((x if to_x is None else to_x) - x)
            depth = depth_mm + share * ((depth_mm if to_mm is None else to_mm) - depth_mm)
            self.frame(contact(here, y, depth, fingers=fingers))

    def frame(self, touch: ContactState) -> None:
        self.now_s += FRAME_S
        touch = replace(touch, rise_mm=self.rise.of(touch.depth_mm))
        self.take(self.aim.touch(touch, self.now_s, self.game))

    def lift(self, x: float, depth_mm: float = FIRM_MM) -> None:
        self.hold(0.08, x, depth_mm, to_mm=0.5)
        self.frame(ContactState(0))

    def command(self, action: Action, *, located: bool = False) -> None:
        self.take(self.aim.command(action, located, self.now_s, self.game))

    def take(self, actions: list[Action]) -> None:
        self.done += actions
        self.game.update(self.now_s, actions)

    @property
    def columns(self) -> list[int]:
        return sorted({x for x, _ in self.game.piece.cells})


@pytest.mark.parametrize(("x", "columns"), [(0.0, [0, 1, 2]), (2.2, [4, 5, 6]), (4.0, [7, 8, 9])])
def test_the_piece_goes_under_the_finger_at_once_and_stays_when_it_lifts(
    x: float, columns: list[int]
) -> None:
    play = Play()
    play.hold(FRAME_S, x, 2.0)
    assert play.columns == columns
    play.hold(0.5, x)
    play.lift(x)
    assert play.columns == columns
    assert play.game.pieces_placed == 0


@pytest.mark.parametrize("x", [-0.6, 4.7])
def test_beside_the_taxels_is_the_outermost_column(x: float) -> None:
    play = Play()
    play.hold(0.3, x)
    assert (0 if x < 0 else 9) in play.columns


@pytest.mark.parametrize("depth_mm", [3.0, 6.5, 13.0])
def test_a_hand_of_any_strength_drops_by_pressing_deeper(depth_mm: float) -> None:
    play = Play()
    play.hold(0.08, 1.0, 1.0, to_mm=depth_mm)
    play.hold(0.4, 1.0, depth_mm)
    assert play.game.pieces_placed == 0
    play.hold(0.2, 1.0, depth_mm, to_mm=depth_mm + 5.0)
    assert play.done[-1] is Action.HARD_DROP
    play.lift(1.0, depth_mm + 5.0)
    assert play.game.pieces_placed == 1


def test_the_column_is_that_from_before_the_finger_pressed_and_shifted() -> None:
    play = Play()
    play.hold(0.4, 1.0)
    wanted = play.columns
    play.hold(0.15, 1.0, to_x=1.3, to_mm=FIRM_MM + 6.0)
    assert play.game.pieces_placed == 1
    landed = [x for x, mark in enumerate(play.game.board.rows[0]) if mark != "."]
    assert landed == wanted


def test_a_touch_that_dropped_leaves_the_next_piece_alone() -> None:
    play = Play()
    play.hold(0.4, 0.5)
    play.hold(0.1, 0.5, to_mm=FIRM_MM + 5.0)
    entered = play.columns
    play.lift(0.5, FIRM_MM + 5.0)
    assert play.columns == entered
    play.now_s += 0.2
    play.hold(FRAME_S, 0.5, 2.0)
    assert play.columns != entered


def test_a_finger_that_leaves_after_its_drop_does_not_steer_the_next_piece() -> None:
    play = Play()
    play.hold(0.4, 0.5)
    play.hold(0.1, 0.5, to_mm=FIRM_MM + 5.0)
    entered = play.columns
    play.hold(0.125, 0.5, FIRM_MM + 5.0)
    play.hold(0.05, 0.5, FIRM_MM + 5.0, to_mm=FIRM_MM)
    assert play.columns == entered


def test_a_finger_that_dropped_may_be_held_while_frames_are_lost() -> None:
    play = Play()
    play.hold(0.4, 0.5)
    while not play.game.pieces_placed:
        play.hold(FRAME_S, 0.5, FIRM_MM + 5.0)
    play.now_s += 1.0
    play.hold(FRAME_S, 0.5, FIRM_MM + 5.0)
    assert play.game.pieces_placed == 1


@pytest.mark.parametrize("deeper_mm", [0.0, 5.0])
def test_a_touch_goes_on_after_frames_were_lost(deeper_mm: float) -> None:
    play = Play()
    play.hold(0.4, 0.5)
    play.now_s += 1.0  # a busy computer
    play.hold(0.1, 0.5, to_mm=FIRM_MM + deeper_mm)
    assert play.game.pieces_placed == (deeper_mm > 0.0)


def test_an_unsteady_estimate_does_not_move_the_piece_to_and_fro() -> None:
    play, source = Play(), random.Random(1)
    play.hold(0.3, 2.3)  # near the edge between two columns
    before = len(play.done)
    for _ in range(400):
        x, depth = source.gauss(2.3, 0.06), source.gauss(FIRM_MM, 0.6)
        play.frame(contact(x, 2.0, depth, place_sigma=0.06))
    assert len(play.done) - before <= 1
    assert play.game.pieces_placed == 0


def test_from_where_a_finger_settled_its_slides_are_fine_and_in_the_end_full() -> None:
    play = Play()
    play.hold(0.3, 0.6)
    first = play.columns[0]
    play.hold(0.2, 0.6, to_x=1.4)  # two columns' width
    assert play.columns[0] == first + 1
    play.hold(0.2, 1.4, to_x=3.6)  # seven and a half in all
    assert play.columns[0] == first + 7


def test_two_fingers_take_back_where_the_first_one_steered() -> None:
    play = Play()
    entered = play.columns
    play.hold(0.05, 0.5)
    assert play.columns != entered
    play.hold(0.2, 1.5, fingers=2)
    play.frame(ContactState(0))
    assert play.columns == entered
    play.command(Action.HARD_DROP)
    assert play.game.pieces_placed == 1


def test_a_turn_by_two_fingers_is_not_taken_back_when_they_lift() -> None:
    play = Play()
    play.hold(0.2, 1.5, fingers=2)
    play.command(Action.ROTATE_CW)
    turned = play.columns
    play.frame(ContactState(0))
    assert play.columns == turned


def test_several_fingers_that_press_deeper_drop_by_their_gesture_alone() -> None:
    play = Play()
    play.hold(0.4, 1.5, fingers=2)
    play.hold(0.2, 1.5, to_mm=FIRM_MM + 5.0, fingers=2)
    assert play.done == []
    play.command(Action.HARD_DROP)
    assert play.game.pieces_placed == 1


def test_what_may_be_one_finger_steers_and_drops_though_two_are_likelier() -> None:
    """After a twist, the network may believe in two fingers through the next touch."""
    play = Play()
    for depth_mm in [*[FIRM_MM] * 16, *[FIRM_MM + 5.0] * 4]:
        play.frame(replace(contact(0.5, 2.0, depth_mm, fingers=2), fingers_sure=0.7))
    assert [x for x, mark in enumerate(play.game.board.rows[0]) if mark != "."] == [0, 1, 2]


def test_what_are_surely_two_fingers_steers_nothing() -> None:
    play = Play()
    play.hold(0.3, 0.5, fingers=2)
    assert play.done == []


def test_two_fingers_that_drop_beside_the_one_that_aimed_leave_its_column() -> None:
    play = Play()
    play.hold(0.4, 0.5)
    wanted = play.columns
    play.hold(0.1, 0.5, fingers=2)
    play.command(Action.HARD_DROP)
    assert [x for x, mark in enumerate(play.game.board.rows[0]) if mark != "."] == wanted


def test_one_frame_that_shows_two_fingers_ends_no_touch() -> None:
    play = Play()
    play.hold(FRAME_S, 0.5, fingers=2)
    play.hold(0.4, 0.5)
    assert play.columns[0] == 0
    play.hold(0.1, 0.5, to_mm=FIRM_MM + 5.0)
    assert play.game.pieces_placed == 1


@pytest.mark.parametrize("least_mm", [1.0, 4.0])
def test_a_finger_that_leaves_for_a_moment_is_another_touch(least_mm: float) -> None:
    """The sensor takes longer to be at rest than a finger to come back."""
    play = Play()
    play.hold(0.4, 0.5)
    play.hold(0.05, 0.5, to_mm=least_mm)
    play.hold(0.05, 3.5, least_mm, to_mm=FIRM_MM)
    play.hold(0.2, 3.5)
    assert play.columns == [7, 8, 9]


@pytest.mark.parametrize(("x", "inward"), [(-0.8, 0.4), (4.8, 3.6)])
def test_a_slide_from_the_rim_drops_nothing_though_it_is_felt_deeper_there(
    x: float, inward: float
) -> None:
    play = Play()
    play.hold(0.4, x, 5.0)
    play.hold(0.1, x, 5.0, to_mm=8.0)  # the place is seen late
    play.hold(0.1, x, 8.0, to_x=inward, to_mm=6.0)
    play.hold(0.3, inward, 6.0)
    assert play.game.pieces_placed == 0
    play.hold(0.1, inward, 6.0, to_mm=11.0)
    assert play.game.pieces_placed == 1


def test_a_slide_that_has_just_left_the_rim_drops_nothing_either() -> None:
    play = Play()
    play.hold(0.4, -0.35, 5.0)
    play.hold(0.075, -0.35, 5.0, to_x=-0.25, to_mm=9.0)
    play.hold(0.1, -0.25, 9.0, to_x=1.0, to_mm=6.0)
    play.hold(0.3, 1.0, 6.0)
    assert play.game.pieces_placed == 0


def test_a_press_on_the_rim_drops() -> None:
    play = Play()
    play.hold(0.4, 4.6, 5.0)
    play.hold(0.1, 4.6, 5.0, to_mm=10.0)
    play.hold(0.1, 4.6, 10.0)
    assert play.game.pieces_placed == 1


def test_the_rim_is_the_edge_wherever_the_finger_has_settled() -> None:
    play, x = Play(), 0.6
    play.hold(0.4, x)
    for there in (1.4, 2.2, 3.0, 3.8):  # fine slides: the piece is left behind
        play.hold(0.15, x, to_x=there)
        play.hold(0.3, there)
        x = there
    assert max(play.columns) < 8
    play.hold(2 * FRAME_S, 4.4)  # so far out the end of a slide may look for a moment
    assert max(play.columns) < 8
    play.hold(2 * FRAME_S, 4.4)
    assert 9 in play.columns


def test_a_slide_from_outside_the_dome_counts_from_its_rim() -> None:
    farther, rim = Play(), Play()
    for play, x in ((farther, -1.0), (rim, -0.5)):
        play.hold(0.4, x)
        play.hold(0.15, x, to_x=0.7)
        play.hold(0.2, 0.7)
    assert farther.columns == rim.columns


def test_a_slide_is_followed_though_it_is_felt_deeper() -> None:
    play = Play()
    play.hold(0.4, 0.6, 5.0)
    before = max(play.columns)
    play.hold(0.1, 0.6, 5.0, to_x=1.8, to_mm=8.0)
    assert max(play.columns) > before
    assert play.game.pieces_placed == 0


def test_a_slide_and_a_lift_drop_nothing() -> None:
    play = Play()
    play.hold(0.4, 0.5)
    play.hold(0.15, 0.5, to_x=2.0, to_mm=FIRM_MM + 1.5)
    play.hold(0.3, 2.0, FIRM_MM + 1.5)
    play.lift(2.0)
    assert play.game.pieces_placed == 0


def test_a_gesture_whose_fingers_were_taken_for_one_is_taken_back_too() -> None:
    play = Play()
    play.hold(0.2, 3.0)
    play.lift(3.0)
    aimed = play.columns
    play.now_s += 1.0
    play.hold(0.1, 2.0)  # really a twist about the middle
    play.command(Action.ROTATE_CW)
    assert play.done[-1] is Action.ROTATE_CW
    assert set(play.columns) <= set(aimed)


@pytest.mark.parametrize("action", [Action.ROTATE_CW, Action.HARD_DROP])
def test_a_gesture_of_several_fingers_is_none_where_there_surely_is_one(action: Action) -> None:
    play = Play()
    play.hold(0.4, 1.0)
    play.hold(0.15, 1.0, to_x=3.0)  # a quick slide may look like another gesture
    play.command(action)
    assert action not in play.done
    play.hold(0.2, 3.0)
    play.hold(0.1, 3.0, to_mm=FIRM_MM + 5.0)
    assert play.done[-1] is Action.HARD_DROP


def test_a_drop_by_depth_is_not_repeated_by_a_pinch_recognised_in_it() -> None:
    play = Play()
    play.hold(0.4, 2.0)
    play.hold(0.1, 2.0, to_mm=FIRM_MM + 5.0)
    play.command(Action.HARD_DROP)
    assert play.game.pieces_placed == 1
    play.lift(2.0)
    play.now_s += 1.0
    play.command(Action.HARD_DROP)
    assert play.game.pieces_placed == 2


def test_commands_of_a_press_do_nothing() -> None:
    play = Play()
    for action in (Action.LEFT, Action.DOWN):
        play.command(action, located=True)
    assert play.done == []


@pytest.mark.parametrize("seconds", [0.08, 0.6])
def test_a_touch_above_the_last_row_holds_once_and_does_not_steer(seconds: float) -> None:
    play = Play()
    play.hold(seconds, 0.5, y=4.5)
    play.frame(ContactState(0))
    assert play.done == [Action.HOLD]


def test_two_fingers_above_the_last_row_hold_nothing() -> None:
    play = Play()
    play.hold(0.6, 0.5, y=4.5, fingers=2)
    play.frame(ContactState(0))
    assert play.done == []


def test_a_frame_that_shows_two_fingers_does_not_lose_the_hold() -> None:
    play = Play()
    play.hold(0.15, 0.5, y=4.5)
    play.hold(FRAME_S, 0.5, y=4.5, fingers=2)  # the one in which the touch has settled
    play.hold(0.2, 0.5, y=4.5)
    play.frame(ContactState(0))
    assert play.done == [Action.HOLD]


def test_a_wall_of_blocks_ends_the_way() -> None:
    play = Play(board="\n".join([".#........"] * 20))
    play.hold(0.3, 0.0)
    assert play.columns[0] == 2
    play.hold(0.15, 0.0, to_mm=FIRM_MM + 5.0)
    assert play.game.board.rows[0][2] != "."
    assert play.game.pieces_placed == 1
