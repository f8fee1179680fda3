"""Bayesian user identification over successive gestures, and the enrolled users.

While something is made, the user network sees every window; the first ones are the best evidence,
so it does not wait until the gesture is known. If one was, the mean of the log probabilities, over
a temperature, is its evidence when it ends: windows share most of their frames, so many of them are
hardly more evidence than a few. Before the next gesture another user may have sat down, so the
belief fades a little each time, and is forgotten after a long time without touch.
"""

import math
from collections.abc import Mapping as AbstractMapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.frames import State
from controller.recognition.mapping import Mapping, MappingError

ANYBODY: Final = 0  # the network's output for people who are not enrolled
LEAST: Final = 1e-6  # no window makes anybody less probable than that

Belief = NDArray[np.float64]  # (1 + users,), anybody else first, sums to 1


@dataclass(frozen=True, slots=True)
class Users:
    """The enrolled users of a bundle; without names there are none.

    Attributes:
        names: In the order of the network's outputs from 1 on.
        gestures: Labels whose windows are evidence.
        temperature: Divides the evidence of a gesture, which is a mean of log probabilities.
        accept: Probability from which on a person is named.
        stay: Probability that one gesture and the next are the same person's.
        forget_s: Time without touch after which the belief is forgotten, seconds.
        heads: Users with a gesture network of their own.
        mappings: Rules of single users, in place of the bundle's own.
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


def evidence(people: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return outputs of the user network as log probabilities, (..., 1 + users)."""
    return np.asarray(np.log(np.maximum(people, LEAST)), dtype=np.float64)


def believe(belief: Belief, said: NDArray[np.float64], users: Users) -> Belief:
    """Return the belief after one more gesture, (1 + users,).

    Args:
        belief: About the gesture before, (1 + users,).
        said: The mean of its windows' `evidence`, (1 + users,).
        users: Temperature, and how probably the same person goes on.
    """
    prior = users.stay * belief + (1.0 - users.stay) / len(belief)
    log = np.log(np.maximum(prior, 1e-300)) + said / users.temperature
    power = np.exp(log - log.max())
    return np.asarray(power / power.sum())


def nothing(users: Users) -> Belief:
    """Return the belief before any gesture, (1 + users,): all are equally probable."""
    count = 1 + len(users.names)
    return np.full(count, 1.0 / count)


def named(belief: Belief, users: Users, before: int = ANYBODY) -> int:
    """Return the output of the user to name; `ANYBODY` if none is probable enough.

    The user named before stays so while no other is more probable.
    """
    best = int(np.argmax(belief))
    return best if best in (ANYBODY, before) or belief[best] >= users.accept else ANYBODY


class UserIdentifier:
    """Identification of the user over one session.

    Attributes:
        name: The user who touched last, "" if that is not known.
        confidence: How probable that is; without a name, of the most probable user.
    """

    def __init__(self, users: Users, rate_hz: float) -> None:
        """Know nothing yet."""
        self._users = users
        self._patience = math.ceil(users.forget_s * rate_hz)
        self._belief = nothing(users)
        self._sum = np.zeros(1 + len(users.names))
        self._windows = 0
        self._counts = False
        self._idle = 0
        self._number = ANYBODY
        self._name()

    def step(self, people: NDArray[np.floating] | None, *, counts: bool = True) -> None:
        """Take one frame.

        Args:
            people: Output of the user network for its window, (1 + users,), while something is
                made; None between gestures.
            counts: It is known to be a gesture that is evidence; a brush or a resting hand is none.
        """
        if people is not None:
            self._sum += evidence(people)
            self._windows += 1
            self._counts |= counts
            self._idle = 0
            return
        if self._windows:
            self._end()
        self._idle = min(self._idle + 1, self._patience)
        if self._idle == self._patience and not np.array_equal(self._belief, nothing(self._users)):
            self._belief = nothing(self._users)
            self._name()

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        return {
            "belief": self._belief.copy(),
            "sum": self._sum.copy(),
            "counts": np.array(
                [self._windows, self._counts, self._idle, self._number], dtype=np.float64
            ),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken.

        Raises:
            ValueError: It is damaged.
        """
        belief, said = state["belief"], state["sum"]
        sound = np.isfinite(belief).all() and (belief >= 0.0).all() and belief.sum() > 0.0
        counts = state["counts"]
        sound &= bool((counts >= 0.0).all() and counts[3] < len(belief))
        if not sound or not all(np.isfinite(array).all() for array in (said, counts)):
            raise ValueError("the state holds a belief that is none")
        self._belief, self._sum = belief.copy(), said.copy()
        self._windows, self._idle, self._number = (int(counts[i]) for i in (0, 2, 3))
        self._counts = bool(counts[1])
        self._name()

    def _name(self) -> None:
        self._number = number = named(self._belief, self._users, self._number)
        self.name = self._users.names[number - 1] if number != ANYBODY else ""
        self.confidence = float(self._belief[1:].max())

    def _end(self) -> None:
        """Take what was said of the gesture that has ended."""
        if self._counts:
            self._belief = believe(self._belief, self._sum / self._windows, self._users)
            self._name()
        self._sum[:] = 0.0
        self._windows, self._counts = 0, False
