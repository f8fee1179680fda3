"""Enrolled users of a bundle, and their own rules."""

from collections.abc import Mapping as AbstractMapping
from dataclasses import dataclass, field, replace
from typing import Final

from controller.recognition.mapping import Mapping, MappingError

NETWORK: Final = "user.onnx"  # a part of the bundle
ANYBODY: Final = 0  # the network's output for people who are not enrolled


@dataclass(frozen=True, slots=True)
class Users:
    """The users of a bundle; without names it has none.

    Attributes:
        names: In the order of the network's outputs from 1 on.
        gestures: Labels whose windows are evidence.
        temperature: Divides the evidence of a gesture, which is a mean of log probabilities.
        accept: Probability from which on a user is named.
        stay: Probability that one gesture and the next are the same user's.
        forget_s: Time without a touch after which the user is unknown.
        heads: Users with a gesture network of their own.
        mappings: Rules of single users, in place of the bundle's.
    """

    names: tuple[str, ...] = field(
        default=(),
        metadata={
            "pattern": "[A-Za-z0-9]{1,40}",  # as recordings name users, and fits a packet
            "count": (1, 32),
            "expected": "1 to 32 different names of letters and digits",
        },
    )
    gestures: tuple[str, ...] = field(default=(), metadata={"count": (1, 64)})
    temperature: float = field(default=1.0, metadata={"range": (0.01, 100.0)})
    accept: float = field(default=0.9, metadata={"range": (0.0, 1.0)})
    stay: float = field(default=0.98, metadata={"range": (0.0, 1.0)})
    forget_s: float = field(default=30.0, metadata={"range": (0.1, 1e6)})
    heads: tuple[str, ...] = ()
    mappings: AbstractMapping[str, Mapping] = field(
        default_factory=dict, metadata={"key": "mapping"}
    )

    def mapping(self, user: str, of_all: Mapping) -> Mapping:
        """Return what a user's gestures mean; "" and people without rules have those of all."""
        own = self.mappings.get(user)
        return of_all if own is None else of_all.overridden(own)

    def overridden(self, other: Mapping, people: AbstractMapping[str, Mapping]) -> "Users":
        """Return these people with other rules.

        Args:
            other: Goes over everybody's own rules.
            people: Goes over that, for single people.

        Raises:
            MappingError: One of them is not among these.
        """
        made = {name: mapping.overridden(other) for name, mapping in self.mappings.items()}
        for name, own in people.items():
            if name not in self.names:
                known = ", ".join(self.names) or "nobody (docs/users.md)"
                raise MappingError(f"[users] has rules for {name!r}, but the bundle knows {known}")
            made[name] = made.get(name, Mapping()).overridden(own)
        return replace(self, mappings=made)

    def commands(self, of_all: Mapping) -> tuple[str, ...]:
        """Return the commands to announce: what anybody's gestures may ask for."""
        tables = [of_all, *(self.mapping(name, of_all) for name in self.names)]
        return tuple(dict.fromkeys(name for table in tables for name in table.commands))


NOBODY: Final = Users()


def head_part(name: str) -> str:
    """Return the part of a bundle that holds a user's own gesture network."""
    return f"gesture-{name}.onnx"
