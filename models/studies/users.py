"""Study of user identification among ten people, by every protocol, and the share of drift in it.

Ten people make one gesture, as in section 4.2 of the paper. The network is judged on windows drawn
at random from the sessions that it learned from (the most that the paper can have done), on a block
of time left out of them, on new sessions, and on sessions of which only the orb, or only the hand,
was drawn anew. Strangers, whom no training met, are to be taken for nobody.
"""

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.recognition.user_id import Users
from controller.simulator.hand import GESTURES
from models import user_files
from models.data.recipe import Course
from models.evaluation import user_metrics
from models.evaluation.user_metrics import SEEN
from models.results.figure import Figure
from models.training import user_task
from models.training.networks import GestureNet
from models.training.simulated_users import Anew, Town
from models.training.user_data import Crowd, blocks, crowd, join
from models.training.user_recipe import COURSE, MOOD, STEADY, Mood
from models.training.user_task import People

HANGS_ON: Final = (  # files of models/
    "evaluation/user_metrics", "studies/users", "training/simulated_users", "training/user_data",
    "training/user_recipe", "training/user_task", "training/user_windows",
)  # fmt: skip

Say = Callable[[str], None]
Part = Callable[[str, int, "Size", tuple[str, ...]], dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Size:
    """How much is measured.

    Attributes:
        users: Enrolled people; the paper's ten.
        enrolled: Sessions of each.
        new: New sessions of each.
        known: Strangers that training may learn from, and sessions of each.
        strangers: Others, of whom it may not.
        minutes: Of a session.
    """

    users: int = 10
    enrolled: int = 4
    new: int = 2
    known: tuple[int, int] = (10, 1)
    strangers: int = 10
    minutes: float = 4.0


QUICK: Final = Size(users=3, enrolled=2, new=1, known=(2, 1), strangers=2, minutes=1.0)


def learn(
    taught: Crowd,
    outputs: int,
    seed: int,
    *,
    mood: Mood = MOOD,
    course: Course = COURSE,
    random: NDArray[np.bool_] | None = None,
) -> tuple[GestureNet, float]:
    """Return a network of so many outputs, and its score on windows at random."""
    torch.manual_seed(seed)
    work = People(taught.touched, taught.who, outputs, course, mood, random)
    net = user_task.teach(work, seed, user_task.silent)
    work.net = net
    return net, work.random()


def judged(net: GestureNet, new: Crowd, users: Users) -> Figure:
    """Return the share of gestures whose maker is named."""
    return user_metrics.share(user_task.said(net, new.touched), new.who, new.touched.session, users)


def open_world(preset: str, seed: int, size: Size, gestures: tuple[str, ...]) -> dict[str, Any]:
    """Return what enrolled people and strangers are worth after so many sessions and gestures."""
    town = Town(preset, seed, size.minutes, gestures)
    labels, outputs = len(gestures), 1 + size.users

    def days(users: range, first: int, count: int, *, strange: bool = False) -> Crowd:
        return crowd(
            ((town.session(u, d), 0 if strange else 1 + u, d)
             for u in users for d in range(first, first + count)),
            labels,
        )  # fmt: skip

    ours = range(size.users)
    known = range(size.users, size.users + size.known[0])
    others = range(known.stop, known.stop + size.strangers)
    own = days(ours, 0, size.enrolled)
    backs = days(known, 0, size.known[1], strange=True)
    new = days(ours, size.enrolled, size.new)
    strange = days(others, 0, 1, strange=True)
    found: dict[str, Any] = {"events": len(new.who), "sessions": size.users * size.new}
    # Acceptance and temperature come from the last enrolled session, left out once.
    half = np.isin(backs.touched.session, np.unique(backs.touched.session)[::2])
    before = learn(join(own.some(own.day < size.enrolled - 1), backs.some(half)), outputs, seed)[0]
    last, away = own.some(own.day == size.enrolled - 1), backs.some(~half)
    said = user_task.said(before, last.touched), user_task.said(before, away.touched)
    users = user_metrics.tuned(said, last.who, away.touched.session, size.users)
    found |= {"temperature": users.temperature, "accept": users.accept}
    found["enrolled"] = {}
    for count in (1, 2, size.enrolled):
        net = learn(join(own.some(own.day < count), backs), outputs, seed)[0]
        heard = user_task.said(net, new.touched), new.who, new.touched.session
        stranger = user_task.said(net, strange.touched), strange.touched.session
        found["enrolled"][str(count)] = {
            "seen": {str(seen): figure(user_metrics.share(*heard, users, seen)) for seen in SEEN},
            "open": [asdict(user_metrics.openly(heard, stranger, users, seen)) for seen in SEEN],
        }
    return found


def drift(preset: str, seed: int, size: Size, gestures: tuple[str, ...]) -> dict[str, Any]:
    """Return what one session of each is worth, as in the paper, by every protocol."""
    labels, outputs, users = len(gestures), 1 + size.users, user_metrics.users_of(size.users)
    ours = range(size.users)
    found: dict[str, Any] = {}
    for name, drifting, tracked in (
        ("tracked", True, True), ("raw", True, False), ("still", False, True),
    ):  # fmt: skip
        town = Town(preset, seed, size.minutes, gestures, drifting)

        day = partial(_day, town, ours, labels, tracked)
        mood = MOOD if tracked else STEADY
        own = day(0)
        out = user_task.drawn(len(own.touched.ends), seed)
        net, random = learn(own, outputs, seed, mood=mood, random=out)
        row = {"random": {"value": round(random, 5)}}
        row["new"] = figure(judged(net, day(size.enrolled), users))
        if name != "still":
            for anew in ("drift", "hand", "orb"):
                row[anew] = figure(judged(net, day(0, anew), users))
            early, late = blocks(own)
            net = learn(early, outputs, seed, mood=mood)[0]
            row["time"] = figure(judged(net, late, users))
        found[name] = row
    return found


def _day(
    town: Town, users: range, labels: int, tracked: bool, number: int, anew: Anew = "day"
) -> Crowd:
    """Return one session of each."""
    rows = ((town.session(user, number, anew), 1 + user, number) for user in users)
    return crowd(rows, labels, tracked=tracked)


def figure(found: Figure) -> dict[str, float]:
    """Return a figure as plain data."""
    return {name: round(value, 5) for name, value in asdict(found).items()}


PARTS: Final[dict[str, tuple[Part, tuple[str, ...]]]] = {
    "one": (open_world, GESTURES[2:3]),  # the paper's: one gesture
    "drift": (drift, GESTURES[2:3]),
    "any": (open_world, GESTURES),
}


def measure(
    preset: str,
    seed: int,
    size: Size,
    path: Path,
    say: Say,
    *,
    again: bool = False,
    parts: Iterable[str] = PARTS,
) -> dict[str, Any]:
    """Return everything of one preset, measuring what the file does not hold yet.

    Args:
        preset: Quality of the orbs.
        seed: Of the people.
        size: How much.
        path: Where results are kept.
        say: Takes lines of progress.
        again: What is kept there does not count.
        parts: Which.
    """
    kept: dict[str, Any] = {}
    if path.exists() and not again:
        kept = user_files.read_json(path)
    found: dict[str, Any] = {}
    for name in parts:
        run, gestures = PARTS[name]
        told = repr((name, preset, seed, size, gestures, COURSE, MOOD, _code()))
        key = hashlib.sha256(told.encode()).hexdigest()[:24]
        if key not in kept:
            kept[key] = run(preset, seed, size, gestures)
            user_files.write_text(path, f"{json.dumps(kept, indent=1)}\n")
        found[name] = kept[key]
        say(f"{preset}, {name}: {json.dumps(found[name])}")
    return found


def _code() -> str:
    """Return what a result hangs on in this folder."""
    digest = hashlib.sha256()
    for name in HANGS_ON:
        digest.update(Path(__file__).parents[1].joinpath(f"{name}.py").read_bytes())
    return digest.hexdigest()
