"""The board: which cells are filled, and with the colour of which piece."""

from functools import cache
from typing import Final

from tetris.engine.pieces import COLUMNS, FLOOR_ROWS, KINDS, STRIDE, TOTAL_ROWS, Piece

EMPTY: Final = "."
GARBAGE: Final = "#"  # a block that no piece left
_MARKS: Final = (GARBAGE, *KINDS)  # a block's mark by its number in the three planes
_LETTERS: Final = EMPTY + GARBAGE + "".join(KINDS)
_CEILING_ROWS: Final = 4  # solid as well, so that nothing leaves the 40 rows
_SOLID: Final = (1 << STRIDE) - 1
_NUMBERS: Final = {mark: number for number, mark in enumerate(_MARKS)}


def row_shift(y: int) -> int:
    """Return the number of the bit at which row y begins."""
    return (y + FLOOR_ROWS) * STRIDE


def cell_bit(x: int, y: int) -> int:
    """Return the bit of one cell; x from -1 to 10 (the walls), y from -5 to 43."""
    return 1 << (row_shift(y) + x + 1)


@cache
def open_row(columns: int) -> int:
    """Return the columns of one row, without its walls, as bits."""
    return ((1 << columns) - 1) << 1


@cache
def empty_bits(columns: int = COLUMNS) -> int:
    """Return the board without blocks; walls, floor and ceiling are filled, to collide with."""
    walls = _SOLID & ~open_row(columns)
    return (
        sum(walls << row_shift(y) for y in range(TOTAL_ROWS))
        | sum(_SOLID << row_shift(y) for y in range(-FLOOR_ROWS, 0))
        | sum(_SOLID << row_shift(y) for y in range(TOTAL_ROWS, TOTAL_ROWS + _CEILING_ROWS))
    )


ROW: Final = open_row(COLUMNS)
EMPTY_BITS: Final = empty_bits()
_CEILING: Final = EMPTY_BITS >> row_shift(TOTAL_ROWS) << row_shift(TOTAL_ROWS)
_TOP: Final = row_shift(TOTAL_ROWS - 1)


def full_rows(bits: int, lowest: int = 0, highest: int = TOTAL_ROWS - 1) -> list[int]:
    """Return the full rows between two rows, both included, lowest first."""
    part = bits >> (lowest + FLOOR_ROWS) * STRIDE  # small numbers from here on
    rows = []
    for y in range(lowest, highest + 1):
        if part & _SOLID == _SOLID:
            rows.append(y)
        part >>= STRIDE
    return rows


def without_rows(bits: int, rows: list[int], columns: int = COLUMNS) -> int:
    """Return the board without the given rows (lowest first); what is above them falls."""
    top = (_SOLID & ~open_row(columns)) << _TOP | _CEILING
    for y in reversed(rows):
        start = row_shift(y)
        above = (bits & ~_CEILING) >> (start + STRIDE) << start
        bits = bits & ((1 << start) - 1) | above | top
    return bits


class Board:
    """Four to ten columns, and forty rows, of which the lower ones are seen."""

    __slots__ = ("_rows", "bits", "columns", "planes")

    def __init__(self, columns: int = COLUMNS) -> None:
        self.columns = columns
        self.bits = empty_bits(columns)  # walls, floor and ceiling included: see `cell_bit`
        # The bits of the blocks' numbers, the lowest first: 1 to 7 by `KINDS`, 0 for garbage.
        self.planes = (0, 0, 0)
        self._rows: list[str] | None = None

    @classmethod
    def parse(cls, picture: str, columns: int = COLUMNS) -> "Board":
        """Read a drawing, the top row first; `.` is empty, `#` a block that no piece left.

        Raises:
            ValueError: A row is not so many of `.#IOTSZJL`, or there are over 40 rows.
        """
        lines = picture.split()
        board = cls(columns)
        if len(lines) > TOTAL_ROWS:
            raise ValueError(f"{len(lines)} rows were drawn; a board has {TOTAL_ROWS}")
        planes = [0, 0, 0]
        for y, line in enumerate(reversed(lines)):
            if len(line) != columns or set(line) - set(_LETTERS):
                raise ValueError(f"row {line!r} must be {columns} characters of {_LETTERS}")
            for x, mark in enumerate(line):
                if mark != EMPTY:
                    board.bits |= cell_bit(x, y)
                    for plane in range(3):
                        planes[plane] |= cell_bit(x, y) * (_NUMBERS[mark] >> plane & 1)
        board.planes = (planes[0], planes[1], planes[2])
        return board

    def __str__(self) -> str:
        """Draw the board as `parse` reads it, from its highest block down."""
        return "\n".join(reversed(self.rows))

    @property
    def rows(self) -> list[str]:
        """The drawing, row 0 first, as far up as there are blocks."""
        if self._rows is None:
            self._rows = [self._drawn(y) for y in range(self.height)]
        return self._rows

    @property
    def height(self) -> int:
        """The number of rows up to the highest block."""
        blocks = self.bits ^ empty_bits(self.columns)
        return max(0, -(-blocks.bit_length() // STRIDE) - FLOOR_ROWS)

    @property
    def is_empty(self) -> bool:
        """Whether no block is left."""
        return self.bits == empty_bits(self.columns)

    @property
    def garbage(self) -> int:
        """The blocks that no piece left, as bits."""
        low, middle, high = self.planes
        return (self.bits ^ empty_bits(self.columns)) & ~(low | middle | high)

    def place(self, piece: Piece) -> None:
        """Turn the piece into blocks."""
        mask = piece.mask
        self.bits |= mask
        number = _NUMBERS[piece.kind]
        low, middle, high = self.planes
        self.planes = (
            low | mask if number & 1 else low,
            middle | mask if number & 2 else middle,
            high | mask if number & 4 else high,
        )
        self._rows = None

    def clear_full_rows(self, lowest: int = 0, highest: int = TOTAL_ROWS - 1) -> tuple[int, ...]:
        """Take away the full rows between two rows, both included; return them, lowest first."""
        rows = full_rows(self.bits, lowest, highest)
        if rows:
            self.bits = without_rows(self.bits, rows, self.columns)
            low, middle, high = (_squeezed(plane, rows) for plane in self.planes)
            self.planes = (low, middle, high)
            self._rows = None
        return tuple(rows)

    def _drawn(self, y: int) -> str:
        low, middle, high = (plane >> row_shift(y) + 1 for plane in self.planes)
        bits = self.bits >> row_shift(y) + 1
        return "".join(
            _MARKS[low >> x & 1 | (middle >> x & 1) << 1 | (high >> x & 1) << 2]
            if bits >> x & 1
            else EMPTY
            for x in range(self.columns)
        )


def _squeezed(plane: int, rows: list[int]) -> int:
    for y in reversed(rows):
        start = row_shift(y)
        plane = plane >> (start + STRIDE) << start | plane & ((1 << start) - 1)
    return plane
