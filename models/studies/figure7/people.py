"""Figure 7 c and d: ten people make one gesture, one session each, as in section 4.2."""

from dataclasses import replace
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.simulator.hand import GESTURES
from models.data.recipe import (
    UNVARIED_USER,
    USER,
    VARIED_USER,
    NetworkRecipe,
    Recipe,
    UserAugmentation,
)
from models.evaluation import user_metrics
from models.studies.figure7.curves import Row, Say, curve, study
from models.training import user_task
from models.training.simulated_users import SimulatedUsers, prepare_users
from models.training.user_task import UserGestures, UserTask

NETWORK: Final = "users"  # in the names of parts, beside CNN-3D and CNN-2D
USERS: Final = 10  # paper, section 4.2
GESTURE: Final = GESTURES[2]  # twists clockwise: likewise
MINUTES: Final = 3.0  # of each one's session: some 500 windows, 5,000 of all, as the paper's
EVERY: Final = 5  # so manieth of another day's windows is judged: neighbours share most frames
SHARED: Final = False  # each session has an orb of its own
FEWER: Final = 4  # the paper's recipe runs for so many times fewer epochs than on gestures


def course(name: str, recipe: Recipe) -> tuple[NetworkRecipe, UserAugmentation, bool]:
    """Return how a recipe trains: course, moods, and whether rest is followed."""
    if name == "paper":
        epochs = max(1, recipe.gesture.epochs // FEWER)
        return replace(recipe.gesture, epochs=epochs), UNVARIED_USER, False
    return USER, VARIED_USER, True


def people(preset: str, name: str, recipe: Recipe, seed: int, say: Say) -> dict[str, Any]:
    """Train the user network, and return its curve over epochs and over examples.

    Args:
        preset: Quality of the orbs.
        name: Of the recipe.
        recipe: Itself.
        seed: Of users, sessions, and training.
        say: Takes lines of progress.

    Returns:
        Plain data, as `gestures` in models/studies/figure7/study.py; "day" is another session of
        each.
    """
    how, mood, tracked = course(name, recipe)
    players = SimulatedUsers(preset, seed, MINUTES, (GESTURE,), shared=SHARED)
    taught, day = (
        prepare_users(((players.session(u, d), 1 + u, d) for u in range(USERS)), tracked=tracked)
        for d in range(2)
    )
    known = user_metrics.users_of(USERS)

    def run(share: float) -> list[Row]:
        own = taught.some(first(taught, share))
        drawn = user_task.random_windows(len(own.ends), seed)
        torch.manual_seed(seed)
        task = UserTask(own, 1 + USERS, how, mood, drawn)

        def judged(last: bool) -> Row:
            answers = user_task.probabilities(task.net, day, day.ends[::EVERY])
            right = answers[:, 1:].argmax(axis=1) + 1 == day.user[day.event[::EVERY]]
            row = {"day": float(right.mean())}
            if last:
                said = user_task.gesture_evidence(task.net, day)
                row["day events"] = user_metrics.share(said, day.user, day.session, known).value
            return row

        return curve(task, judged, int((~drawn).sum()), seed)

    return study(run, f"{preset}, recipe {name}: {USERS} users", say)


def first(taught: UserGestures, share: float) -> NDArray[np.bool_]:
    """Return the first gestures of each one's session: a shorter lesson."""
    session = taught.session
    kept = np.zeros(len(session), dtype=np.bool_)
    for number in np.unique(session):
        own = np.flatnonzero(session == number)
        kept[own[: max(1, round(share * len(own)))]] = True
    return kept
