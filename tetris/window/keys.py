"""The keyboard as a player's hand: keys and time in, actions out.

A held shift key repeats: once on the press, again after the delayed auto shift (DAS),
then at the auto repeat rate (ARR). Of two held directions the later one rules. Held soft
drop is a state, because only the engine knows how fast it falls.
"""

from collections.abc import Mapping
from typing import Final

import pygame

from tetris.events import Action

DAS_S: Final = 0.167  # docs/tetris.md "auto_repeat", "modern_default"
ARR_S: Final = 0.033

BINDINGS: Final[Mapping[int, Action]] = {
    pygame.K_LEFT: Action.LEFT,
    pygame.K_RIGHT: Action.RIGHT,
    pygame.K_DOWN: Action.DOWN,
    pygame.K_SPACE: Action.HARD_DROP,
    pygame.K_UP: Action.ROTATE_CW,
    pygame.K_x: Action.ROTATE_CW,
    pygame.K_z: Action.ROTATE_CCW,
    pygame.K_c: Action.HOLD,
    pygame.K_LSHIFT: Action.HOLD,
    pygame.K_RSHIFT: Action.HOLD,
    pygame.K_p: Action.PAUSE,
    pygame.K_ESCAPE: Action.PAUSE,
    pygame.K_r: Action.RESTART,
}
_SHIFTS: Final = (Action.LEFT, Action.RIGHT)


class Keys:
    """Turns key events into actions. Feed it `press` and `release`, ask `poll` every frame."""

    def __init__(
        self,
        bindings: Mapping[int, Action] = BINDINGS,
        *,
        das_s: float = DAS_S,
        arr_s: float = ARR_S,
    ) -> None:
        """Use a table from pygame key codes to actions, and two times above 0 s."""
        if das_s <= 0 or arr_s <= 0:
            raise ValueError(f"DAS {das_s} s and ARR {arr_s} s must be above 0")
        self._bindings = bindings
        self._das_s, self._arr_s = das_s, arr_s
        self._actions: list[Action] = []
        self._held: dict[int, Action] = {}  # by key, the latest press last
        self._repeat_at_s = 0.0

    @property
    def soft_drop(self) -> bool:
        """Whether a key for down is held."""
        return Action.DOWN in self._held.values()

    def press(self, key: int, time_s: float) -> None:
        """Take note of a key that went down; unknown ones are ignored."""
        action = self._bindings.get(key)
        if action is None or key in self._held:
            return
        self._repeat(time_s)
        self._held[key] = action
        self._actions.append(action)
        if action in _SHIFTS:
            self._repeat_at_s = time_s + self._das_s

    def release(self, key: int, time_s: float) -> None:
        """Take note of a key that came up."""
        self._repeat(time_s)
        ruling = self._ruling()
        self._held.pop(key, None)
        if self._ruling() is not ruling:  # the other direction is still held: start afresh
            self._repeat_at_s = time_s + self._das_s

    def release_all(self) -> None:
        """Let go of everything, as when the window loses the focus."""
        self._held.clear()
        self._actions.clear()

    def poll(self, time_s: float) -> list[Action]:
        """Return the actions since the last call, repeats included, oldest first."""
        self._repeat(time_s)
        actions, self._actions = self._actions, []
        return actions

    def _ruling(self) -> Action | None:
        return next((held for held in reversed(self._held.values()) if held in _SHIFTS), None)

    def _repeat(self, time_s: float) -> None:
        ruling = self._ruling()
        while ruling and self._repeat_at_s <= time_s:
            self._actions.append(ruling)
            self._repeat_at_s += self._arr_s
