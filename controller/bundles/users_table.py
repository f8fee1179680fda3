"""The table [users] of a bundle's manifest: enrolled users and their own rules.

    [users]
    names = ["ann", "bob"]        # outputs 1, 2, ... of the user network; 0 is anybody else
    gestures = ["press", "pinch"] # whose windows are evidence
    temperature = 0.8             # divides the network's evidence
    accept = 0.9                  # probability from which a user is named
    stay = 0.98                   # that the same user makes the next gesture
    forget_s = 30.0               # untouched for so long, the user is forgotten
    heads = ["ann"]               # users with a gesture network of their own: gesture-ann.onnx

    [users.mapping.bob]           # in place of the same labels of [mapping]
    pinch = "hold"

Where user.onnx is empty, users are not identified by their touch, and only `controller --user NAME`
names the player. It is a convenience, never a lock: docs/users.md.
"""

import re
from collections.abc import Sequence
from typing import Any, Final

from controller.recognition.mapping import Mapping, MappingError
from controller.recognition.mapping import parse as parse_mapping
from controller.recognition.user_id import NOBODY, Users

NETWORK: Final = "user.onnx"  # a part of the bundle
MOST: Final = 32  # people in a bundle
_NAME: Final = r"[A-Za-z0-9]{1,40}"  # as recordings name people, and fits a packet
_RANGES: Final[dict[str, tuple[float, float]]] = {
    "temperature": (0.01, 100.0),
    "accept": (0.0, 1.0),
    "stay": (0.0, 1.0),
    "forget_s": (0.1, 1e6),
}
_REQUIRED: Final = frozenset({"names", "gestures", *_RANGES})
_OPTIONAL: Final = frozenset({"heads", "mapping"})


class UsersError(ValueError):
    """The table cannot be used; the message says why, without a subject."""


def head_part(name: str) -> str:
    """Return the part of a bundle that holds a user's own gesture network."""
    return f"gesture-{name}.onnx"


def parse(table: Any, labels: Sequence[str]) -> Users:
    """Return the users that [users] describes, every field checked.

    Args:
        table: What TOML made of it; None if there is none.
        labels: The gestures of the bundle, "null" first.

    Raises:
        UsersError: It cannot be used.
    """
    if table is None:
        return NOBODY
    if not isinstance(table, dict):
        raise UsersError(f"has users = {table!r}; expected is a table [users]")
    fields = set(table)
    if odd := (_REQUIRED - fields) | (fields - _REQUIRED - _OPTIONAL):
        raise UsersError(
            f"has a [users] of another version of this program ({', '.join(sorted(odd))}); "
            "update one"
        )
    names = _words(table, "names", None)
    if not 1 <= len(names) <= MOST or not all(re.fullmatch(_NAME, name) for name in names):
        raise UsersError(f"names {names!r} as users; expected are 1 to {MOST} of letters, digits")
    if len({name.lower() for name in names}) < len(names):
        raise UsersError(f"names {names!r} as users, two of them alike")
    gestures = _words(table, "gestures", labels[1:])
    if not gestures:
        raise UsersError("has no gesture that tells its users; expected is one at least")
    numbers = {name: _number(table[name], name) for name in _RANGES}
    heads = _words({"heads": [], **table}, "heads", names)
    return Users(names, gestures, **numbers, heads=heads, mappings=_mappings(table, names, labels))


def _words(table: dict[str, Any], key: str, known: Sequence[str] | None) -> tuple[str, ...]:
    """Return a list of different words, each of them known."""
    value = table[key]
    if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
        raise UsersError(f"has {key} = {value!r} under [users]; expected is a list of words")
    seen: set[str] = set()
    for word in value:
        if word in seen or (known is not None and word not in known):
            raise UsersError(
                f"has {word!r} among the {key} under [users], which is there twice or unknown"
            )
        seen.add(word)
    return tuple(value)


def _number(value: Any, name: str) -> float:
    low, high = _RANGES[name]
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    if not plain or not low <= value <= high:
        raise UsersError(
            f"has {name} = {value!r} under [users]; expected is a number from {low:g} to {high:g}"
        )
    return float(value)


def _mappings(
    table: dict[str, Any], names: Sequence[str], labels: Sequence[str]
) -> dict[str, Mapping]:
    value = table.get("mapping", {})
    if not isinstance(value, dict) or not all(isinstance(own, dict) for own in value.values()):
        raise UsersError("has a [users.mapping] that holds anything but a table for each name")
    made: dict[str, Mapping] = {}
    for name, own in value.items():
        if name not in names:
            raise UsersError(f"has [users.mapping.{name}], but {name!r} is not among the names")
        try:
            made[name] = parse_mapping(own, labels)
        except MappingError as error:
            raise UsersError(f"has a [users.mapping.{name}] that cannot be used: {error}") from None
    return made
