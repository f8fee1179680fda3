"""Commands of the orb as actions of the game, and the repeats of held gestures."""

import math
from collections.abc import Sequence
from typing import Final

from tetris.engine.game import Action
from tetris.kit.bindings import Code, Keys
from tetris.kit.settings import Settings

ACTIONS: Final[dict[str, Action]] = {
    "left": Action.LEFT,
    "right": Action.RIGHT,
    "down": Action.DOWN,
    "drop": Action.HARD_DROP,
    "rotate_cw": Action.ROTATE_CW,
    "rotate_ccw": Action.ROTATE_CCW,
    "hold": Action.HOLD,
    "pause": Action.PAUSE,
}
# What acts for as long as its key is down, or its gesture is held.
HELD: Final[dict[Code, Action]] = {"left": Action.LEFT, "right": Action.RIGHT, "down": Action.DOWN}
_SHIFTS: Final = (Action.LEFT, Action.RIGHT)
# A tap holds for some frames longer than a key: the orb needs them to see that the finger has left.
_LINGER_FRAMES: Final = 10


class HeldGestures:
    """Commands whose gesture is held: after the first step they repeat as held keys do."""

    def __init__(self, settings: Settings, rate_hz: float = 10.0) -> None:
        self._das_s = settings.das_ms / 1000 + _LINGER_FRAMES / rate_hz
        self._keys = Keys(
            HELD,
            das_s=self._das_s,
            arr_s=settings.arr_ms / 1000,
            shifts=_SHIFTS,
        )
        self._held: frozenset[str] = frozenset()
        self._lowering_s = math.inf  # since when "down" is held

    def hold(self, commands: Sequence[str], now_s: float) -> None:
        """Take the commands that are held now."""
        held = frozenset(commands)
        for name in sorted(self._held - held):
            self._keys.release(name, now_s)
        for name in sorted(held - self._held):
            self._keys.press(name, now_s)
        if ("down" in held) != ("down" in self._held):
            self._lowering_s = now_s if "down" in held else math.inf
        self._held = held

    def poll(self, now_s: float) -> list[Action]:
        """Return the repeats that are due."""
        return [due.action for due in self._keys.due(now_s) if due.repeated]

    def soft_drop(self, now_s: float) -> bool:
        """Whether "down" is held for so long that it lowers the piece."""
        return now_s - self._lowering_s >= self._das_s
