"""Generation of all placements of a piece, spins included.

A set of positions is one integer: bit n is set for a box whose corner is bit n of the
board. A shift of the integer moves all positions of the set at once, so that the piece
floods the board like water: from above the stack, where it can be turned and shifted at
will, down, aside, and through turns with their kicks. The sets of the four turns lie side
by side in one integer, a block each. `paths` has the inputs to each placement.
"""

from collections.abc import Iterator
from functools import cache
from typing import Final, NamedTuple

from tetris.engine.board import empty_bits, row_shift
from tetris.engine.kicks import KICKS, Kicks
from tetris.engine.moves import Spin
from tetris.engine.pieces import (
    COLUMNS,
    FLOOR_ROWS,
    MASKS,
    STRIDE,
    TOTAL_ROWS,
    Kind,
    Piece,
    piece_at,
)

_TOP_ROW: Final = row_shift(TOTAL_ROWS - 1)
_SOLID: Final = (1 << STRIDE) - 1
_EMPTIES: Final = {  # by the walls of the highest row, which is free of blocks but in odd boards
    empty_bits(columns) >> _TOP_ROW & _SOLID: empty_bits(columns)
    for columns in range(1, COLUMNS + 1)
}
_KICK_ROWS: Final = 2  # no kick goes further up
_BOX_ROWS: Final = 4
_OFFSETS: Final = {  # of a shape's cells from its box's corner, in bits
    kind: tuple(tuple(bit for bit in range(mask.bit_length()) if mask >> bit & 1) for mask in masks)
    for kind, masks in MASKS.items()
}
_LIFT: Final = 2 * STRIDE + 2  # bits; makes every kick a shift one way
_Turns = tuple[tuple[int, tuple[int, ...]], ...]  # from which turn, and the tests' shifts, lifted
_TWINS: Final[frozenset[Kind]] = frozenset(("I", "S", "Z"))  # look alike after half a turn
_T_CORNERS: Final = (0, 2, 2 * STRIDE, 2 * STRIDE + 2)  # of its box, in bits
_T_FRONT: Final = ((2, 3), (1, 3), (0, 1), (0, 2))  # which its point looks towards, by turn


class Placement(NamedTuple):
    """A piece where it can lock, and what spin it can have there."""

    piece: Piece
    spin: Spin


class Placements:
    """All placements of one piece on one board.

    A place that can be reached with and without a spin is two placements; turns that fill
    the same cells are one.

    Attributes:
        kind: Of the piece.
        turns: For each turn, the positions in which it can lock, as bits of corners.
        spins: For each spin and turn, the same; None where no spin is possible.
    """

    __slots__ = ("kind", "spins", "turns")

    def __init__(
        self,
        kind: Kind,
        turns: tuple[int, ...],
        spins: dict[Spin, tuple[int, ...]] | None = None,
    ) -> None:
        self.kind = kind
        self.turns = turns
        self.spins = spins

    def __len__(self) -> int:
        sets = self.turns if self.spins is None else sum(self.spins.values(), ())
        return sum(positions.bit_count() for positions in sets)

    def __iter__(self) -> Iterator[Placement]:
        for spin, sets in (self.spins or {Spin.NONE: self.turns}).items():
            for piece in _pieces(self.kind, sets):
                yield Placement(piece, spin)

    def pieces(self) -> list[Piece]:
        """Return where the piece can lock, without regard to spins."""
        return _pieces(self.kind, self.turns)


def find(bits: int, piece: Piece, kicks: Kicks = "srs") -> Placements:
    """Return every placement that the piece can reach from where it is.

    Args:
        bits: The board.
        piece: In a position that is free.
        kicks: The kick table.
    """
    kind = piece.kind
    empty = _EMPTIES.get(bits >> _TOP_ROW & _SOLID, 0)
    height = ((bits ^ empty).bit_length() + STRIDE - 1) // STRIDE - FLOOR_ROWS
    open_sky = height <= piece.y <= TOTAL_ROWS - _BOX_ROWS
    height = min(max(height, 0 if open_sky else piece.y), TOTAL_ROWS - 1)
    width, block, all_blocks, sky, falls = _measures(height, kind)
    free = _blocked(bits, kind, width, block) ^ all_blocks
    start = 0  # the piece where it is, if it may lie there without having been moved
    if open_sky:
        reached = free & sky  # up there, it can be turned and shifted at will
        through = free
        for rows in falls:  # twice as far each time
            reached |= through & reached >> rows
            through &= through >> rows
    else:
        reached = start = 1 << piece.corner + (0 if kind == "O" else piece.turn * width)
    missing = free & ~reached
    if missing:
        reached = _flooded(reached, missing, free, width, block, _turns(kind, kicks))
    resting = reached & ~(free << STRIDE)
    if kind == "O":
        return Placements(kind, (resting,))
    turns = tuple(resting >> turn * width & block for turn in range(4))
    if kind in _TWINS:  # after half a turn: a row lower, or a column to the left
        up, right, down, left = turns
        return Placements(kind, (up, right, down & ~(up << STRIDE), left & ~(right << 1)))
    if kind == "T":
        return Placements(kind, turns, _spins(bits, reached, free, start, turns, width, kicks))
    return Placements(kind, turns)


