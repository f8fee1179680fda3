"""Games to begin a test with, and what happened in them."""

from typing import TypeVar

from tetris.board import Board
from tetris.engine import Config, Event, Game
from tetris.pieces import Piece

EventT = TypeVar("EventT", bound=Event)


def game_with(picture: str, piece: Piece, config: Config | None = None) -> Game:
    game = Game(seed=1, config=config)
    game.set_up(Board.parse(picture), piece)
    game.update(0.0)
    return game


def of(events: list[Event], kind: type[EventT]) -> list[EventT]:
    return [event for event in events if isinstance(event, kind)]
