"""Metrics of user identification, by gestures seen and against people never enrolled.

The temperature and the probability from which a user is named are chosen by them, too.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.user_id import (
    NOT_ENROLLED,
    Belief,
    Users,
    uniform_belief,
    update_belief,
)
from controller.simulator.hand.performance import GESTURES
from models.evaluation import bootstrap, scores
from models.results.evaluation import Figure
from models.results.training import OpenSetFigures

SEEN: Final = (1, 2, 3, 5)  # gestures in a row
GRID: Final = (0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.998)  # acceptances to choose from

STAY: Final = 0.98  # probability that two gestures in a row are of one user: turns are long
FORGET_S: Final = 30.0  # pauses of the same player are shorter
FALSE_ACCEPTS: Final = 0.05  # share of strangers that acceptance is chosen for,
JUDGED: Final = 3  # after this many gestures

Evidence = NDArray[np.float64]  # (events, outputs): evidence, in the order of the recording
Index = NDArray[np.intp]  # (events,)


def beliefs(evidence: Evidence, session: Index, users: Users, seen: int) -> tuple[Belief, Index]:
    """Return the belief after rows of `seen` gestures, (rows, users), and their first, (rows,)."""
    made, first = [], []
    for number in np.unique(session):
        own = np.flatnonzero(session == number)
        for start in range(0, len(own) - seen + 1, seen):
            belief = uniform_belief(users)
            for event in own[start : start + seen]:
                belief = update_belief(belief, evidence[event], users)
            made.append(belief)
            first.append(own[start])
    empty = np.zeros((0, 1 + len(users.names)))
    return np.array(made) if made else empty, np.array(first, dtype=np.int64)


def share(evidence: Evidence, user: Index, session: Index, users: Users, seen: int = 1) -> Figure:
    """Return the share of rows of `seen` gestures whose most probable enrolled user is right."""
    belief, first = beliefs(evidence, session, users, seen)
    if not len(first):
        return Figure(math.nan, math.nan, math.nan)
    right = 1 + belief[:, 1:].argmax(axis=1) == user[first]
    return bootstrap.share(*bootstrap.group_sums(right, session[first]))


def open_set(
    own: tuple[Evidence, Index, Index], others: tuple[Evidence, Index], users: Users, seen: int
) -> OpenSetFigures:
    """Return the figures of own evidence, users and recordings against strangers' evidence."""
    # Importing it makes shared memory, which a training of gestures does not need.
    from sklearn.metrics import roc_auc_score

    belief, first = beliefs(own[0], own[2], users, seen)
    strange, _ = beliefs(others[0], others[1], users, seen)
    sure, unsure = belief[:, 1:].max(axis=1), strange[:, 1:].max(axis=1)
    named = _named(belief, users)
    user = own[1][first]
    enrolled = np.repeat([1, 0], [len(sure), len(unsure)])
    known = len(sure) and len(unsure)
    return OpenSetFigures(
        seen,
        float(roc_auc_score(enrolled, np.concatenate([sure, unsure]))) if known else math.nan,
        float((_named(strange, users) != NOT_ENROLLED).mean()),
        float((named == user).mean()),
        float(((named != user) & (named != NOT_ENROLLED)).mean()),
    )


def acceptance(strange: Belief, false_accepts: float) -> float:
    """Return the least probability that accepts no more strangers; beliefs are (rows, users)."""
    if not len(strange):
        return 0.9
    best = strange[:, 1:].max(axis=1)
    alone = strange.argmax(axis=1) != NOT_ENROLLED
    for accept in GRID:
        if float((alone & (best >= accept)).mean()) <= false_accepts:
            return accept
    return GRID[-1]


def users_of(count: int, temperature: float = 1.0, accept: float = 0.9) -> Users:
    """Return that many users as a bundle holds them."""
    names = tuple(f"{number + 1:02d}" for number in range(count))
    return Users(names, GESTURES, temperature, accept, STAY, FORGET_S)


def tuned(
    evidence: tuple[NDArray[np.float64], NDArray[np.float64]],
    user: Index,
    session: Index,
    count: int,
) -> Users:
    """Return users whose temperature and acceptance fit own and strangers' evidence."""
    both = np.concatenate(evidence)
    label = np.concatenate([user, np.zeros(len(evidence[1]), dtype=np.int64)])
    users = users_of(count, float(np.clip(scores.temperature(both, label), 0.05, 20.0)))
    strange, _ = beliefs(evidence[1], session, users, JUDGED)
    return replace(users, accept=acceptance(strange, FALSE_ACCEPTS))


def _named(belief: Belief, users: Users) -> Index:
    """Return the user named for each row, (rows,), or `NOT_ENROLLED`."""
    best = belief.argmax(axis=1)
    sure = belief[np.arange(len(belief)), best] >= users.accept
    return np.where(sure, best, NOT_ENROLLED).astype(np.int64)
