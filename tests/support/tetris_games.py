"""Games to begin a test with, what happened in them, and what hypothesis makes of them."""

from typing import TypeVar

from hypothesis import strategies as st

from tetris.engine.board import Board
from tetris.engine.game import Action, Config, Event, Game, Gravity, Input
from tetris.engine.moves import TABLES
from tetris.engine.pieces import Kicks, Piece

EventT = TypeVar("EventT", bound=Event)


def game_with(picture: str, piece: Piece, config: Config | None = None) -> Game:
    game = Game(seed=1, config=config)
    set_up(game, Board.parse(picture), piece)
    game.update(0.0)
    return game


def set_up(game: Game, board: Board, piece: Piece) -> None:
    """Go on from another position, with a piece that has just come there."""
    game.board = board
    game.put(piece)


def rotated(
    bits: int, piece: Piece, action: Action = Action.ROTATE_CW, kicks: Kicks = "srs"
) -> tuple[Piece, int] | None:
    """Return the piece after a quarter turn, and the kick that made it fit, or None."""
    turns = piece.turned[TABLES[kicks] + (action is Action.ROTATE_CCW)]
    return next(((there, kick) for kick, there in enumerate(turns) if not bits & there.mask), None)


def of(events: list[Event], kind: type[EventT]) -> list[EventT]:
    return [event for event in events if isinstance(event, kind)]


given_inputs = st.one_of(
    st.sampled_from(Action),
    st.builds(Gravity, st.integers(1, 9_999_999)),
)
Step = tuple[int, list[Input], bool, list[Action]]
scripts: st.SearchStrategy[list[Step]] = st.lists(
    st.tuples(
        st.integers(0, 1500),  # milliseconds since the input before
        st.lists(given_inputs, max_size=4),
        st.booleans(),  # soft drop from here on
        st.lists(st.sampled_from([Action.ROTATE_CW, Action.ROTATE_CCW, Action.HOLD]), max_size=2),
    ),
    max_size=25,
)
configs: st.SearchStrategy[Config] = st.builds(
    Config,
    start_level=st.integers(1, 20),
    lock_resets=st.sampled_from([0, 3, 15, None]),
    gravity=st.booleans(),
    generation_delay_s=st.sampled_from([0.0, 0.2]),
    guard_s=st.sampled_from([0.0, 0.3]),
    time_limit_s=st.sampled_from([None, 20.0]),
    lines_goal=st.sampled_from([None, 1]),
    board=st.sampled_from(["", ".##.##\n.#####"]),
    undo=st.booleans(),
    randomiser=st.sampled_from(["7-bag", "uniform"]),
    columns=st.just(6),
)
