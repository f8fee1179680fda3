"""Hold-out of whole people or sessions from a training."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

DRAW: Final = 6  # stream of random numbers, of the training's seed

Groups = NDArray[np.int64]  # (recordings,), equal where recordings belong together
Chosen = NDArray[np.bool_]  # (recordings,)


def held(unit: Groups, test: Mapping[str, Any]) -> Chosen:
    """Return which recordings are held out.

    Args:
        unit: User or session of each recording.
        test: "folds" and "fold", or "hold": how many, evenly spread over the recordings' order.

    Raises:
        ValueError: There are too few.
    """
    names = np.unique(unit)
    folds, hold = test.get("folds", 0), test.get("hold", 0)
    if len(names) < max(2, folds, hold + 1):
        wanted = f"{folds} folds" if folds else f"{hold} held out"
        raise ValueError(
            f"there are {len(names)} {test['by']}s, too few for {wanted}; record more, or say fewer"
        )
    if folds:
        taken = np.array_split(names, folds)[test["fold"]]
    else:
        taken = names[((np.arange(hold) + 0.5) * len(names) / hold).astype(np.int64)]
    return np.isin(unit, taken)


def held_of_each(user: Groups, session: Groups, test: Mapping[str, Any]) -> Chosen:
    """Return which recordings are held out where the same people are learned from and judged.

    Args:
        user: Of each recording.
        session: Of each recording; sessions of one user rise in the order they were recorded.
        test: "folds" and "fold": of each person's sessions one in so many; or "hold": of each the
            last so many.

    Raises:
        ValueError: Somebody has too few.
    """
    tested = np.zeros(len(user), dtype=np.bool_)
    folds, hold = test.get("folds", 0), test.get("hold", 0)
    for one in np.unique(user):
        own = np.unique(session[user == one])
        if len(own) < max(2, folds, hold + 1):
            wanted = f"{folds} folds" if folds else f"{hold} held out"
            came = f"{len(own)} session{'s' if len(own) > 1 else ''}"
            raise ValueError(
                f"somebody came for {came}, too few for {wanted}; record more, or say fewer"
            )
        tested |= np.isin(session, own[test["fold"] :: folds] if folds else own[-hold:])
    return tested


def learned(user: Groups, session: Groups, tested: Chosen, train: Mapping[str, Any]) -> Chosen:
    """Return which recordings are learned from.

    Which people is drawn by the seed, and fewer are always among the more; of each, the first
    sessions.

    Args:
        user: Of each recording.
        session: Of each recording; sessions of one user rise in the order they were recorded.
        tested: Which are held out.
        train: "users", "sessions" (0: all), "seed".

    Raises:
        ValueError: There are fewer.
    """
    left = np.unique(user[~tested])
    users, sessions = train["users"] or len(left), train["sessions"]
    if users > len(left):
        raise ValueError(
            f"{users} users are to be learned from, and {len(left)} are left beside those held "
            "out; record more, or say fewer"
        )
    order = np.random.default_rng((train["seed"], DRAW)).permutation(left)
    chosen = ~tested & np.isin(user, order[:users])
    if not sessions:
        return chosen
    for one in order[:users]:
        own = np.unique(session[chosen & (user == one)])
        if len(own) < sessions:
            raise ValueError(
                f"{sessions} sessions of each user are to be learned from, and one has {len(own)}; "
                "record more, or say fewer"
            )
        chosen &= (user != one) | np.isin(session, own[:sessions])
    return chosen
