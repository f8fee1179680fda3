"""Bindings of keys and pad buttons, and their auto-repeat: presses and time in, actions out.

A binding is written down by name (`space`, `pad_a`), because pygame's numbers mean nothing to
a reader. Keys are numbers to `Keys`, pad buttons stay names. A held shift repeats: once on the
press, again after the delayed auto shift (DAS), then at the auto repeat rate (ARR). Of two held
directions the later one rules. Held soft drop is a state, because only the engine knows how fast it
falls.
"""

import tomllib
from collections.abc import Collection, Iterable, Mapping, Sequence
from enum import Enum
from importlib.resources import files
from types import MappingProxyType
from typing import Final, Generic, NamedTuple, TypeVar

import pygame

from tetris.kit.language import Words

Code = int | str  # a pygame key, or the name of a pad's button
Action = TypeVar("Action", bound=Enum)  # the application's; a value is its name in bindings
Names = Mapping[str, Sequence[str]]  # from an action's name to names of keys or buttons

HINT: Final = "hint"  # what the window does by itself, without the engine
_KEY_CODES: Final[Mapping[str, int]] = {
    name[2:].lower(): getattr(pygame, name)
    for name in sorted(dir(pygame))
    if name.startswith("K_") and name != "K_UNKNOWN"
}
_KEY_NAMES: Final[Mapping[int, str]] = {code: name for name, code in _KEY_CODES.items()}

_DEFAULTS: Final = tomllib.loads((files("assets") / "tetris" / "bindings.toml").read_text("utf-8"))
_CAPS: Final[Mapping[str, str]] = _DEFAULTS["captions"]


def names(kind: str) -> Names:
    """Return a table of the file: `keys` and `pads` of actions, `menu` and `orb` of menu steps."""
    return MappingProxyType({action: tuple(given) for action, given in _DEFAULTS[kind].items()})


KEYS: Final = names("keys")
PADS: Final = names("pads")
BUTTONS: Final[Mapping[int, str]] = {
    getattr(pygame, f"CONTROLLER_BUTTON_{theirs}"): f"pad_{ours}"
    for ours, theirs in _DEFAULTS["buttons"].items()
}
"""Names of a pad's buttons, by their numbers."""
ACTIONS: Final = tuple(KEYS)
"""Names of all that can be bound, in the order of the screen on which it is."""


def key_name(code: int) -> str | None:
    """Return a key's name for files; None for keys that have none."""
    return _KEY_NAMES.get(code)


def is_name(name: str) -> bool:
    """Return whether a name means a key or a pad button."""
    return name in _KEY_CODES or name.startswith(("pad_", "stick_"))


def caption(name: str, words: Words) -> str:
    """Return what to write on the screen for a key or a button."""
    name = name.removeprefix("pad_")
    said = words(key := f"key.{name}")
    if said != key or name in _CAPS:
        return said if said != key else _CAPS[name]
    if "_" in name:
        return " ".join(caption(part, words) for part in name.split("_"))
    return name.replace("kp", "Num ", 1).title()


def table(kinds: Iterable[Action], *bindings: Names) -> dict[Code, Action]:
    """Return the action of each key and button; names that mean nothing are left out."""
    actions = {action.value: action for action in kinds}
    return {
        _KEY_CODES.get(name, name): actions[action]
        for names in bindings
        for action, bound in names.items()
        if action in actions
        for name in bound
        if is_name(name)
    }


def codes(action: str, *bindings: Names) -> frozenset[Code]:
    """Return the keys and buttons of one action."""
    return frozenset(
        _KEY_CODES.get(name, name) for names in bindings for name in names.get(action, ())
    )


def bound(names: Names, action: str, name: str) -> dict[str, tuple[str, ...]]:
    """Return bindings with one more; what the key or button did before is taken from it."""
    freed = {other: tuple(each for each in given if each != name) for other, given in names.items()}
    freed[action] = (*freed.get(action, ()), name)
    return freed


def unbound(names: Names, action: str) -> dict[str, tuple[str, ...]]:
    """Return bindings without the last one of an action."""
    freed = {other: tuple(given) for other, given in names.items()}
    freed[action] = freed.get(action, ())[:-1]
    return freed


# -- auto-repeat --------------------------------------------------------------------------------

_AT_ONCE: Final = 9  # shifts from one wall to the other: what an ARR of 0 gives


class DueAction(NamedTuple, Generic[Action]):
    """An action that is due, and since when."""

    time_s: float
    action: Action
    repeated: bool = False  # by a held key; then it is no command
    held: frozenset[Action] = frozenset()  # whose keys were down then, this one's included


class Keys(Generic[Action]):
    """Turns presses into actions. Feed it `press` and `release`, ask `due` every frame."""

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
