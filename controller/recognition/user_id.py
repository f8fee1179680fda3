"""Bayesian user identification: evidence of each gesture, gathered over successive gestures.

While something is made, the user network is asked with every window; the first ones tell most, so
it does not wait until the gesture is known. If one was, the mean of the log probabilities, over a
temperature, is its evidence when it ends: windows share most of their frames, so many
of them say hardly more than a few. Before the next gesture somebody else may have sat down, so
what was believed fades a little each time, and is forgotten when nobody touched for long.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.preprocess import State
from controller.recognition.users import ANYBODY, Users

LEAST: Final = 1e-6  # no window makes anybody less probable than that

Belief = NDArray[np.float64]  # (1 + users,), anybody else first, sums to 1


def evidence(people: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return what windows say, as log probabilities; any shape (..., 1 + users)."""
    return np.asarray(np.log(np.maximum(people, LEAST)), dtype=np.float64)


def believe(belief: Belief, said: NDArray[np.float64], users: Users) -> Belief:
    """Return what is believed after one more gesture.

    Args:
        belief: Before it, of who made the gesture before.
        said: The mean of its windows' `evidence`, (1 + users,).
        users: Temperature, and how probably the same person goes on.
    """
    prior = users.stay * belief + (1.0 - users.stay) / len(belief)
    log = np.log(np.maximum(prior, 1e-300)) + said / users.temperature
    power = np.exp(log - log.max())
    return np.asarray(power / power.sum())


def nothing(users: Users) -> Belief:
    """Return what is believed before any gesture: everybody is as probable as anybody else."""
    count = 1 + len(users.names)
    return np.full(count, 1.0 / count)


def named(belief: Belief, users: Users, before: int = ANYBODY) -> int:
    """Return the output of who is named; `ANYBODY` if nobody is probable enough.

    Who was named before stays so while nobody else is more probable.
    """
    best = int(np.argmax(belief))
    return best if best in (ANYBODY, before) or belief[best] >= users.accept else ANYBODY


class UserIdentifier:
    """Watches one session, and says who touches.

    Attributes:
        name: Who touched last, "" if that is not known.
        confidence: How probable that is; of nobody in particular, the most probable person's.
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
        self._tell()

    def step(self, people: NDArray[np.floating] | None, *, counts: bool = True) -> None:
        """Take one frame.

        Args:
            people: What the user network says of its window, (1 + users,), while something is
                made; None between gestures.
            counts: It is known to be a gesture that tells; a brush or a resting hand tells nothing.
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
            self._tell()

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
        self._tell()

    def _tell(self) -> None:
        self._number = number = named(self._belief, self._users, self._number)
        self.name = self._users.names[number - 1] if number != ANYBODY else ""
        self.confidence = float(self._belief[1:].max())

    def _end(self) -> None:
        """Take what was said of the gesture that has ended."""
        if self._counts:
            self._belief = believe(self._belief, self._sum / self._windows, self._users)
            self._tell()
        self._sum[:] = 0.0
        self._windows, self._counts = 0, False
