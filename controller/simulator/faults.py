"""Faults of real orbs, to switch on and off at any time.

Fault.parse("dead:2,3")      # taxel in row 2, column 3, counted from the top left, from 0
Fault.parse("short_row:1")   # rows 1 and 2 touch
Fault.parse("air_leak")      # with the usual size
Fault.parse("air_leak=0.3")  # or a size of one's own
"""

import re
from dataclasses import dataclass
from typing import Final

_TEXT: Final = re.compile(r"([a-z_]+)(?::(\d+)(?:,(\d+))?)?(?:=([0-9.]+))?")


@dataclass(frozen=True, slots=True)
class Kind:
    """What a fault does.

    Attributes:
        places: How many numbers say where: 2 a taxel, 1 a row or column, 0 everywhere.
        size: How bad it usually is.
        meaning: In words, with the unit of its size.
    """

    places: int
    size: float
    meaning: str


KINDS: Final[dict[str, Kind]] = {
    "dead": Kind(2, 1.0, "a taxel does not react"),
    "leaky": Kind(2, 0.01, "a taxel reacts at 60 % and is noisy; size: noise, relative"),
    "open_row": Kind(1, 1.0, "a row's lead is off: only stray capacitance is read"),
    "open_column": Kind(1, 1.0, "a column's lead is off"),
    "short_row": Kind(1, 1.0, "a row touches the next one: both read their sum"),
    "short_column": Kind(1, 1.0, "a column touches the next one: both read their sum"),
    "air_leak": Kind(0, 0.05, "the dome loses air; size: of its pressure, per minute"),
    "temperature": Kind(0, 0.02, "the permittivity drifts; size: relative, per minute"),
    "saturation": Kind(0, 0.8, "the converter clips; size: of the usual reading"),
    "mains": Kind(0, 0.03, "hum on every reading; size: relative amplitude"),
    "jitter": Kind(0, 0.02, "the loop is late at random; size: seconds"),
}


class FaultError(ValueError):
    """There is no such fault; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault.

    Attributes:
        kind: A key of `KINDS`.
        row: Row of a taxel, row electrode; -1 where it has none.
        column: Column of a taxel, column electrode; -1 where it has none.
        size: How bad it is, in the unit of its kind.
    """

    kind: str
    row: int = -1
    column: int = -1
    size: float = 1.0

    @classmethod
    def parse(cls, text: str, rows: int = 5, columns: int = 5) -> "Fault":
        """Return the fault that `text` names, as in this module's docstring.

        Raises:
            FaultError: The kind is unknown, or its place is not on the grid.
        """
        match = _TEXT.fullmatch(text)
        if match is None or match[1] not in KINDS:
            raise FaultError(f"there is no fault {text!r}; there are {', '.join(KINDS)}")
        name, kind = match[1], KINDS[match[1]]
        places = [int(number) for number in match.groups()[1:3] if number is not None]
        if len(places) != kind.places:
            form = (name, f"{name}:NUMBER", f"{name}:ROW,COLUMN")[kind.places]
            raise FaultError(f"{text!r} does not say where; write {form}")
        row, column = _place(name, places)
        # A short reaches the next electrode, so the last one cannot begin it.
        spare = 1 if name.startswith("short") else 0
        if row >= rows - (spare if column < 0 else 0) or column >= columns - (
            spare if row < 0 else 0
        ):
            raise FaultError(f"{text!r} is not on a grid of {rows} rows and {columns} columns")
        size = kind.size if match[4] is None else _size(text, match[4])
        return cls(name, row, column, size)


def _place(name: str, places: list[int]) -> tuple[int, int]:
    """Return (row, column), -1 for none."""
    if len(places) == 2:
        return places[0], places[1]
    if not places:
        return -1, -1
    return (places[0], -1) if name.endswith("row") else (-1, places[0])


def _size(text: str, number: str) -> float:
    try:
        return float(number)
    except ValueError:
        raise FaultError(f"{text!r} has a size that is no number") from None
