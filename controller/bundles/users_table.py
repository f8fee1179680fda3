"""The table [users] of a bundle's manifest: enrolled users and their own rules.

    [users]
    names = ["ann", "bob"]        # outputs 1, 2, ... of the user network; output 0 is anybody else
    gestures = ["press", "pinch"] # windows of these gestures are evidence
    temperature = 0.8             # divides the network's evidence
    accept = 0.9                  # a user of this probability is named
    stay = 0.98                   # probability that the next gesture is the same user's
    forget_s = 30.0               # untouched for so long, the user is unknown
    heads = ["ann"]               # users with a gesture network of their own: gesture-ann.onnx

    [users.mapping.bob]           # in place of the same labels of [mapping]
    pinch = "hold"

Where user.onnx is empty, users are not identified by their touch, and `controller --user NAME`
names them. It is a convenience, never a lock: docs/users.md.
"""

import re
from collections.abc import Sequence
from typing import Any, Final

from controller import config
from controller.config import ConfigError
from controller.recognition.mapping import Mapping, MappingError
from controller.recognition.mapping import parse as parse_mapping
from controller.recognition.users import NOBODY, Users

MOST: Final = 32  # users in a bundle
_NAME: Final = r"[A-Za-z0-9]{1,40}"  # as recordings name users, and fits a packet


def parse(table: Any, labels: Sequence[str]) -> Users:
    """Return the users that [users] describes, every field checked.

    Args:
        table: As TOML has it; None if there is none.
        labels: The gestures of the bundle, "null" first.

    Raises:
        ConfigError: It cannot be used; the message has no subject.
    """
    if table is None:
        return NOBODY
    if not isinstance(table, dict):
        raise ConfigError(f"has users = {table!r}; expected is a table [users]")
    names = _words(table, "names", None)
    if not 1 <= len(names) <= MOST or not all(re.fullmatch(_NAME, name) for name in names):
        raise ConfigError(f"names {names!r} as users; expected are 1 to {MOST} of letters, digits")
    if len({name.lower() for name in names}) < len(names):
        raise ConfigError(f"names {names!r} as users, two of them alike")
    lists = {
        "names": names,
        "gestures": _words(table, "gestures", labels[1:]),
        "heads": _words({"heads": [], **table}, "heads", names),
        "mapping": _mappings(table.get("mapping", {}), names, labels),
    }
    if not lists["gestures"]:
        raise ConfigError("has no gesture that tells its users; expected is one at least")
    return config.settings(Users, {**table, **lists}, "users")


def _words(table: dict[str, Any], key: str, known: Sequence[str] | None) -> tuple[str, ...]:
    """Return a list of different words, each of them known; None: any."""
    value = table.get(key)
    if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
        raise ConfigError(f"has {key} = {value!r} under [users]; expected is a list of words")
    seen: set[str] = set()
    for word in value:
        if word in seen or (known is not None and word not in known):
            raise ConfigError(
                f"has {word!r} among the {key} under [users], which is there twice or unknown"
            )
        seen.add(word)
    return tuple(value)


def _mappings(value: Any, names: Sequence[str], labels: Sequence[str]) -> dict[str, Mapping]:
    if not isinstance(value, dict) or not all(isinstance(own, dict) for own in value.values()):
        raise ConfigError("has a [users.mapping] that holds anything but a table for each name")
    made: dict[str, Mapping] = {}
    for name, own in value.items():
        if name not in names:
            raise ConfigError(f"has [users.mapping.{name}], but {name!r} is not among the names")
        try:
            made[name] = parse_mapping(own, labels)
        except MappingError as error:
            raise ConfigError(
                f"has a [users.mapping.{name}] that cannot be used: {error}"
            ) from None
    return made
