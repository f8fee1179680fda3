"""What a piece can do on a board: shift, turn with kicks, drop, and spin.

Every function takes the board's bits and a piece and returns a new piece. Source: the
Super Rotation System, docs/tetris.md "srs", and "tspin".
"""

from enum import Enum
from typing import Final, Literal

from tetris.board import cell_bit
from tetris.pieces import FLOOR_ROWS, KINDS, MASKS, STRIDE, Cell, Kind, Piece

Direction = Literal[1, -1]
CW: Final = 1
CCW: Final = -1
LAST_KICK: Final = 4  # the fifth test, which moves the centre by one column and two rows

# From one turn to the next, the five shifts (x, y) to try in order: docs/tetris.md "srs".
_Kicks = dict[tuple[int, int], tuple[Cell, ...]]
_JLSTZ: Final[_Kicks] = {
    (0, 1): ((0, 0), (-1, 0), (-1, 1), (0, -2), (-1, -2)),
    (1, 0): ((0, 0), (1, 0), (1, -1), (0, 2), (1, 2)),
    (1, 2): ((0, 0), (1, 0), (1, -1), (0, 2), (1, 2)),
    (2, 1): ((0, 0), (-1, 0), (-1, 1), (0, -2), (-1, -2)),
    (2, 3): ((0, 0), (1, 0), (1, 1), (0, -2), (1, -2)),
    (3, 2): ((0, 0), (-1, 0), (-1, -1), (0, 2), (-1, 2)),
    (3, 0): ((0, 0), (-1, 0), (-1, -1), (0, 2), (-1, 2)),
    (0, 3): ((0, 0), (1, 0), (1, 1), (0, -2), (1, -2)),
}
_I: Final[_Kicks] = {
    (0, 1): ((0, 0), (-2, 0), (1, 0), (-2, -1), (1, 2)),
    (1, 0): ((0, 0), (2, 0), (-1, 0), (2, 1), (-1, -2)),
    (1, 2): ((0, 0), (-1, 0), (2, 0), (-1, 2), (2, -1)),
    (2, 1): ((0, 0), (1, 0), (-2, 0), (1, -2), (-2, 1)),
    (2, 3): ((0, 0), (2, 0), (-1, 0), (2, 1), (-1, -2)),
    (3, 2): ((0, 0), (-2, 0), (1, 0), (-2, -1), (1, 2)),
    (3, 0): ((0, 0), (1, 0), (-2, 0), (1, -2), (-2, 1)),
    (0, 3): ((0, 0), (-1, 0), (2, 0), (-1, 2), (2, -1)),
}
_O: Final[_Kicks] = dict.fromkeys(_JLSTZ, ((0, 0),))  # it never moves
KICKS: Final[dict[Kind, _Kicks]] = dict.fromkeys(KINDS, _JLSTZ) | {"I": _I, "O": _O}

# The corners of T's box, by turn: first the two that its point looks towards.
_CORNERS: Final[tuple[tuple[Cell, Cell, Cell, Cell], ...]] = (
    ((0, 2), (2, 2), (0, 0), (2, 0)),
    ((2, 2), (2, 0), (0, 2), (0, 0)),
    ((0, 0), (2, 0), (0, 2), (2, 2)),
    ((0, 0), (0, 2), (2, 0), (2, 2)),
)


class Spin(Enum):
    """How a piece came to its place, for scoring."""

    NONE = "none"
    MINI = "mini"
    FULL = "full"


def shifted(bits: int, piece: Piece, dx: int, dy: int = 0) -> Piece | None:
    """Return the piece moved by whole cells, or None where it collides."""
    moved = Piece(piece.kind, piece.x + dx, piece.y + dy, piece.turn)
    return None if bits & moved.mask else moved


def rotated(bits: int, piece: Piece, direction: Direction) -> tuple[Piece, int] | None:
    """Return the piece after a quarter turn, and which kick made it fit (0..4), or None."""
    kind = piece.kind
    turn = (piece.turn + direction) & 3
    mask = MASKS[kind][turn]
    corner = (piece.y + FLOOR_ROWS) * STRIDE + piece.x + 1
    for kick, (dx, dy) in enumerate(KICKS[kind][piece.turn, turn]):
        if not bits & (mask << (corner + dy * STRIDE + dx)):
            return Piece(kind, piece.x + dx, piece.y + dy, turn), kick
    return None


def rows_to_fall(bits: int, piece: Piece) -> int:
    """Return how many rows the piece can fall; 0 on the ground."""
    mask = piece.mask >> STRIDE
    rows = 0
    while not bits & mask:
        mask >>= STRIDE
        rows += 1
    return rows


def landed(bits: int, piece: Piece) -> Piece:
    """Return the piece where a hard drop would put it: its ghost."""
    return Piece(piece.kind, piece.x, piece.y - rows_to_fall(bits, piece), piece.turn)


def spin(bits: int, piece: Piece, kick: int | None) -> Spin:
    """Judge a locking piece: docs/tetris.md "tspin".

    Args:
        bits: The board without the piece.
        piece: Where it locks.
        kick: The kick of the rotation that was its last successful move; None when that
            move was a shift or a fall.
    """
    if piece.kind != "T" or kick is None:
        return Spin.NONE
    corners = [bool(bits & cell_bit(piece.x + x, piece.y + y)) for x, y in _CORNERS[piece.turn]]
    if sum(corners) < 3:
        return Spin.NONE
    full = (corners[0] and corners[1]) or kick == LAST_KICK  # "disputes": every fifth kick
    return Spin.FULL if full else Spin.MINI
