"""Results of checks: one row for each thing that was looked at, and the sentences of faults."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
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
    code: str = ""  # a word for programs, such as "open_row"; "" where it is good


def faulty(rows: Iterable[Row]) -> bool:
    """Return whether anything is broken."""
    return any(row.verdict is Verdict.FAULT for row in rows)


def table(rows: Sequence[Row]) -> str:
    """Return the rows as a table for people; advice stands under what was found."""
    wide = max((len(row.name) for row in rows), default=0)
    middle = max((len(row.verdict) for row in rows), default=0)
    indent = " " * (wide + middle + 2 * len(_GAP))
    room = max(30, _WIDTH - len(indent))
    lines = []
    for row in rows:
        head = f"{row.name:<{wide}}{_GAP}{row.verdict:<{middle}}{_GAP}"
        found = wrap(row.found, room) or [""]
        advice = wrap(row.advice, room - 3)
        lines.append(head + found[0])
        lines += [indent + line for line in found[1:]]
        lines += [indent + ("-> " if i == 0 else "   ") + line for i, line in enumerate(advice)]
    return "\n".join(lines)


# Faults of the wiring: what was found, where {} takes the figures, and advice.
_SWAPPED: Final = "Swap the two leads at the plug, or the two numbers in the wiring file."
_TOUCHING: Final = "Look for a solder bridge, or for film that touches."
_WEAK: Final = (
    "it fills slowly: {} times as much after 4 ms as after 0.1 ms",
    "The film or its contact is worn (megohms): spray it anew, or clamp the lead again.",
)
_TO_GROUND: Final = "Look for a bridge to ground; if there is none, its pin is broken: use another."
SENTENCES: Final[dict[str, tuple[str, str]]] = {
    # --- converter and bus
    "no_converter": (
        "no answer: {}",
        "Check the converter's supply, chip select and data-out leads, and that SPI is switched on "
        "(raspi-config).",
    ),
    "silent_converter": (
        "nothing but zeros, also while every row stands at the supply",
        "Check the data-out lead, the reference pin and the converter's ground.",
    ),
    "bus_errors": ("{}", "Shorten the bus leads, or lower the SPI clock in the wiring file."),
    "other_converter": (
        "the last two bits are always zero: a 10-bit converter answers",
        "An MCP3008 is fitted where the wiring file says MCP3208: correct one of the two.",
    ),
    "stuck_bit": (
        "bit {} never changes",
        "Lower the SPI clock; if it stays, the converter is broken: replace it.",
    ),
    "bit_errors": (
        "{} % of the readings jump",
        "Lower the SPI clock in the wiring file, and shorten the bus leads.",
    ),
    "reference": (
        "a row charged to the supply reads {}, where .94 of full scale is usual",
        "The reference pin must be at the pins' own supply, 3.3 V: check that lead.",
    ),
    "slow": ("{}", "The computer is too busy: end other programs, or raise the SPI clock."),
    "noise": (
        "readings scatter by {} counts of 4096",
        "Join the converter's grounds, shorten its leads, put 1 uF across its supply.",
    ),
    "mains": (
        "readings hum by {} % at {} Hz",
        "Keep away from mains leads and chargers; ground the computer.",
    ),
    # --- rows and columns
    "unplugged": ("all taxels have {} pF", "The membrane's plug is out: push it in."),
    "short_rows": ("it touches {}", _TOUCHING),
    "short_columns": ("it touches {}", _TOUCHING),
    "open_row": (
        "{} pF a taxel, where the others have {}: the lead is off",
        "Fasten this row's lead at the membrane.",
    ),
    "open_column": (
        "{} pF a taxel, where the others have {}: the lead is off",
        "Fasten this column's lead at the membrane.",
    ),
    "weak_row": _WEAK,
    "weak_column": _WEAK,
    "swapped_rows": ("what touches it is felt in {}", _SWAPPED),
    "swapped_columns": ("what touches it is felt in {}", _SWAPPED),
    "swapped_channels": (
        "its charge arrives at the input of {}",
        "Swap the two converter inputs, or the two channels in the wiring file.",
    ),
    "high_row": (
        "at the supply, {} of full scale, whatever its pin does",
        "Look for a bridge from this row to 3.3 V.",
    ),
    "high_column": (
        "at the supply, whatever its pin does",
        "Look for a bridge from this column to 3.3 V.",
    ),
    "pull_up": (
        "rises to {} of full scale by itself within a fraction of a millisecond",
        "A pull-up is switched on at its pin, or a resistor goes to 3.3 V: remove it.",
    ),
    "grounded_row": ("at ground, whatever its pin does", _TO_GROUND),
    "no_channel": (
        "its pin sees the charge, the converter does not",
        "The lead from this row to its converter input is off: solder it.",
    ),
    "dead_row_pin": (
        "its pin neither charges nor grounds it",
        "The lead from this row to its pin is off, or the pin is broken.",
    ),
    "grounded_column": ("at ground, whatever its pin does", _TO_GROUND),
    "damp": (
        "it charges by itself: {} of full scale after 4 ms",
        "Clean and dry the board: flux or moisture leaks from the supply.",
    ),
    "no_bleed": (
        "it keeps its charge: {}",
        "The 50 MOhm resistor from this row to ground is missing.",
    ),
    "small_bleed": (
        "it loses its charge through {} megohms, not 50",
        "Fit the right resistor from this row to ground; look for flux beside it.",
    ),
    "no_row_capacitor": (
        "about {} pF to ground, not 150",
        "The row's capacitor to ground is missing, or its joint is open.",
    ),
    "long_lead": (
        "about {} pF to ground, not 150",
        "Shorten this row's lead, or keep it away from ground and shields.",
    ),
    "noisy": (
        "it scatters by {} counts, the others by {}",
        "A contact crackles: fasten this row's lead and plug.",
    ),
    # --- taxels
    "short_taxel": (
        "its row touches its column",
        "There is a hole in the dielectric here: patch the membrane.",
    ),
    "leaky": (
        "it conducts: {} times as much after 4 ms as after 0.1 ms",
        "The dielectric is thin or damp here: dry the membrane; if it stays, patch it.",
    ),
    "dead": (
        "{} pF, where the others have {}",
        "The film is cracked here. Play goes on with a guess in its place.",
    ),
    # --- with a hand
    "mirrored": (
        "touches are felt mirrored, {}",
        "The plug is in the wrong way round, or the list in the wiring file is: reverse it.",
    ),
    "turned": (
        "rows feel what columns should",
        "Rows and columns are exchanged: swap the two plugs or the two lists.",
    ),
    "stiff": (
        "it feels {} % of what it should",
        "The membrane is stiff or loose here. Play goes on with a guess in its place.",
    ),
    "weak": ("it feels {} % of what it should", "Watch it: the film may be cracking here."),
}


def fault(code: str, name: str, *figures: object, verdict: Verdict = Verdict.FAULT) -> Row:
    """Return the row of a fault: a key of `SENTENCES`, what has it ("row 2"), and its figures."""
    found, advice = SENTENCES[code]
    return Row(name, verdict, found.format(*figures), advice, code)
