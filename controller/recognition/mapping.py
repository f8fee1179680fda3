"""Mapping of gestures to commands, from TOML: a label, or a label and a region, to a command.

docs/mapping.md describes the format for users. In short:

    pinch = "drop"            # wherever the gesture is made

    [[press]]                 # rules in order: the first one that fits
    command = "down"
    below = 1.3334            # y < 1.3334, grid units; also above, left_of, right_of

    [[press]]                 # the last one has no region and takes what is left
    command = "right"

The command "none" does nothing on purpose.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from controller.shared.errors import UserError
from controller.shared.protocol.messages import COMMANDS

NONE = "none"  # the command without an effect
ALWAYS = COMMANDS[:6]  # announced even if the mapping does not use them
USERS = "users"  # the table of single users' rules in a file
_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")  # 40 characters fit in a packet
_REGION = ("left_of", "right_of", "below", "above")


class MappingError(UserError, ValueError):
    """The mapping cannot be used; the message names the entry and the expected value.

    Attributes:
        label: The gesture whose entry is wrong.
        rule: Number of its wrong rule, from 1; 0: the entry as a whole.
    """

    def __init__(self, message: str, label: str = "", rule: int = 0) -> None:
        super().__init__(message)
        self.label, self.rule = label, rule


@dataclass(frozen=True, slots=True)
class Rule:
    """A command, and the region of touches that it applies to; grid units.

    Attributes:
        command: Its name; "none": no command.
        left_of: x is less than this.
        right_of: x is this or more.
        below: y is less than this.
        above: y is this or more.
    """

    command: str
    left_of: float = math.inf
    right_of: float = -math.inf
    below: float = math.inf
    above: float = -math.inf

    @property
    def everywhere(self) -> bool:
        """Whether the rule has no region."""
        return self == Rule(self.command)

    def fits(self, touch: tuple[float, float] | None) -> bool:
        """Return whether the touch (x, y) is in the region; without one, only "everywhere" is."""
        if touch is None:
            return self.everywhere
        x, y = touch
        return self.right_of <= x < self.left_of and self.above <= y < self.below


@dataclass(frozen=True, slots=True)
class Mapping:
    """Rules by gesture. A label without rules has no command."""

    rules: dict[str, tuple[Rule, ...]] = field(default_factory=dict)

    def command(self, label: str, touch: tuple[float, float] | None) -> str | None:
        """Return the command of a gesture at a touch, None if it has none."""
        for rule in self.rules.get(label, ()):
            if rule.fits(touch):
                return None if rule.command == NONE else rule.command
        return None

    @property
    def commands(self) -> tuple[str, ...]:
        """The commands to announce: the six that every orb offers, then others in use."""
        used = [rule.command for rules in self.rules.values() for rule in rules]
        return tuple(dict.fromkeys([*ALWAYS, *(name for name in used if name != NONE)]))

    def overridden(self, other: "Mapping") -> "Mapping":
        """Return this mapping with the labels of another in place of its own."""
        return Mapping({**self.rules, **other.rules})


def parse(table: dict[str, Any], labels: Sequence[str]) -> Mapping:
    """Return the mapping that a TOML table describes.

    Args:
        table: Label to command, or label to a list of rules, as in this module's docstring.
        labels: The gestures of the bundle, "null" first.

    Raises:
        MappingError: A label is unknown, a rule malformed, or one can never fit.
    """
    known = labels[1:]
    for label in table:
        if label not in known:
            names = ", ".join(known)
            raise MappingError(f"the gesture {label!r} is unknown; known are {names}", label)
    return Mapping({label: _rules(label, value) for label, value in table.items()})


def _rules(label: str, value: Any) -> tuple[Rule, ...]:
    """Return the rules of one label: those of a list, or one for a single command."""
    if not isinstance(value, list):
        return (Rule(_command(label, value, label)),)
    if not value:
        raise MappingError(
            f"{label} has no rules; write {label} = {NONE!r} to have it do nothing", label
        )
    rules = tuple(_rule(label, number, entry) for number, entry in enumerate(value, 1))
    for number, rule in enumerate(rules, 1):
        if rule.everywhere != (number == len(rules)):
            raise MappingError(
                f"{label}, rule {number} of {len(rules)}: the last rule, and no other, "
                "has no region and takes every touch that is left",
                label,
                number,
            )
    return rules


def _rule(label: str, number: int, entry: Any) -> Rule:
    """Return one rule of a list."""
    where = f"{label}, rule {number}"

    def wrong(message: str) -> MappingError:
        return MappingError(f"{where}: {message}", label, number)

    if not isinstance(entry, dict):
        raise wrong(f"{entry!r} is no table; write [[{label}]] above each rule")
    region = {key: value for key, value in entry.items() if key != "command"}
    for key, value in region.items():
        if key not in _REGION:
            raise wrong(f"{key!r} is unknown; a region has {', '.join(_REGION)}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
            raise wrong(f"{key} is {value!r}, not a number of grid units")
    rule = Rule(_command(where, entry.get("command"), label, number), **region)
    if rule.left_of <= rule.right_of or rule.below <= rule.above:
        raise wrong("its region is empty, so it can never fit")
    return rule


def _command(where: str, name: Any, label: str, number: int = 0) -> str:
    """Return the name of a command, checked. Programs may have further commands."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise MappingError(
            f"{where}: {name!r} is no command; it is a name in small letters, such as "
            f"{', '.join(COMMANDS)}, or {NONE}",
            label,
            number,
        )
    return name
