"""Bindings of keys and pad buttons: names for files and screens, and the defaults.

A binding is written down by name (`space`, `pad_a`), because pygame's numbers mean nothing to
a reader. Keys are numbers to `tetris.kit.keys`, pad buttons stay names.
"""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from types import MappingProxyType
from typing import Final

import pygame

from tetris.kit.keys import Action, Code

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


def _names(kind: str) -> Names:
    return MappingProxyType({action: tuple(names) for action, names in _DEFAULTS[kind].items()})


KEYS: Final = _names("keys")
PADS: Final = _names("pads")
ACTIONS: Final = tuple(KEYS)
"""Names of all that can be bound, in the order of the screen on which it is."""


def key_name(code: int) -> str | None:
    """Return a key's name for files; None for keys that have none."""
    return _KEY_NAMES.get(code)


def is_name(name: str) -> bool:
    """Return whether a name means a key or a pad button."""
    return name in _KEY_CODES or name.startswith(("pad_", "stick_"))


def caption(name: str) -> str:
    """Return what to write on the screen for a key or a button."""
    if name in _CAPS:
        return _CAPS[name]
    if name.startswith("pad_"):
        name = name.removeprefix("pad_")
        return _CAPS.get(name, name.title())
    if name.startswith("stick_"):
        return "Stick " + _CAPS.get(name.removeprefix("stick_"), "")
    return name.replace("kp", "Num ", 1).replace("_", " ").title()


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
