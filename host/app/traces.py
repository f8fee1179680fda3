"""Paths of touches over the dome, and whether an example belongs to its siblings; pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Final

import numpy as np

from host.ui.orb_state import Deviation
from host.ui.touch_watch import TOUCHED

_SHARE: Final = 0.5  # of that, from which a taxel counts for the place
_TIMES: Final = 2.2  # longer or shorter than its siblings, in time or way: another gesture
_LEAST: Final = (1.2, 0.3)  # difference that counts: grid units of way, seconds
_SIBLINGS: Final = 2  # examples that say what is usual

Point = tuple[float, float]  # grid units, y up


@dataclass(frozen=True, slots=True)
class Trace:
    """What the host saw of one touch.

    Attributes:
        path: Its centre, frame by frame.
        names: Gestures that the orb recognised in it.
        seconds: Its duration, as the orb measured it; 0 before.
    """

    path: tuple[Point, ...] = ()
    names: tuple[str, ...] = ()
    seconds: float = 0.0

    def step(self, felt: Deviation) -> "Trace":
        """Return the trace with one more frame, z - 1 of (rows, columns)."""
        change = np.abs(felt)
        if change.size == 0 or change.max() < TOUCHED:
            return self
        weight = np.maximum(0.0, change - _SHARE * change.max())
        row, column = (np.tensordot(weight, at, 2) for at in np.indices(weight.shape))
        total = float(weight.sum())
        place = float(column) / total, len(weight) - 1 - float(row) / total
        return replace(self, path=(*self.path, place))

    @property
    def way(self) -> float:
        """How far it went, grid units: between its farthest points."""
        some = self.path[:: max(1, len(self.path) // 16)]
        return max((math.dist(a, b) for a in some for b in some), default=0.0)


def doubt(label: str, one: Trace, siblings: Sequence[Trace]) -> str | None:
    """Return which gesture an example looks like, "" if it is only unlike its siblings, or None.

    An older gesture is named unless a sibling that was kept looks the same.
    """
    named = len(one.names) == 1 and one.names[0] != label
    if named and all(one.names != each.names for each in siblings):
        return one.names[0]
    if len(siblings) < _SIBLINGS:
        return None
    pairs = ((one.way, [s.way for s in siblings]), (one.seconds, [s.seconds for s in siblings]))
    for (own, others), least in zip(pairs, _LEAST, strict=True):
        usual = median(others)
        if abs(own - usual) > least and max(own, usual) > _TIMES * min(own, usual):
            return ""
    return None
