"""All placements of a piece, and the fewest inputs to each, with and without a spin.

A set of positions is one integer: bit n is set for a box whose corner is bit n of the
board. A shift of the integer moves all positions of the set at once, so that the piece
floods the board like water: from above the stack, where it can be turned and shifted at
will, down, aside, and through turns with their kicks. The sets of the four turns lie side
by side in one integer, a block each.
"""

from collections.abc import Iterator
from functools import cache
from typing import Final

from tetris.engine import moves
from tetris.engine.board import empty_bits, row_shift
from tetris.engine.events import Action
from tetris.engine.moves import Spin
from tetris.engine.pieces import (
    COLUMNS,
    FLOOR_ROWS,
    KICKS,
    OFFSETS,
    STRIDE,
    TOTAL_ROWS,
    Kicks,
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
_LIFT: Final = 2 * STRIDE + 2  # bits; makes every kick a shift one way
_Turns = tuple[tuple[int, tuple[int, ...]], ...]  # from which turn, and the tests' shifts, lifted
_TWINS: Final[frozenset[Kind]] = frozenset(("I", "S", "Z"))  # look alike after half a turn
_TURNS: Final = (Action.ROTATE_CW, Action.ROTATE_CCW)


def find(bits: int, piece: Piece, kicks: Kicks = "srs") -> list[Piece]:
    """Return where a piece in a free position can lock; turns that fill the same cells are one."""
    kind = piece.kind
    empty = _EMPTIES.get(bits >> _TOP_ROW & _SOLID, 0)
    height = ((bits ^ empty).bit_length() + STRIDE - 1) // STRIDE - FLOOR_ROWS
    open_sky = height <= piece.y <= TOTAL_ROWS - _BOX_ROWS
    height = min(max(height, 0 if open_sky else piece.y), TOTAL_ROWS - 1)
    width, block, all_blocks, sky, falls = _measures(height, kind)
    free = _blocked(bits, kind, width, block) ^ all_blocks
    if open_sky:
        reached = free & sky  # up there, it can be turned and shifted at will
        through = free
        for rows in falls:  # twice as far each time
            reached |= through & reached >> rows
            through &= through >> rows
    else:
        reached = 1 << piece.corner + (0 if kind == "O" else piece.turn * width)
    missing = free & ~reached
    if missing:
        reached = _flooded(reached, missing, free, width, block, _turns(kind, kicks))
    resting = reached & ~(free << STRIDE)
    if kind == "O":
        return _pieces(kind, (resting,))
    up, right, down, left = (resting >> turn * width & block for turn in range(4))
    if kind in _TWINS:  # after half a turn: a row lower, or a column to the left
        down, left = down & ~(up << STRIDE), left & ~(right << 1)
    return _pieces(kind, (up, right, down, left))


def _blocked(bits: int, kind: Kind, width: int, block: int) -> int:
    """Return the blocks of the turns' positions that are not free."""
    bits &= (1 << width + _BOX_ROWS * STRIDE) - 1
    if kind == "O":
        return (bits | bits >> 1 | bits >> STRIDE | bits >> STRIDE + 1) & block
    (a, b, c, d), (e, f, g, h), (i, j, k, m), (n, o, p, q) = OFFSETS[kind]
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
                        fresh |= _turned(source, wanted, places, tests) << start
            start += width
        missing &= ~fresh
    return reached


def _turned(source: int, wanted: int, free: int, tests: tuple[int, ...]) -> int:
    """Return which of the wanted positions a quarter turn reaches; all but `source` is lifted."""
    a, b, c, d, e = tests
    source &= wanted >> a | wanted >> b | wanted >> c | wanted >> d | wanted >> e
    hits = 0
    for test in tests:
        if not source:
            break
        fits = source & free >> test  # the others go on to the next test
        hits |= fits << test
        source ^= fits
    return (hits & wanted) >> _LIFT


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


# -- the inputs to them ------------------------------------------------------------------------


def path(
    bits: int, piece: Piece, landing: Piece, kicks: Kicks = "srs"
) -> tuple[Action, ...] | None:
    """Return the fewest inputs to a landing or one of the same cells; None if out of reach."""
    ways = (way for found, _, way in paths(bits, piece, kicks) if found.mask == landing.mask)
    return next(ways, None)


def paths(
    bits: int, piece: Piece, kicks: Kicks = "srs", *, lowers: bool = True
) -> Iterator[tuple[Piece, Spin, tuple[Action, ...]]]:
    """Yield every landing and spin with the fewest inputs, the last a hard drop, fewest first.

    `DOWN` is one row, as an orb gives it; without `lowers` it is not used.
    """
    landing, again = moves.landed(bits, piece), piece.kind == "T"
    yield landing, Spin.NONE, (Action.HARD_DROP,)
    known = {(landing.mask, Spin.NONE)}
    ways: dict[Piece, tuple[Action, ...]] = {piece: ()}
    queue = [piece]
    for here in queue:  # it grows meanwhile
        for there, action, kick in _neighbours(bits, here, kicks, lowers):
            if there not in ways:
                ways[there] = (*ways[here], action)
                queue.append(there)
            elif not again:  # only T's spins depend on the way
                continue
            landing, spin = moves.landed(bits, there), Spin.NONE
            if again and landing is there:
                spin = moves.spin(bits, there, kick)
            if (landing.mask, spin) not in known:
                known.add((landing.mask, spin))
                yield landing, spin, (*ways[here], action, Action.HARD_DROP)


def _neighbours(
    bits: int, here: Piece, kicks: Kicks, lowers: bool
) -> Iterator[tuple[Piece, Action, int | None]]:
    """Yield the positions one input away from a free one, with the input and a turn's kick."""
    if not bits & here.left.mask:
        yield here.left, Action.LEFT, None
    if not bits & here.right.mask:
        yield here.right, Action.RIGHT, None
    if here.kind != "O":
        for at, action in enumerate(_TURNS, moves.TABLES[kicks]):
            for kick, turned in enumerate(here.turned[at]):
                if not bits & turned.mask:
                    yield turned, action, kick
                    break
    if lowers and not bits & here.below.mask:
        yield here.below, Action.DOWN, None
