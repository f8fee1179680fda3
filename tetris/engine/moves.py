"""Moves of a piece on a board: shift, turn with kicks, drop, and spin.

Every function takes the board's bits and a piece and returns a new piece. Source: the
Super Rotation System, docs/tetris.md "srs", and "tspin".
"""

from collections.abc import Mapping
from enum import Enum
from functools import cache
from typing import Final

from tetris.engine.pieces import KICKS, LAST_KICK, OFFSETS, STRIDE, Kicks, Piece, piece_at

TABLES: Final[Mapping[Kicks, int]] = {name: 2 * at for at, name in enumerate(KICKS)}
"""Index of a kick table's clockwise turns in `Piece.turned`; the others come next."""

_CORNERS: Final = (0, 2, 2 * STRIDE, 2 * STRIDE + 2)  # of its box, in bits
_FRONT: Final = ((2, 3), (1, 3), (0, 1), (0, 2))  # which its point looks towards, by turn


class Spin(Enum):
    """Spin by which a piece came to its place, for scoring."""

    NONE = "none"
    MINI = "mini"
    FULL = "full"

    __hash__ = object.__hash__  # as of `Action`


def entered(bits: int, piece: Piece) -> Piece | None:
    """Return an entering piece: a row down where that is free; None where it collides."""
    if bits & piece.mask:
        return None
    return piece if bits & piece.below.mask else piece.below


def rows_to_fall(bits: int, piece: Piece) -> int:
    """Return how many rows the piece can fall; 0 on the ground."""
    # Where the box's corner cannot be, in the piece's column and below it; the floor is there.
    blocked = 0
    for shift in OFFSETS[piece.kind][piece.turn]:
        blocked |= bits >> shift
    corner = piece.corner
    highest = (blocked & _below(corner)).bit_length() - 1
    return (corner - highest) // STRIDE - 1


def lowered(piece: Piece, rows: int) -> Piece:
    """Return the piece so many rows further down."""
    return piece_at(piece.kind, piece.x, piece.y - rows, piece.turn)


def landed(bits: int, piece: Piece) -> Piece:
    """Return the piece where a hard drop would put it: its ghost."""
    return lowered(piece, rows_to_fall(bits, piece))


def spin(bits: int, piece: Piece, kick: int | None) -> Spin:
    """Judge a locking piece: docs/tetris.md "tspin".

    The kick is that of the turn that was its last successful move; None if that was no turn.
    """
    if piece.kind != "T" or kick is None:
        return Spin.NONE
    filled = [bits >> piece.corner + corner & 1 for corner in _CORNERS]
    if sum(filled) < 3:
        return Spin.NONE
    first, second = _FRONT[piece.turn]
    # Every fifth kick counts as full: "Where sources disagree".
    full = (filled[first] and filled[second]) or kick == LAST_KICK
    return Spin.FULL if full else Spin.MINI


@cache
def _below(corner: int) -> int:
    """Return the bits right below a corner, down to the bottom of the floor."""
    return sum(1 << bit for bit in range(corner - STRIDE, -1, -STRIDE))
