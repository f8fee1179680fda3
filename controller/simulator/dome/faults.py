"""Faults of real orbs, to switch on and off at any time.

Fault.parse("dead:2,3")      # taxel in row 2, column 3, counted from the top left, from 0
Fault.parse("short_row:1")   # rows 1 and 2 touch
Fault.parse("air_leak")      # with the usual size
Fault.parse("air_leak=0.3")  # or another size

The faults of an emulated orb's wiring are parsed in the same way: sensors/hardware/emulated/faults.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import ClassVar, Final, Self

from controller.shared.errors import UserError

_TEXT: Final = re.compile(r"([a-z_]+)(?::(\d+)(?:,(\d+))?)?(?:=([0-9.]+))?")


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of fault."""

    place: str  # "taxel", "row", "rows" (it and the next one), "column", "columns", or ""
    size: float  # its usual size
    meaning: str  # in words, with the unit of its size


def read_kinds(package: str) -> dict[str, Kind]:
    """Return the kinds of faults in the `faults.toml` of a package, by name."""
    table = tomllib.loads((files(package) / "faults.toml").read_text("utf-8"))
    return {name: Kind(*entry) for name, entry in table.items()}


KINDS: Final = read_kinds("controller.simulator.dome")


class FaultError(UserError, ValueError):
    """There is no such fault; the message is one sentence."""


@dataclass(frozen=True)
class Fault:
    """One fault."""

    kinds: ClassVar[Mapping[str, Kind]] = KINDS

    kind: str  # a key of `kinds`
    row: int = -1  # row of a taxel, row electrode; -1 where it has none
    column: int = -1  # column of a taxel, column electrode; -1 where it has none
    size: float = 1.0  # its size, in the unit of its kind

    @classmethod
    def parse(cls, text: str, rows: int = 5, columns: int = 5) -> Self:
        """Return the fault that `text` names, as in this module's docstring.

        Raises:
            FaultError: The kind is unknown, or its place is not on the grid.
        """
        match = _TEXT.fullmatch(text)
        if match is None or match[1] not in cls.kinds:
            raise FaultError(f"there is no fault {text!r}; there are {', '.join(cls.kinds)}")
        name, kind = match[1], cls.kinds[match[1]]
        places = [int(number) for number in match.groups()[1:3] if number is not None]
        # A fault of two electrodes reaches the next one, so the last one cannot begin it.
        limits = {
            "taxel": (rows, columns),
            "row": (rows,),
            "rows": (rows - 1,),
            "column": (columns,),
            "columns": (columns - 1,),
            "": (),
        }[kind.place]
        if len(places) != len(limits):
            form = (name, f"{name}:NUMBER", f"{name}:ROW,COLUMN")[len(limits)]
            raise FaultError(f"{text!r} does not say where; write {form}")
        if any(place >= limit for place, limit in zip(places, limits, strict=True)):
            raise FaultError(f"{text!r} is not on a grid of {rows} rows and {columns} columns")
        try:
            size = kind.size if match[4] is None else float(match[4])
        except ValueError:
            raise FaultError(f"{text!r} has a size that is no number") from None
        row = places[0] if kind.place in ("taxel", "row", "rows") else -1
        column = places[-1] if kind.place in ("taxel", "column", "columns") else -1
        return cls(name, row, column, size)
