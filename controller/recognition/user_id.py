"""Bayesian user identification over successive gestures, and the enrolled users.

The user network runs on every window of a touch; the first ones are the best evidence, so it does
not wait for the label. At the end of a gesture the mean of the log probabilities, over a
temperature, is its evidence: windows share most of their frames, so many of them are hardly more
evidence than a few. The user may change between gestures, so the posterior is mixed with a uniform
one each time, and reset after a long time without touch.
"""

import math
from collections.abc import Mapping as AbstractMapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.mapping import Mapping, MappingError
from controller.shared.aliases import State

NOT_ENROLLED: Final = 0  # the network's output for users who are not enrolled
MIN_PROBABILITY: Final = 1e-6  # of each user in one window

Belief = NDArray[np.float64]  # (1 + users,), not enrolled first, sums to 1


@dataclass(frozen=True, slots=True)
class Users:
    """The enrolled users of a bundle; without names there are none.

    Attributes:
        names: In the order of the network's outputs from 1 on.
        gestures: Labels whose windows are evidence.
        temperature: Divides the evidence of a gesture, which is a mean of log probabilities.
        accept: Least probability at which a user is identified.
        stay: Probability that one gesture and the next are by the same user.
        forget_s: Time without touch after which the posterior is reset, seconds.
        mappings: Rules of single users, in place of those of the bundle.
        strengths: Touch strengths of single users, in place of that of the bundle.
    """

    names: tuple[str, ...] = field(
        default=(),
        metadata={
            "pattern": "[A-Za-z0-9]{1,40}",  # as in recordings; fits a packet
            "count": (1, 32),
            "expected": "1 to 32 different names of letters and digits",
        },
    )
    gestures: tuple[str, ...] = field(default=(), metadata={"count": (1, 64)})
    temperature: float = field(default=1.0, metadata={"range": (0.01, 100.0)})
    accept: float = field(default=0.9, metadata={"range": (0.0, 1.0)})
    stay: float = field(default=0.98, metadata={"range": (0.0, 1.0)})
    forget_s: float = field(default=30.0, metadata={"range": (0.1, 1e6)})
    mappings: AbstractMapping[str, Mapping] = field(
        default_factory=dict, metadata={"key": "mapping"}
    )
    strengths: AbstractMapping[str, float] = field(
        default_factory=dict, metadata={"key": "strength"}
    )

    def mapping(self, user: str, common: Mapping) -> Mapping:
        """Return the mapping of a user: the common one, overridden by rules of the user."""
        own = self.mappings.get(user)
        return common if own is None else common.overridden(own)

    def overridden(self, other: Mapping, single: AbstractMapping[str, Mapping]) -> "Users":
        """Return these users with other rules.

        Args:
            other: Overrides the rules of all users.
            single: Overrides both, for single users.

        Raises:
            MappingError: A user is not enrolled.
        """
        made = {name: mapping.overridden(other) for name, mapping in self.mappings.items()}
        for name, own in single.items():
            if name not in self.names:
                known = ", ".join(self.names) or "none (orbtouch docs users)"
                raise MappingError(f"[users] has rules for {name!r}; enrolled are {known}")
            made[name] = made.get(name, Mapping()).overridden(own)
        return replace(self, mappings=made)

    def commands(self, common: Mapping) -> tuple[str, ...]:
        """Return the commands to announce: those of all users."""
        tables = [common, *(self.mapping(name, common) for name in self.names)]
        return tuple(dict.fromkeys(name for table in tables for name in table.commands))


NO_USERS: Final = Users()


def evidence(probabilities: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return outputs of the user network as log probabilities, (..., 1 + users)."""
    return np.asarray(np.log(np.maximum(probabilities, MIN_PROBABILITY)), dtype=np.float64)


def update_belief(belief: Belief, mean: NDArray[np.float64], users: Users) -> Belief:
    """Return the posterior after one more gesture, (1 + users,).

    Args:
        belief: Posterior before it, (1 + users,).
        mean: Mean `evidence` of its windows, (1 + users,).
        users: Temperature and transition probability.
    """
    prior = users.stay * belief + (1.0 - users.stay) / len(belief)
    log = np.log(np.maximum(prior, 1e-300)) + mean / users.temperature
    power = np.exp(log - log.max())
    return np.asarray(power / power.sum())


def uniform_belief(users: Users) -> Belief:
    """Return the prior, (1 + users,): all are equally probable."""
    count = 1 + len(users.names)
    return np.full(count, 1.0 / count)


def identify(belief: Belief, users: Users, before: int = NOT_ENROLLED) -> int:
    """Return the number of the identified user for a posterior, (1 + users,).

    It is `NOT_ENROLLED` if none is probable enough. The user `before` needs only to be the most
    probable one.
    """
    best = int(np.argmax(belief))
    return best if best in (NOT_ENROLLED, before) or belief[best] >= users.accept else NOT_ENROLLED


class UserIdentifier:
    """Identification of the user over one session.

    Attributes:
        name: The identified user, "" if none.
        confidence: Probability of that user; without one, of the most probable user.
    """

    def __init__(self, users: Users, rate_hz: float) -> None:
        """Begin with the prior."""
        self._users = users
        self._forget_frames = math.ceil(users.forget_s * rate_hz)
        self._belief = uniform_belief(users)
        self._sum = np.zeros(1 + len(users.names))
        self._windows = 0
        self._counts = False
        self._idle = 0
        self._number = NOT_ENROLLED
        self._name()

    def step(self, probabilities: NDArray[np.floating] | None, *, counts: bool = True) -> None:
        """Take one frame.

        Args:
            probabilities: Output of the user network for its window, (1 + users,), during a touch;
                None between touches.
            counts: The label is one of `Users.gestures`.
        """
        if probabilities is not None:
            self._sum += evidence(probabilities)
            self._windows += 1
            self._counts |= counts
            self._idle = 0
            return
        if self._windows:
            self._end()
        self._idle = min(self._idle + 1, self._forget_frames)
        if self._idle == self._forget_frames and not np.array_equal(
            self._belief, uniform_belief(self._users)
        ):
            self._belief = uniform_belief(self._users)
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
        belief, total = state["belief"], state["sum"]
        sound = np.isfinite(belief).all() and (belief >= 0.0).all() and belief.sum() > 0.0
        counts = state["counts"]
        sound &= bool((counts >= 0.0).all() and counts[3] < len(belief))
        if not sound or not all(np.isfinite(array).all() for array in (total, counts)):
            raise ValueError("the state of user identification is damaged")
        self._belief, self._sum = belief.copy(), total.copy()
        self._windows, self._idle, self._number = (int(counts[i]) for i in (0, 2, 3))
        self._counts = bool(counts[1])
        self._name()

    def _name(self) -> None:
        self._number = number = identify(self._belief, self._users, self._number)
        self.name = self._users.names[number - 1] if number != NOT_ENROLLED else ""
        self.confidence = float(self._belief[1:].max())

    def _end(self) -> None:
        """Add the evidence of the touch that has ended, if it was a gesture."""
        if self._counts:
            self._belief = update_belief(self._belief, self._sum / self._windows, self._users)
            self._name()
        self._sum[:] = 0.0
        self._windows, self._counts = 0, False