def _blocked(bits: int, kind: Kind, width: int, block: int) -> int:
    """Return the blocks of the turns' positions that are not free."""
    bits &= (1 << width + _BOX_ROWS * STRIDE) - 1
    if kind == "O":
        return (bits | bits >> 1 | bits >> STRIDE | bits >> STRIDE + 1) & block
    (a, b, c, d), (e, f, g, h), (i, j, k, m), (n, o, p, q) = _OFFSETS[kind]
    return (
        ((bits >> n | bits >> o | bits >> p | bits >> q) & block) << 3 * width
        | ((bits >> i | bits >> j | bits >> k | bits >> m) & block) << 2 * width
        | ((bits >> e | bits >> f | bits >> g | bits >> h) & block) << width
        | (bits >> a | bits >> b | bits >> c | bits >> d) & block
    )


def _flooded(
    reached: int, missing: int, free: int, width: int, block: int, turns: tuple[_Turns, ...]
) -> int:
    """Return the positions reached by shifts, falls and turns; `missing` are the others."""
    fresh = reached  # since the turns were last tried
    while fresh:
        latest = fresh
        while latest := (latest << 1 | latest >> 1 | latest >> STRIDE) & missing:
            fresh |= latest
            missing ^= latest
        reached |= fresh
        if not missing:
            break
        sources = [fresh >> start & block for start in (0, width, 2 * width, 3 * width)]
        fresh = start = 0
        for into in turns:
            wanted = (missing >> start & block) << _LIFT
            if wanted:
                places = (free >> start & block) << _LIFT
                for before, tests in into:
                    source = sources[before]
                    if source:
                        hits, last = _turned(source, wanted, places, tests)
                        fresh |= (hits | last) << start
            start += width
        missing &= ~fresh
    return reached


def _turned(source: int, wanted: int, free: int, tests: tuple[int, ...]) -> tuple[int, int]:
    """Return which of the wanted positions a quarter turn reaches, by the last test apart.

    Wanted and free positions, and the tests' shifts, are lifted.
    """
    a, b, c, d, e = tests
    source &= wanted >> a | wanted >> b | wanted >> c | wanted >> d | wanted >> e
    if not source:
        return 0, 0
    hits = 0
    for test in (a, b, c, d):
        if fits := source & free >> test:  # the others go on to the next test
            hits |= fits << test
            source ^= fits
            if not source:
                return (hits & wanted) >> _LIFT, 0
    return (hits & wanted) >> _LIFT, (source << e & wanted) >> _LIFT


def _spins(
    bits: int,
    reached: int,
    free: int,
    start: int,
    turns: tuple[int, ...],
    width: int,
    kicks: Kicks,
) -> dict[Spin, tuple[int, ...]] | None:
    """Sort T's placements by their spins: docs/tetris.md "tspin"."""
    corners = [bits >> corner for corner in _T_CORNERS]
    a, b, c, d = corners
    three = a & b & (c | d) | c & d & (a | b)
    if not any(positions & three for positions in turns):
        return None
    block = (1 << width) - 1
    full, mini, plain = [0] * 4, [0] * 4, list(turns)
    for after, into in enumerate(_turns("T", kicks)):
        wanted = turns[after] & three
        if not wanted:
            continue
        places = (free >> after * width & block) << _LIFT
        first, second = _T_FRONT[after]
        front = corners[first] & corners[second]
        for before, tests in into:
            source = reached >> before * width & block
            hits, last = _turned(source, wanted << _LIFT, places, tests)
            full[after] |= hits & front | last
            mini[after] |= hits & ~front
    for turn in range(4):  # the others, and those that a shift or a fall reaches too
        here = reached >> turn * width & block
        moved = here << 1 | here >> 1 | here >> STRIDE | start >> turn * width & block
        plain[turn] &= ~(full[turn] | mini[turn]) | moved
    return {Spin.NONE: tuple(plain), Spin.MINI: tuple(mini), Spin.FULL: tuple(full)}


@cache
def _measures(height: int, kind: Kind) -> tuple[int, int, int, int, tuple[int, ...]]:
    """Return a block's width, one block and all of them filled, the sky, and doubling falls."""
    rows = FLOOR_ROWS + height + _KICK_ROWS + 1
    width = rows * STRIDE
    block = (1 << width) - 1
    blocks = (0,) if kind == "O" else range(4)
    sky = block >> row_shift(height) << row_shift(height)
    falls = []
    fall = STRIDE
    while fall < width:
        falls.append(fall)
        fall *= 2
    everything = sum(block << turn * width for turn in blocks)
    return width, block, everything, sum(sky << turn * width for turn in blocks), tuple(falls)


@cache
def _turns(kind: Kind, kicks: Kicks) -> tuple[_Turns, ...]:
    """Return, for each turn, the quarter turns that lead into it."""
    if kind == "O":
        return ()
    into: list[list[tuple[int, tuple[int, ...]]]] = [[], [], [], []]
    for (before, after), tests in KICKS[kicks][kind].items():
        into[after].append((before, tuple(_LIFT + dx + dy * STRIDE for dx, dy in tests)))
    return tuple(tuple(some) for some in into)


@cache
def _table(kind: Kind, turn: int) -> tuple[Piece, ...]:
    """Return the pieces by the length of an integer whose highest bit is their corner."""
    pieces = []
    for corner in range(-1, row_shift(TOTAL_ROWS)):
        row, column = divmod(corner, STRIDE)
        x, y = column - 1, row - FLOOR_ROWS
        if x > COLUMNS - 1:  # the box begins left of the wall
            x, y = x - STRIDE, y + 1
        pieces.append(piece_at(kind, x, y, turn))
    return tuple(pieces)


def _pieces(kind: Kind, sets: tuple[int, ...]) -> list[Piece]:
    pieces = []
    for turn, positions in enumerate(sets):
        if positions:
            table = _table(kind, turn)
            while positions:
                rest = positions & positions - 1
                pieces.append(table[(positions ^ rest).bit_length()])
                positions = rest
    return pieces
