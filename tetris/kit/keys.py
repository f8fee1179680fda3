"""Key handling with auto-repeat: keys or buttons and time in, actions out.

A held shift repeats: once on the press, again after the delayed auto shift (DAS), then at the
auto repeat rate (ARR). Of two held directions the later one rules. Held soft drop is a state,
because only the engine knows how fast it falls.
"""

from collections.abc import Collection, Mapping
from enum import Enum
from typing import Final, Generic, NamedTuple, TypeVar

Code = int | str  # a pygame key, or the name of a pad's button
Action = TypeVar("Action", bound=Enum)  # the application's; a value is its name in bindings

_AT_ONCE: Final = 9  # shifts from one wall to the other: what an ARR of 0 gives


class DueAction(NamedTuple, Generic[Action]):
    """An action that is due, and since when."""

    time_s: float
    action: Action
    repeated: bool = False  # by a held key; then it is no command
    held: frozenset[Action] = frozenset()  # whose keys were down then, this one's included


class Keys(Generic[Action]):
    """Turns presses into actions. Feed it `press` and `release`, ask `poll` every frame."""

    def __init__(
        self,
        bindings: Mapping[Code, Action],
        *,
        das_s: float,
        arr_s: float,
        shifts: Collection[Action],
    ) -> None:
        """Use a table of bindings and a way to repeat; an ARR of 0 goes to the wall at once."""
        self._bindings = bindings
        self._das_s, self._arr_s = das_s, arr_s
        self._shifts = shifts  # they repeat
        self._due: list[DueAction[Action]] = []
        self._held: dict[Code, Action] = {}  # the latest press last
        self._repeat_at_s = 0.0
        self._polled_s = 0.0

    @property
    def held(self) -> frozenset[Action]:
        """The actions whose keys are down."""
        return frozenset(self._held.values())

    def press(self, key: Code, time_s: float) -> None:
        """Take note of a key that went down; unknown ones are ignored."""
        action = self._bindings.get(key)
        if action is None or key in self._held:
            return
        self._repeat(time_s)
        self._held[key] = action
        self._due.append(DueAction(time_s, action, held=self.held))
        if action in self._shifts:
            self._repeat_at_s = time_s + self._das_s

    def release(self, key: Code, time_s: float) -> None:
        """Take note of a key that came up.

        A late frame does not say when: it repeats up to the frame before only, so that a tap never
        becomes a run.
        """
        self._repeat(min(time_s, self._polled_s))
        ruling = self._ruling()
        self._held.pop(key, None)
        if self._ruling() is not ruling:  # the other direction is still held: start afresh
            self._repeat_at_s = time_s + self._das_s

    def release_all(self) -> None:
        """Let go of everything, as when the window loses the focus."""
        self._held.clear()
        self._due.clear()

    def due(self, time_s: float) -> list[DueAction[Action]]:
        """Return the actions since the last call, repeats included, oldest first."""
        self._repeat(time_s)
        self._polled_s = time_s
        due, self._due = self._due, []
        return due

    def _ruling(self) -> Action | None:
        return next((held for held in reversed(self._held.values()) if held in self._shifts), None)

    def _repeat(self, time_s: float) -> None:
        ruling = self._ruling()
        if ruling is None or self._repeat_at_s > time_s:
            return
        held = self.held
        if self._arr_s == 0:
            self._due += [DueAction(time_s, ruling, True, held)] * _AT_ONCE
            return
        while self._repeat_at_s <= time_s:
            self._due.append(DueAction(self._repeat_at_s, ruling, True, held))
            self._repeat_at_s += self._arr_s
