"""Count of the boards that a queue of pieces can lead to, to compare generators of placements.

The convention: the empty board of ten columns, no hold; each piece enters as in the game, in
rows 20 and 21 and at once a row down where that is free, moves by shifts, falls and turns with
kicks, and locks; full rows are taken away. A placement counts once for the cells that it fills,
however it was reached, in whichever turn, and with or without a spin. A game that is lost ends
its count.
"""

from collections.abc import Iterable, Iterator
from typing import Final

from tetris.bots.greedy import settled
from tetris.bots.placements import find
from tetris.engine.board import EMPTY_BITS
from tetris.engine.moves import entered
from tetris.engine.pieces import Kicks, Kind, Piece

_MANY: Final = 100_000  # boards before the last piece
_PASSES: Final = 7


def leaves(queue: Iterable[Kind], kicks: Kicks = "srs", bits: int = EMPTY_BITS) -> int:
    """Return the number of ways to place the pieces in this order."""
    kinds = list(queue)
    if not kinds:
        return 1
    kind, *others = kinds
    piece = entered(bits, Piece.entering(kind))
    if piece is None:
        return 0
    places = find(bits, piece, kicks)
    if not others:
        return len(places)
    return sum(leaves(others, kicks, after) for after in _after(bits, places))


def boards(queue: Iterable[Kind], kicks: Kicks = "srs", bits: int = EMPTY_BITS) -> int:
    """Return the number of different boards that the ways end in."""
    *kinds, last = queue
    reached = {bits}
    for kind in kinds:
        reached = set(_grown(reached, kind, kicks))
    if len(reached) < _MANY:
        return len(set(_grown(reached, last, kicks)))
    # The last boards are too many for the memory: each pass keeps those of one remainder.
    return sum(
        len({after for after in _grown(reached, last, kicks) if after % _PASSES == remainder})
        for remainder in range(_PASSES)
    )


def _grown(reached: set[int], kind: Kind, kicks: Kicks) -> Iterator[int]:
    entering = Piece.entering(kind)
    for bits in reached:
        if piece := entered(bits, entering):
            yield from _after(bits, find(bits, piece, kicks))


def _after(bits: int, places: list[Piece]) -> Iterator[int]:
    return (settled(bits, piece)[0] for piece in places)
