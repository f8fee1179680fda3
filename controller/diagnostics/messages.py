"""Faults of the wiring: names, and advice, in one table."""

from typing import Final, NamedTuple

from controller.diagnostics.report import Row, Verdict


class FaultMessage(NamedTuple):
    """The text of a fault.

    Attributes:
        found: What was found; `{}` takes the figures.
        advice: What to do.
    """

    found: str
    advice: str


def _both(code: str, found: str, advice: str) -> dict[str, FaultMessage]:
    """Return a fault that rows and columns have alike; braces in `code` take the electrode."""
    return {
        code.format(kind): FaultMessage(found, advice.replace("ELECTRODE", kind))
        for kind in ("row", "column")
    }


SENTENCES: Final[dict[str, FaultMessage]] = {
    # --- rows and columns alike
    **_both("short_{}s", "it touches {}", "Look for a solder bridge, or for film that touches."),
    **_both(
        "open_{}",
        "{} pF a taxel, where the others have {}: the lead is off",
        "Fasten this ELECTRODE's lead at the membrane.",
    ),
    **_both(
        "weak_{}",
        "it fills slowly: {} times as much after 4 ms as after 0.1 ms",
        "The film or its contact is worn (megohms): spray it anew, or clamp the lead again.",
    ),
    **_both(
        "swapped_{}s",
        "what touches it is felt in {}",
        "Swap the two leads at the plug, or the two numbers in the wiring file.",
    ),
    # --- converter and bus
    "no_converter": FaultMessage(
        "no answer: {}",
        "Check the converter's supply, chip select and data-out leads, and that SPI is switched on "
        "(raspi-config).",
    ),
    "silent_converter": FaultMessage(
        "nothing but zeros, also while every row stands at the supply",
        "Check the data-out lead, the reference pin and the converter's ground.",
    ),
    "bus_errors": FaultMessage(
        "{}",
        "Shorten the bus leads, or lower the SPI clock in the wiring file.",
    ),
    "other_converter": FaultMessage(
        "the last two bits are always zero: a 10-bit converter answers",
        "An MCP3008 is fitted where the wiring file says MCP3208: correct one of the two.",
    ),
    "stuck_bit": FaultMessage(
        "bit {} never changes",
        "Lower the SPI clock; if it stays, the converter is broken: replace it.",
    ),
    "bit_errors": FaultMessage(
        "{} % of the readings jump",
        "Lower the SPI clock in the wiring file, and shorten the bus leads.",
    ),
    "reference": FaultMessage(
        "a row charged to the supply reads {}, where .94 of full scale is usual",
        "The reference pin must be at the pins' own supply, 3.3 V: check that lead.",
    ),
    "slow": FaultMessage(
        "{}",
        "The computer is too busy: end other programs, or raise the SPI clock.",
    ),
    # --- rows
    "swapped_channels": FaultMessage(
        "its charge arrives at the input of {}",
        "Swap the two converter inputs, or the two channels in the wiring file.",
    ),
    "high_row": FaultMessage(
        "at the supply, {} of full scale, whatever its pin does",
        "Look for a bridge from this row to 3.3 V.",
    ),
    "pull_up": FaultMessage(
        "rises to {} of full scale by itself within a fraction of a millisecond",
        "A pull-up is switched on at its pin, or a resistor goes to 3.3 V: remove it.",
    ),
    "grounded_row": FaultMessage(
        "at ground, whatever its pin does",
        "Look for a bridge to ground; if there is none, its pin is broken: use another.",
    ),
    "no_channel": FaultMessage(
        "its pin sees the charge, the converter does not",
        "The lead from this row to its converter input is off: solder it.",
    ),
    "dead_row_pin": FaultMessage(
        "its pin neither charges nor grounds it",
        "The lead from this row to its pin is off, or the pin is broken.",
    ),
    "damp": FaultMessage(
        "it charges by itself: {} of full scale after 4 ms",
        "Clean and dry the board: flux or moisture leaks from the supply.",
    ),
    "no_bleed": FaultMessage(
        "it keeps its charge: {}",
        "The 50 MOhm resistor from this row to ground is missing.",
    ),
    "small_bleed": FaultMessage(
        "it loses its charge through {} megohms, not 50",
        "Fit the right resistor from this row to ground; look for flux beside it.",
    ),
    "no_row_capacitor": FaultMessage(
        "about {} pF to ground, not 150",
        "The row's capacitor to ground is missing, or its joint is open.",
    ),
    "long_lead": FaultMessage(
        "about {} pF to ground, not 150",
        "Shorten this row's lead, or keep it away from ground and shields.",
    ),
    "noisy": FaultMessage(
        "it scatters by {} counts, the others by {}",
        "A contact crackles: fasten this row's lead and plug.",
    ),
    # --- columns
    "high_column": FaultMessage(
        "at the supply, whatever its pin does", "Look for a bridge from this column to 3.3 V."
    ),
    "grounded_column": FaultMessage(
        "at ground, whatever its pin does",
        "Look for a bridge to ground; if there is none, its pin is broken: use another.",
    ),
    # --- taxels
    "short_taxel": FaultMessage(
        "its row touches its column", "There is a hole in the dielectric here: patch the membrane."
    ),
    "leaky": FaultMessage(
        "it conducts: {} times as much after 4 ms as after 0.1 ms",
        "The dielectric is thin or damp here: dry the membrane; if it stays, patch it.",
    ),
    "dead": FaultMessage(
        "{} pF, where the others have {}",
        "The film is cracked here. Play goes on with a guess in its place.",
    ),
    # --- the whole
    "unplugged": FaultMessage("all taxels have {} pF", "The membrane's plug is out: push it in."),
    "noise": FaultMessage(
        "readings scatter by {} counts of 4096",
        "Join the converter's grounds, shorten its leads, put 1 uF across its supply.",
    ),
    "mains": FaultMessage(
        "readings hum by {} % at {} Hz",
        "Keep away from mains leads and chargers; ground the computer.",
    ),
    # --- with a hand
    "mirrored": FaultMessage(
        "touches are felt mirrored, {}",
        "The plug is in the wrong way round, or the list in the wiring file is: reverse it.",
    ),
    "turned": FaultMessage(
        "rows feel what columns should",
        "Rows and columns are exchanged: swap the two plugs or the two lists.",
    ),
    "stiff": FaultMessage(
        "it feels {} % of what it should",
        "The membrane is stiff or loose here. Play goes on with a guess in its place.",
    ),
    "weak": FaultMessage(
        "it feels {} % of what it should", "Watch it: the film may be cracking here."
    ),
}


def fault(code: str, name: str, *figures: object, verdict: Verdict = Verdict.FAULT) -> Row:
    """Return the row of a fault.

    Args:
        code: A key of `SENTENCES`.
        name: What has it, such as "row 2".
        figures: What fills the sentence.
        verdict: How bad it is.
    """
    sentence = SENTENCES[code]
    return Row(name, verdict, sentence.found.format(*figures), sentence.advice, code)
