"""Results of checks: one row for each thing that was looked at, and the faults' sentences."""

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib.resources import files
from textwrap import wrap
from typing import Final

_WIDTH: Final = 100  # columns of a terminal that the table fills
_GAP: Final = "  "


class Verdict(StrEnum):
    """Verdict of a check. Only a fault makes the exit status 1."""

    GOOD = "good"
    UNKNOWN = "not checked"  # not present, or no press
    DOUBTFUL = "doubtful"  # it works, but worth a look
    FAULT = "FAULT"


@dataclass(frozen=True, slots=True)
class Row:
    """One thing that was looked at."""

    name: str  # what was looked at: "SPI bus", "row 2", "taxel (1,3)"
    verdict: Verdict  # how it is
    found: str  # what was measured or seen, with units; never empty
    advice: str = ""  # what to do; "" where it is good
    code: str = ""  # a word for programs, such as "open"; "" where it is good


def faulty(rows: Iterable[Row]) -> bool:
    """Return whether anything is broken."""
    return any(row.verdict is Verdict.FAULT for row in rows)


def table(rows: Sequence[Row]) -> str:
    """Return the rows as a table for people; advice stands under what was found."""
    names = max((len(row.name) for row in rows), default=0)
    verdicts = max((len(row.verdict) for row in rows), default=0)
    indent = " " * (names + verdicts + 2 * len(_GAP))
    lines = []
    for row in rows:
        head = f"{row.name:<{names}}{_GAP}{row.verdict:<{verdicts}}{_GAP}"
        width = max(30 + len(indent), _WIDTH)
        lines += wrap(row.found, width, initial_indent=head, subsequent_indent=indent)
        lines += wrap(row.advice, width, initial_indent=f"{indent}-> ", subsequent_indent=indent)
    return "\n".join(lines)


FAULTS: Final = tomllib.loads((files(__package__) / "faults.toml").read_text("utf-8"))
"""By code: what was found, where {} takes the figures, and advice."""


def fault(code: str, name: str, *figures: object) -> Row:
    """Return the row of a fault: a key of `FAULTS`, what has it ("row 2"), and its figures."""
    words = FAULTS[code]
    return Row(name, Verdict.FAULT, words["found"].format(*figures), words["advice"], code)
