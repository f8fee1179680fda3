"""Pulses of light round the dome that answer what happens in the game."""

import math
from collections.abc import Iterable
from typing import Final

from tetris.engine.events import Event, LevelUp, Locked

LEAST_S: Final = 1 / 3  # from one pulse to the next
_RISE_S: Final = 0.06
_FALL_S: Final = 0.22  # time constant
_OVER_S: Final = 1.0
_LOCK: Final = 0.35  # strength of a pulse, 0 to 1
_CLEAR: Final = (0.7, 0.8, 0.9, 1.0)  # of 1, 2, 3, 4 rows


def strength(events: Iterable[Event]) -> float:
    """Return how strong a pulse for the events of one moment is, 0 (none) to 1."""
    found = 0.0
    for event in events:
        if isinstance(event, Locked):
            rows = len(event.rows)
            found = max(found, _CLEAR[min(rows, len(_CLEAR)) - 1] if rows else _LOCK)
        elif isinstance(event, LevelUp):
            found = 1.0
    return found


class Rim:
    """The pulse under way; times are seconds."""

    def __init__(self) -> None:
        self._strength, self._since_s = 0.0, -math.inf

    def strike(self, strength: float, now_s: float) -> None:
        """Begin a pulse, unless the last one began less than `LEAST_S` ago."""
        if strength > 0.0 and now_s - self._since_s >= LEAST_S:
            self._strength, self._since_s = strength, now_s

    def level(self, now_s: float) -> float:
        """Return how bright the rim is, 0 to 1."""
        passed_s = now_s - self._since_s
        if not 0.0 <= passed_s < _OVER_S:
            return 0.0
        rise = min(1.0, passed_s / _RISE_S)
        return self._strength * rise * math.exp(-max(0.0, passed_s - _RISE_S) / _FALL_S)
