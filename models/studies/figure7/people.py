"""Figure 7 c and d: ten people make one gesture, one session each, as in section 4.2."""

from dataclasses import replace
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.simulator.hand import GESTURES
from models.data.recipe import Course, Recipe
from models.evaluation import user_metrics
from models.studies.figure7.curves import Row, Say, curve, study
from models.training import user_task
from models.training.simulated_users import Town
from models.training.user_data import Crowd, crowd
from models.training.user_recipe import COURSE, MOOD, STEADY, Mood
from models.training.user_task import People

NETWORK: Final = "users"  # in the names of parts, beside CNN-3D and CNN-2D
USERS: Final = 10  # paper, section 4.2
GESTURE: Final = GESTURES[2]  # twists clockwise: likewise
MINUTES: Final = 3.0  # of each one's session: some 500 windows, 5,000 of all, as the paper's
EVERY: Final = 5  # so manieth of another day's windows is judged: neighbours share most frames
SHARED: Final = False  # each session has an orb of its own
FEWER: Final = 4  # the paper's recipe runs for so many times fewer epochs than on gestures


def course(name: str, recipe: Recipe) -> tuple[Course, Mood, bool]:
    """Return how a recipe trains: course, moods, and whether rest is followed."""
    if name == "paper":
        epochs = max(1, recipe.gesture.epochs // FEWER)
        return replace(recipe.gesture, epochs=epochs), STEADY, False
    return COURSE, MOOD, True


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
    town = Town(preset, seed, MINUTES, (GESTURE,), shared=SHARED)
    taught, day = (
        crowd(((town.session(u, d), 1 + u, d) for u in range(USERS)), tracked=tracked)
        for d in range(2)
    )
    known = user_metrics.users_of(USERS)

    def run(share: float) -> list[Row]:
        own = taught.some(first(taught, share))
        drawn = user_task.drawn(len(own.touched.ends), seed)
        torch.manual_seed(seed)
        work = People(own.touched, own.who, 1 + USERS, how, mood, drawn)

        def judged(last: bool) -> Row:
            answers = user_task.ask(work.net, day.touched, day.touched.ends[::EVERY])
            right = answers[:, 1:].argmax(axis=1) + 1 == day.who[day.touched.event[::EVERY]]
            row = {"day": float(right.mean())}
            if last:
                said = user_task.said(work.net, day.touched)
                row["day events"] = user_metrics.share(
                    said, day.who, day.touched.session, known
                ).value
            return row

        return curve(work, how, judged, int((~drawn).sum()), seed)

    return study(run, f"{preset}, recipe {name}: {USERS} users", say)


def first(taught: Crowd, share: float) -> NDArray[np.bool_]:
    """Return the first gestures of each one's session: a shorter lesson."""
    session = taught.touched.session
    kept = np.zeros(len(session), dtype=np.bool_)
    for number in np.unique(session):
        own = np.flatnonzero(session == number)
        kept[own[: max(1, round(share * len(own)))]] = True
    return kept
