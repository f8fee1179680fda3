"""The bot: what it values, what it can reach, and that it keeps playing."""

import pytest

from tetris.bots import features, greedy
from tetris.engine.board import Board
from tetris.engine.events import Locked
from tetris.engine.game import Action, Config, Game, Phase
from tetris.engine.pieces import Piece


def test_an_upright_i_goes_into_a_well_and_clears_four_rows() -> None:
    game = Game(seed=1)
    game.set_up(Board.parse("JJJJJJJJJ.\n" * 4), Piece("I", 3, 17))
    plan = greedy.plan(game)
    assert set(plan.landing.cells) == {(9, y) for y in range(4)}
    game.update(0.0, plan.actions)
    assert game.lines == 4


def test_every_landing_is_reached_by_its_actions() -> None:
    board = Board.parse("""
        J.........
        JJ....LLSS
        ZZOO..LLSS
    """)
    for kind in "IOTSZJL":
        entering = Piece.entering(kind)  # type: ignore[arg-type]
        found = greedy.landings(board.bits, entering)
        for landing, actions in found:
            game = Game(seed=1)
            game.set_up(Board.parse(str(board)), entering)
            (locked,) = [event for event in game.update(0.0, actions) if isinstance(event, Locked)]
            assert set(locked.piece.cells) == set(landing.cells)
        assert len(found) == {"I": 17, "O": 9, "S": 17, "Z": 17}.get(kind, 34)


def test_three_turns_are_one_turn_the_other_way() -> None:
    for _, actions in greedy.landings(Board().bits, Piece.entering("T")):
        turns = [a for a in actions if a in (Action.ROTATE_CW, Action.ROTATE_CCW)]
        assert len(turns) <= 2


def test_surface_counts_transitions_holes_and_wells() -> None:
    surface = features.surface()
    assert surface(Board().bits) == -24 * 2 - 10  # 24 empty rows, 10 columns on the floor
    flat = Board.parse("IIIIIIIII.")
    assert surface(flat.bits) == -23 * 2 - 2 - 10 - 1  # one well cell
    covered = Board.parse("""
        .........I
        IIIIIIIII.
    """)
    # 22 empty rows and two with one gap, 9 + 3 changes down the columns, a hole, a well
    assert surface(covered.bits) == -22 * 2 - 2 - 2 - 9 - 3 - 4 - 1


def test_a_dear_command_makes_a_near_landing_win() -> None:
    game = Game(seed=1)
    game.set_up(Board(), Piece("O", 4, 18))
    assert len(greedy.plan(game).actions) > 2
    assert greedy.plan(game, command_cost=50.0).actions == (Action.HARD_DROP,)


def test_an_earlier_target_is_kept_while_it_can_be_reached() -> None:
    game = Game(seed=1)
    game.set_up(Board(), Piece("O", 4, 18))
    target = Piece("O", 7, 0)
    plan = greedy.plan(game, target=target)
    assert plan.landing == target
    assert plan.actions == (Action.RIGHT,) * 3 + (Action.HARD_DROP,)


def test_a_target_out_of_reach_is_given_up() -> None:
    game = Game(seed=1)
    game.set_up(Board(), Piece("O", 4, 18))
    assert greedy.plan(game, target=Piece("O", 7, 5)).landing.y == 0


@pytest.mark.parametrize("command_cost", [0.0, 1.0])
def test_asked_again_after_every_command_it_keeps_its_mind(command_cost: float) -> None:
    game = Game(seed=11, config=Config(start_level=3, gravity_cap=3))
    now_s, earlier = 0.0, None
    while game.pieces_placed < 30:
        plan = greedy.plan(game, command_cost=command_cost)
        assert earlier is None or set(plan.landing.cells) == set(earlier.cells)
        now_s += 1.2  # a gesture; the piece has fallen meanwhile
        events = game.update(now_s, plan.actions[:1])
        locked = any(isinstance(event, Locked) for event in events)
        earlier = None if locked else plan.landing


def test_it_plays_on_without_end_in_sight() -> None:
    game = Game(seed=1)
    while game.pieces_placed < 300:
        game.update(0.0, greedy.plan(game).actions)
    assert game.phase is Phase.RUNNING
    assert game.lines > 110
    assert game.board.height < 10


def test_the_same_game_is_played_twice_alike() -> None:
    def play() -> tuple[str, int]:
        game = Game(seed=8)
        for _ in range(60):
            game.update(0.0, greedy.plan(game).actions)
        return str(game.board), game.score

    assert play() == play()


def test_a_game_that_is_over_cannot_be_planned() -> None:
    game = Game(seed=1)
    while game.phase is Phase.RUNNING:
        game.update(0.0, [Action.HARD_DROP])
    with pytest.raises(ValueError, match="the game is over"):
        greedy.plan(game)
