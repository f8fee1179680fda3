"""The schedule of a scan, step by step: pure.

A slot grounds all electrodes, lets its rows float, raises its column, lets that settle, converts,
and lowers the column again.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from controller.sensors.hardware.wiring import Wiring


@dataclass(frozen=True, slots=True)
class Slot:
    """One charge: a column, and the rows that are read against it.

    Attributes:
        column: Which is raised; None: none is, so that what is read is the rows' own.
        rows: Which float, in the order of conversion; all others are grounded.
    """

    column: int | None
    rows: tuple[int, ...]


def slots(wiring: Wiring) -> Iterator[Slot]:
    """Yield the slots of one frame: column by column (paper, section 3.2)."""
    for column in wiring.order or range(wiring.columns):
        for rows in groups(wiring):
            yield Slot(column, rows)


def dark(wiring: Wiring) -> Iterator[Slot]:
    """Yield slots in which no column is raised: what they read is offset, leakage and injection."""
    for rows in groups(wiring):
        yield Slot(None, rows)


def groups(wiring: Wiring) -> list[tuple[int, ...]]:
    """Return which rows float together."""
    if wiring.scheme == "column":
        return [tuple(range(wiring.rows))]
    return [(row,) for row in range(wiring.rows)]


def frame_s(wiring: Wiring, pin_s: float, transfer_s: float) -> float:
    """Return how long a frame takes.

    Args:
        wiring: With its times and scheme.
        pin_s: What one change of a pin costs.
        transfer_s: What one transfer to the converter costs, its bits included.
    """
    total = 0.0
    for slot in slots(wiring):
        changes = 2 * len(slot.rows) + 2  # rows away and back, the column up and down
        conversions = len(slot.rows) * (1 + wiring.times.samples)  # one empties the converter
        total += changes * pin_s + conversions * transfer_s
        total += wiring.times.discharge_s + wiring.times.settle_s
    return total
