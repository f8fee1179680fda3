"""The seven pieces: their shapes, where they enter, and their turns and kicks, as bits.

Coordinates: x to the right, y up, (0, 0) the lower left cell of the board. A piece is a
shape in a square box; its position is the box's lower left corner, its turn the number
of clockwise quarter turns since it entered.

The board is one Python integer, and so is a piece, which makes a collision one `&`. A
row takes `STRIDE` bits: a wall, ten columns, and the other wall. Narrower boards have a
thicker right wall.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Final, Literal

Kind = Literal["I", "O", "T", "S", "Z", "J", "L"]
KINDS: Final[tuple[Kind, ...]] = ("I", "O", "T", "S", "Z", "J", "L")
Cell = tuple[int, int]  # (x, y)

COLUMNS: Final = 10  # docs/tetris.md "matrix", and the next two
VISIBLE_ROWS: Final = 20
TOTAL_ROWS: Final = 40
STRIDE: Final = COLUMNS + 2  # bits a row
FLOOR_ROWS: Final = 5  # solid rows below row 0: no kick reaches through them

_PICTURES: Final[dict[Kind, tuple[str, ...]]] = {  # as they enter, flat side down
    "I": ("....", "####", "....", "...."),
    "O": ("##", "##"),
    "T": (".#.", "###", "..."),
    "S": (".##", "##.", "..."),
    "Z": ("##.", ".##", "..."),
    "J": ("#..", "###", "..."),
    "L": ("..#", "###", "..."),
}


def _turns(picture: tuple[str, ...]) -> tuple[tuple[Cell, ...], ...]:
    """Return the picture's cells after 0, 1, 2 and 3 clockwise quarter turns of its box."""
    size = len(picture)
    cells = sorted(
        (x, size - 1 - row)
        for row, line in enumerate(picture)
        for x, mark in enumerate(line)
        if mark == "#"
    )
    turns = [tuple(cells)]
    for _ in range(3):
        cells = sorted((y, size - 1 - x) for x, y in cells)
        turns.append(tuple(cells))
    return tuple(turns)


SHAPES: Final = {kind: _turns(picture) for kind, picture in _PICTURES.items()}
"""Cells inside the box, by kind and turn."""

OFFSETS: Final = {
    kind: tuple(tuple(sorted(y * STRIDE + x for x, y in cells)) for cells in turns)
    for kind, turns in SHAPES.items()
}
"""How far these are from the box's corner, in bits."""

MASKS: Final = {
    kind: tuple(sum(1 << bit for bit in bits) for bits in turns) for kind, turns in OFFSETS.items()
}
"""The cells as bits, for a box whose corner is bit 0."""

_LOWEST: Final = {
    kind: tuple(min(y for _, y in cells) for cells in turns) for kind, turns in SHAPES.items()
}
_HIGHEST: Final = {
    kind: tuple(max(y for _, y in cells) for cells in turns) for kind, turns in SHAPES.items()
}


# -- kicks: docs/tetris.md "srs" ---------------------------------------------------------------

Kicks = Literal["srs", "srs+"]
KickTable = Mapping[tuple[int, int], tuple[tuple[int, int], ...]]  # (turn, next): shifts (x, y)
LAST_KICK: Final = 4  # the fifth test, which moves the centre by one column and two rows

_FILE: Final = tomllib.loads((files("assets") / "tetris" / "kicks.toml").read_text("utf-8"))
_SHIFTS: Final[dict[str, KickTable]] = {
    name: {(int(a), int(b)): tuple(map(tuple, tests)) for (a, b), tests in table.items()}
    for name, table in _FILE.items()
}


def _table(i: str) -> Mapping[str, KickTable]:
    stays = dict.fromkeys(_SHIFTS[i], ((0, 0),))  # O never moves
    return dict.fromkeys("TSZJL", _SHIFTS["jlstz"]) | {"I": _SHIFTS[i], "O": stays}


KICKS: Final[Mapping[Kicks, Mapping[str, KickTable]]] = {
    "srs": _table("i"),
    "srs+": _table("i_plus"),
}  # by the kind of the piece


# -- a piece at a place -------------------------------------------------------------------------


class _Worked:
    """Attribute derived from a piece's position, computed on first access."""

    __slots__ = ("below", "corner", "highest_row", "left", "lowest_row", "mask", "right", "turned")
    mask: int  # the four cells as bits of the board
    corner: int  # the bit of the box's lower left corner
    lowest_row: int
    highest_row: int
    left: "Piece"  # one cell further, like the next two
    right: "Piece"
    below: "Piece"
    # What a quarter turn tries, in order: by 2 * (index in KICKS) + (0 clockwise, 1 not).
    turned: tuple[tuple["Piece", ...], ...]


@dataclass(frozen=True, slots=True)
class Piece(_Worked):
    """One piece at one place: the corner of its box, and its clockwise quarter turns (0..3)."""

    kind: Kind
    x: int
    y: int
    turn: int = 0

    @classmethod
    def entering(cls, kind: Kind, columns: int = COLUMNS, rows: int = VISIBLE_ROWS) -> "Piece":
        """Return the piece where it enters: in the two rows above the visible ones.

        Left of the middle where it cannot be in the middle: docs/tetris.md "spawn".
        """
        size = len(_PICTURES[kind])
        return piece_at(kind, (columns - size) // 2, rows - _LOWEST[kind][0], 0)

    @property
    def cells(self) -> tuple[Cell, ...]:
        """The four cells on the board."""
        return tuple((self.x + x, self.y + y) for x, y in SHAPES[self.kind][self.turn])

    def __getattr__(self, name: str) -> object:
        """Work out one of `_Worked`; Python asks here only for what has no value yet."""
        work = _WORK.get(name)
        if work is None:
            raise AttributeError(f"a piece has no {name}")
        value = work(self)
        object.__setattr__(self, name, value)
        return value


@cache
def piece_at(kind: Kind, x: int, y: int, turn: int) -> Piece:
    """Return the one `Piece` that stands for this place, so that neighbours are found once."""
    return Piece(kind, x, y, turn)


def _corner(piece: Piece) -> int:
    return (piece.y + FLOOR_ROWS) * STRIDE + piece.x + 1


def _moved(piece: Piece, dx: int, dy: int) -> Piece:
    return piece_at(piece.kind, piece.x + dx, piece.y + dy, piece.turn)


def _turned(piece: Piece) -> tuple[tuple[Piece, ...], ...]:
    return tuple(
        tuple(
            piece_at(piece.kind, piece.x + dx, piece.y + dy, turn)
            for dx, dy in table[piece.kind][piece.turn, turn]
        )
        for table in KICKS.values()
        for turn in ((piece.turn + 1) & 3, (piece.turn - 1) & 3)
    )


_WORK: Final = {
    "mask": lambda piece: MASKS[piece.kind][piece.turn] << _corner(piece),
    "corner": _corner,
    "lowest_row": lambda piece: piece.y + _LOWEST[piece.kind][piece.turn],
    "highest_row": lambda piece: piece.y + _HIGHEST[piece.kind][piece.turn],
    "left": lambda piece: _moved(piece, -1, 0),
    "right": lambda piece: _moved(piece, 1, 0),
    "below": lambda piece: _moved(piece, 0, -1),
    "turned": _turned,
}
