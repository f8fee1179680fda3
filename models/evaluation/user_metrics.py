"""Metrics of user identification, by gestures seen and against people never enrolled.

What is chosen by it as well: the temperature, and how probable somebody must be to be named.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.user_id import ANYBODY, Belief, Users, believe, nothing
from controller.simulator.hand import GESTURES
from models.evaluation import bootstrap, scores
from models.results.figure import Figure
from models.results.users import Open

SEEN: Final = (1, 2, 3, 5)  # gestures in a row
GRID: Final = (0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.998)  # acceptances to choose from

STAY: Final = 0.98  # the next gesture is made by who made the last one: turns are long
FORGET_S: Final = 30.0  # pauses of the same player are shorter
FALSE_ACCEPTS: Final = 0.05  # share of strangers that acceptance is chosen for,
JUDGED: Final = 3  # after so many gestures

Said = NDArray[np.float64]  # (events, outputs): evidence, in the order of the recording
Index = NDArray[np.intp]


def beliefs(said: Said, session: Index, users: Users, seen: int) -> tuple[Belief, Index]:
    """Return what is believed after so many gestures in a row, and the first of them.

    Each gesture is in one row; a row is within one recording.
    """
    made, first = [], []
    for number in np.unique(session):
        own = np.flatnonzero(session == number)
        for start in range(0, len(own) - seen + 1, seen):
            belief = nothing(users)
            for event in own[start : start + seen]:
                belief = believe(belief, said[event], users)
            made.append(belief)
            first.append(own[start])
    empty = np.zeros((0, 1 + len(users.names)))
    return np.array(made) if made else empty, np.array(first, dtype=np.int64)


def share(said: Said, who: Index, session: Index, users: Users, seen: int = 1) -> Figure:
    """Return the share of rows of gestures for which the most probable person is right.

    Among people only: the question is which of them it is. The interval is by whole sessions.
    """
    belief, first = beliefs(said, session, users, seen)
    if not len(first):
        return Figure(math.nan, math.nan, math.nan)
    right = 1 + belief[:, 1:].argmax(axis=1) == who[first]
    of = session[first]
    groups = np.unique(of)
    return bootstrap.share(
        [right[of == group].sum() for group in groups], [(of == group).sum() for group in groups]
    )


def openly(
    own: tuple[Said, Index, Index], others: tuple[Said, Index], users: Users, seen: int
) -> Open:
    """Return how well strangers are kept apart.

    Args:
        own: Evidence of enrolled people's gestures, who, and the recordings.
        others: Evidence of strangers' gestures, and the recordings.
        users: Temperature and acceptance.
        seen: Gestures in a row.
    """
    belief, first = beliefs(own[0], own[2], users, seen)
    strange, _ = beliefs(others[0], others[1], users, seen)
    sure, unsure = belief[:, 1:].max(axis=1), strange[:, 1:].max(axis=1)
    named = _named(belief, users)
    who = own[1][first]
    return Open(
        seen,
        auroc(sure, unsure),
        float((_named(strange, users) != ANYBODY).mean()),
        float((named == who).mean()),
        float(((named != who) & (named != ANYBODY)).mean()),
    )


def auroc(high: NDArray[np.float64], low: NDArray[np.float64]) -> float:
    """Return the probability that one of the first is above one of the second; ties are halves."""
    if not (len(high) and len(low)):
        return math.nan
    ordered = np.sort(low)
    below = np.searchsorted(ordered, high, side="left")
    level = np.searchsorted(ordered, high, side="right") - below
    return float((below + 0.5 * level).mean() / len(low))


def acceptance(strange: Belief, false_accepts: float, grid: Sequence[float] = GRID) -> float:
    """Return the least probability at which no more strangers than that are taken for somebody."""
    if not len(strange):
        return 0.9
    best = strange[:, 1:].max(axis=1)
    alone = strange.argmax(axis=1) != ANYBODY
    for accept in grid:
        if float((alone & (best >= accept)).mean()) <= false_accepts:
            return accept
    return grid[-1]


def users_of(count: int, temperature: float = 1.0, accept: float = 0.9) -> Users:
    """Return so many people as a bundle knows them."""
    names = tuple(f"{number + 1:02d}" for number in range(count))
    return Users(names, GESTURES, temperature, accept, STAY, FORGET_S)


def tuned(
    said: tuple[NDArray[np.float64], NDArray[np.float64]], who: Index, session: Index, count: int
) -> Users:
    """Return people with the temperature and the acceptance that fit what was held out.

    Args:
        said: Evidence of enrolled people's gestures, and of strangers'.
        who: Makers of the first.
        session: Recordings of the second.
        count: Of people.
    """
    both = np.concatenate(said)
    label = np.concatenate([who, np.zeros(len(said[1]), dtype=np.int64)])
    users = users_of(count, float(np.clip(scores.temperature(both, label), 0.05, 20.0)))
    strange, _ = beliefs(said[1], session, users, JUDGED)
    return replace(users, accept=acceptance(strange, FALSE_ACCEPTS))


def _named(belief: Belief, users: Users) -> Index:
    best = belief.argmax(axis=1)
    sure = belief[np.arange(len(belief)), best] >= users.accept
    return np.where(sure, best, ANYBODY).astype(np.int64)
