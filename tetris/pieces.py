"""The seven pieces: their shapes, where they enter, and what their turns look like as bits.

Coordinates: x to the right, y up, (0, 0) the lower left cell of the board. A piece is a
shape in a square box; its position is the box's lower left corner, its turn the number
of clockwise quarter turns since it entered.

The board is one Python integer, and so is a piece, which makes a collision one `&`. A
row takes `STRIDE` bits: a wall, ten columns, and the other wall.
"""

from dataclasses import dataclass
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
_ENTRANCES: Final[dict[Kind, Cell]] = {  # the box's corner: docs/tetris.md "spawn", rows 20 and 21
    "I": (3, 18),
    "O": (4, 20),
    "T": (3, 19),
    "S": (3, 19),
    "Z": (3, 19),
    "J": (3, 19),
    "L": (3, 19),
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

MASKS: Final = {
    kind: tuple(sum(1 << (y * STRIDE + x) for x, y in cells) for cells in turns)
    for kind, turns in SHAPES.items()
}
"""The same as bits, for a box whose corner is bit 0."""

_LOWEST: Final = {
    kind: tuple(min(y for _, y in cells) for cells in turns) for kind, turns in SHAPES.items()
}


@dataclass(frozen=True, slots=True)
class Piece:
    """One piece at one place: the corner of its box, and its clockwise quarter turns (0..3)."""

    kind: Kind
    x: int
    y: int
    turn: int = 0

    @classmethod
    def entering(cls, kind: Kind) -> "Piece":
        """Return the piece where it enters, in rows 20 and 21."""
        return cls(kind, *_ENTRANCES[kind])

    @property
    def cells(self) -> tuple[Cell, ...]:
        """The four cells on the board."""
        return tuple((self.x + x, self.y + y) for x, y in SHAPES[self.kind][self.turn])

    @property
    def mask(self) -> int:
        """The four cells as bits of the board."""
        return MASKS[self.kind][self.turn] << ((self.y + FLOOR_ROWS) * STRIDE + self.x + 1)

    @property
    def lowest_row(self) -> int:
        """The row of its lowest cell."""
        return self.y + _LOWEST[self.kind][self.turn]
