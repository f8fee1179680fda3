"""The board: which cells are filled, and with the colour of which piece."""

from typing import Final

from tetris.pieces import COLUMNS, FLOOR_ROWS, STRIDE, TOTAL_ROWS, Piece

EMPTY: Final = "."
_BLANK: Final = EMPTY * COLUMNS
_CEILING_ROWS: Final = 4  # solid as well, so that nothing leaves the 40 rows
_SOLID: Final = (1 << STRIDE) - 1
_WALLS: Final = 1 | 1 << (STRIDE - 1)
ROW: Final = _SOLID & ~_WALLS  # the ten columns of one row


def row_shift(y: int) -> int:
    """Return the number of the bit at which row y begins."""
    return (y + FLOOR_ROWS) * STRIDE


def cell_bit(x: int, y: int) -> int:
    """Return the bit of one cell; x from -1 to 10 (the walls), y from -5 to 43."""
    return 1 << (row_shift(y) + x + 1)


EMPTY_BITS: Final = (
    sum(_WALLS << row_shift(y) for y in range(TOTAL_ROWS))
    | sum(_SOLID << row_shift(y) for y in range(-FLOOR_ROWS, 0))
    | sum(_SOLID << row_shift(y) for y in range(TOTAL_ROWS, TOTAL_ROWS + _CEILING_ROWS))
)
"""The board without blocks: walls, floor and ceiling are filled, so that hitting them is a
collision like any other."""

_CEILING: Final = EMPTY_BITS >> row_shift(TOTAL_ROWS) << row_shift(TOTAL_ROWS)
_TOP_ROW: Final = _WALLS << row_shift(TOTAL_ROWS - 1)


def full_rows(bits: int, lowest: int = 0, highest: int = TOTAL_ROWS - 1) -> list[int]:
    """Return the full rows between two rows, both included, lowest first."""
    return [y for y in range(lowest, highest + 1) if not ~(bits >> row_shift(y)) & ROW]


def without_rows(bits: int, rows: list[int]) -> int:
    """Return the board without the given rows (lowest first); what is above them falls."""
    for y in reversed(rows):
        start = row_shift(y)
        above = (bits & ~_CEILING) >> (start + STRIDE) << start
        bits = bits & ((1 << start) - 1) | above | _TOP_ROW | _CEILING
    return bits


class Board:
    """Ten columns and forty rows, of which the lower twenty are seen.

    Attributes:
        bits: Every filled cell, walls, floor and ceiling included: see `cell_bit`.
        rows: The same with colours, row 0 first, as far up as there are blocks: ten
            characters each, `EMPTY` or the kind of the piece that left the block.
    """

    __slots__ = ("bits", "rows")

    def __init__(self) -> None:
        self.bits = EMPTY_BITS
        self.rows: list[str] = []

    @classmethod
    def parse(cls, picture: str) -> "Board":
        """Read a drawing, the top row first: `.` is empty, a piece's letter its block.

        Raises:
            ValueError: A row is not ten characters of `.IOTSZJL`, or there are over 40 rows.
        """
        lines = picture.split()
        board = cls()
        if len(lines) > TOTAL_ROWS:
            raise ValueError(f"{len(lines)} rows were drawn; a board has {TOTAL_ROWS}")
        for y, line in enumerate(reversed(lines)):
            if len(line) != COLUMNS or set(line) - set(".IOTSZJL"):
                raise ValueError(f"row {line!r} must be {COLUMNS} characters of .IOTSZJL")
            board.rows.append(line)
            board.bits |= sum(cell_bit(x, y) for x, mark in enumerate(line) if mark != EMPTY)
        board._trim()
        return board

    def __str__(self) -> str:
        """Draw the board as `parse` reads it, from its highest block down."""
        return "\n".join(reversed(self.rows))

    @property
    def height(self) -> int:
        """The number of rows up to the highest block."""
        return len(self.rows)

    @property
    def is_empty(self) -> bool:
        """Whether no block is left."""
        return not self.rows

    def filled(self, x: int, y: int) -> bool:
        """Return whether a cell holds a block; walls, floor and ceiling count as blocks."""
        return bool(self.bits & cell_bit(x, y))

    def fits(self, piece: Piece) -> bool:
        """Return whether all four cells of the piece are free."""
        return not self.bits & piece.mask

    def place(self, piece: Piece) -> None:
        """Turn the piece into blocks."""
        self.bits |= piece.mask
        for x, y in piece.cells:
            while y >= len(self.rows):
                self.rows.append(_BLANK)
            row = self.rows[y]
            self.rows[y] = row[:x] + piece.kind + row[x + 1 :]

    def clear_full_rows(self) -> tuple[int, ...]:
        """Take away all full rows, let what is above fall, and return them, lowest first."""
        rows = full_rows(self.bits, 0, len(self.rows) - 1)
        if rows:
            self.bits = without_rows(self.bits, rows)
            self.rows = [row for y, row in enumerate(self.rows) if y not in rows]
            self._trim()
        return tuple(rows)

    def _trim(self) -> None:
        while self.rows and self.rows[-1] == _BLANK:
            self.rows.pop()
