"""Hold-out of recordings: whole users or sessions, and what is learned from the others."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.console import count
from models.data import splits
from models.data.splits import Index

Chosen = NDArray[np.bool_]  # (recordings,)

_DRAW: Final = 6  # stream of random numbers of a training's seed


@dataclass(frozen=True, slots=True)
class HoldOut:
    """Hold-out of whole users or sessions.

    Attributes:
        by: "user" or "session".
        folds: Number of folds, each group being held out in one of them; 0: `hold` counts.
        fold: Number of the fold held out, from 0.
        hold: Number of groups held out, evenly spread; or of each user the last sessions.
        enrolled: Sessions of every user are held out, so that all users are learned from.
    """

    by: str
    folds: int = 0
    fold: int = 0
    hold: int = 0
    enrolled: bool = False

    def held(self, user: Index, session: Index) -> Chosen:
        """Return which recordings are held out, (recordings,).

        Args:
            user: User of each recording, (recordings,).
            session: Session of each recording, rising in the order of recording, (recordings,).

        Raises:
            ValueError: There are too few groups, or a user has too few sessions.
        """
        if self.enrolled:
            return self._sessions_of_each(user, session)
        group = user if self.by == "user" else session
        names = np.unique(group)
        self._check(len(names), f"there are {len(names)} {self.by}s")
        parts = (
            np.array_split(names, self.folds) if self.folds else [splits.spread(names, self.hold)]
        )
        return np.isin(group, parts[self.fold])

    def _sessions_of_each(self, user: Index, session: Index) -> Chosen:
        """Return which recordings are held out, (recordings,), of every user."""
        held = np.zeros(len(user), dtype=np.bool_)
        for one in np.unique(user):
            own = np.unique(session[user == one])
            self._check(len(own), f"a user has {count(len(own), 'session')}")
            part = slice(self.fold, None, self.folds) if self.folds else slice(-self.hold, None)
            held |= np.isin(session, own[part])
        return held

    def _check(self, groups: int, found: str) -> None:
        if groups < max(2, self.folds, self.hold + 1):
            wanted = f"{self.folds} folds" if self.folds else f"{self.hold} held out"
            raise ValueError(f"{found}, too few for {wanted}; record more, or hold out fewer")


def learned(
    user: Index, session: Index, held: Chosen, users: int, sessions: int, seed: int
) -> Chosen:
    """Return which recordings are learned from, (recordings,): first sessions of drawn users.

    Args:
        user: User of each recording, (recordings,).
        session: Session of each recording, rising in the order of recording, (recordings,).
        held: Recordings held out, (recordings,).
        users: Number of users; 0: all. Fewer users are a subset of more.
        sessions: Number of sessions of each; 0: all.
        seed: Draws the users.

    Raises:
        ValueError: There are fewer.
    """
    left = np.unique(user[~held])
    advice = "beside the held-out ones; record more, or learn from fewer"
    if users > len(left):
        raise ValueError(
            f"{users} users to learn from are wanted, and {len(left)} are left {advice}"
        )
    drawn = np.random.default_rng((seed, _DRAW)).permutation(left)[: users or len(left)]
    chosen = ~held & np.isin(user, drawn)
    for one in drawn if sessions else ():
        own = np.unique(session[chosen & (user == one)])
        if len(own) < sessions:
            wanted = f"{sessions} sessions of each user to learn from are wanted"
            raise ValueError(f"{wanted}, and of one {len(own)} are left {advice}")
        chosen &= (user != one) | np.isin(session, own[:sessions])
    return chosen
