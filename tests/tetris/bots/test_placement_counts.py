"""Counts of placements, as others count them."""

from tests.benchmarks.perft import boards, leaves
from tetris.bots.placements import find
from tetris.engine.board import Board
from tetris.engine.game import Config, Game
from tetris.engine.pieces import Kind, Piece


def test_the_first_pieces_alone_have_their_known_numbers_of_places() -> None:
    known: dict[Kind, int] = {"I": 17, "O": 9, "L": 34, "J": 34, "S": 17, "Z": 17, "T": 34}
    assert {kind: leaves([kind]) for kind in known} == known


def test_on_a_high_stack_a_piece_enters_as_in_the_game() -> None:
    stack = "JJJ.......\n" * 20
    game = Game(1, Config(board=stack))
    game.update(0.0)
    assert game.piece == Piece("I", 3, 17)  # a row down, where it cannot go over the stack
    places = {place.mask for place in find(game.board.bits, game.piece)}
    assert leaves(["I"], bits=game.board.bits) == boards(["I"], bits=game.board.bits) == len(places)
    from_above = {place.mask for place in find(game.board.bits, Piece("I", 3, 18))}
    assert len(places) < len(from_above)


def test_where_a_piece_cannot_enter_the_count_ends() -> None:
    blocked = Board.parse("...JJJJ...\n" * 21).bits
    assert leaves(["I"], bits=blocked) == leaves(["I", "O"], bits=blocked) == 0
    assert boards(["I"], bits=blocked) == 0


def test_two_squares_have_more_ways_than_boards() -> None:
    assert leaves(["O", "O"]) == 9 * 9
    apart = 7 + 6 + 5 + 4 + 3 + 2 + 1  # two columns or more between them: either may come first
    above = 9 + 2 * 8  # on top of each other, or a column aside
    assert boards(["O", "O"]) == apart + above


def test_a_queue_of_three_has_a_few_more_ways_than_straight_drops_give() -> None:
    queue: list[Kind] = ["I", "O", "L"]
    assert leaves(queue[:2]) == 17 * 9
    assert leaves(queue) == 5266
    assert leaves(queue) > 17 * 9 * 34  # under the roofs that I and O make
