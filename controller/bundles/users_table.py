"""Parse enrolled users and their own rules: [users] of a bundle's manifest, and mapping files.

    [users]
    names = ["ann", "bob"]        # outputs 1, 2, ... of the user network; output 0: not enrolled
    gestures = ["press", "pinch"] # windows of these gestures are evidence
    temperature = 0.8             # divides the network's evidence
    accept = 0.9                  # a user of this probability is named
    stay = 0.98                   # probability that the next gesture is the same user's
    forget_s = 30.0               # after this time without touch, the user is unknown

    [users.strength]              # touch strength, in place of the bundle's
    ann = 0.4

    [users.mapping.bob]           # in place of the same labels of [mapping]
    pinch = "hold"

Without the part user.onnx, users are not identified by their touch, and `controller --user NAME`
names them. Identification is a convenience, not authentication: docs/users.md.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from controller.recognition.mapping import USERS, Mapping, MappingError
from controller.recognition.mapping import parse as parse_mapping
from controller.recognition.user_id import NO_USERS, Users
from controller.shared import config, files
from controller.shared.config import ConfigError
from controller.shared.touch_strength import LEAST, MOST


def parse(table: Any, labels: Sequence[str]) -> Users:
    """Return the users in a table [users], None if there is none; ConfigError if it is none."""
    if table is None:
        return NO_USERS
    if not isinstance(table, dict):
        raise ConfigError(f"has users = {table!r}; expected is a table [users]")
    required: dict[str, Any] = {"names": [], "gestures": []}
    users = config.settings(Users, {**required, **table, "mapping": {}, "strength": {}}, "users")
    if len({name.lower() for name in users.names}) < len(users.names):
        raise ConfigError(f"names {', '.join(users.names)} as users, two of them alike")
    if odd := [word for word in users.gestures if word not in labels[1:]]:
        raise ConfigError(f"has {odd[0]!r} among the gestures under [users], which is unknown")
    mappings = _mappings(table.get("mapping", {}), users.names, labels)
    strengths = _strengths(table.get("strength", {}), users.names)
    return replace(users, mappings=mappings, strengths=strengths)


def _mappings(value: Any, names: Sequence[str], labels: Sequence[str]) -> dict[str, Mapping]:
    if not isinstance(value, dict) or not all(isinstance(own, dict) for own in value.values()):
        raise ConfigError("has a [users.mapping] that holds anything but a table for each name")
    mappings: dict[str, Mapping] = {}
    for name, own in value.items():
        if name not in names:
            raise ConfigError(f"has [users.mapping.{name}], but {name!r} is not among the names")
        try:
            mappings[name] = parse_mapping(own, labels)
        except MappingError as error:
            raise ConfigError(
                f"has a [users.mapping.{name}] that cannot be used: {error}"
            ) from None
    return mappings


def _strengths(value: Any, names: Sequence[str]) -> dict[str, float]:
    if not isinstance(value, dict) or not set(value) <= set(names):
        raise ConfigError("has a [users.strength] that holds anything but a number for a name")
    for name, own in value.items():
        if type(own) not in (int, float) or not LEAST <= own <= MOST:
            raise ConfigError(
                f"has {name} = {own!r} under [users.strength]; expected is a number "
                f"from {LEAST:g} to {MOST:g}"
            )
    return {name: float(own) for name, own in value.items()}


def read_mapping(path: Path, labels: Sequence[str]) -> tuple[Mapping, dict[str, Mapping]]:
    """Return the mapping in a TOML file, and those of its [users.NAME]; UserError if it cannot."""
    table = config.checked(path, dict, MappingError, "orbtouch docs mapping")
    users = table.pop(USERS, {})
    if not isinstance(users, dict) or not all(isinstance(own, dict) for own in users.values()):
        raise MappingError(f"{path}: [{USERS}] holds anything but a table for each name")
    mappings = []
    sections = {"": table, **{f"{USERS}.{name}": own for name, own in users.items()}}
    for section, rules in sections.items():
        try:
            mappings.append(parse_mapping(rules, labels))
        except MappingError as error:
            line = _line(path, section, error)
            raise MappingError(f"{path}{line}: {error} (orbtouch docs mapping)") from None
    return mappings[0], dict(zip(users, mappings[1:], strict=True))


def _line(path: Path, section: str, error: MappingError) -> str:
    """Return ", line N" of an error, "" if it cannot be found."""
    text = files.read_text(path, config.MAX_BYTES)
    named = f"{section}.{error.label}".strip(".")
    return config.line_of(text, named, count=error.rule or 1) or config.line_of(
        text, section, error.label
    )
