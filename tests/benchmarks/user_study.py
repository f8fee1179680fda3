"""Study of user identification among ten people, by every protocol, and the share of drift in it.

Ten people make one gesture, as in section 4.2 of the paper. The network is judged on windows drawn
at random from the sessions that it learned from (the most that the paper can have done), on a block
of time left out of them, on new sessions, and on sessions of which only the orb, or only the hand,
was drawn anew. Strangers, whom no training met, are to be taken for nobody.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.recognition.user_id import Users
from controller.simulator.hand import GESTURES
from models.data.recipe import UNVARIED_USER, USER, VARIED_USER
from models.evaluation import user_metrics
from models.evaluation.user_metrics import SEEN
from models.results import storage
from models.results.figure import Figure
from models.training import user_task
from models.training.networks import Network
from models.training.user_task import UserGestures, gesture_evidence, train_users
from tests.benchmarks.results import code_hash
from tests.benchmarks.simulated_users import (
    Change,
    SimulatedUsers,
    joined,
    last_block,
    prepare_users,
)

HANGS_ON: Final = (  # modules whose sources a result depends on
    "models.data.augment", "models.data.recipe", "models.evaluation.user_metrics",
    "models.training.user_task", "tests.benchmarks.simulated_users", __name__,
)  # fmt: skip

Say = Callable[[str], None]
Part = Callable[[str, int, "Size", tuple[str, ...]], dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Size:
    """How much is measured."""

    users: int = 10  # enrolled people; the paper's ten
    enrolled: int = 4  # sessions of each
    new: int = 2  # new sessions of each
    known: tuple[int, int] = (10, 1)  # strangers that training may learn from, and sessions of each
    strangers: int = 10  # others, of whom it may not
    minutes: float = 4.0  # of a session


QUICK: Final = Size(users=3, enrolled=2, new=1, known=(2, 1), strangers=2, minutes=1.0)


def judged(net: Network, new: UserGestures, users: Users) -> Figure:
    """Return the share of gestures whose maker is named."""
    return user_metrics.share(gesture_evidence(net, new), new.user, new.session, users)


def open_world(preset: str, seed: int, size: Size, gestures: tuple[str, ...]) -> dict[str, Any]:
    """Return what enrolled people and strangers are worth after so many sessions and gestures."""
    players = SimulatedUsers(preset, seed, size.minutes, gestures)
    labels, outputs = len(gestures), 1 + size.users

    def days(users: range, first: int, count: int, *, strange: bool = False) -> UserGestures:
        return prepare_users(
            ((players.session(u, d), 0 if strange else 1 + u, d)
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
    found: dict[str, Any] = {"events": len(new.user), "sessions": size.users * size.new}
    # Acceptance and temperature come from the last enrolled session, left out once.
    half = np.isin(backs.session, np.unique(backs.session)[::2])
    before = train_users(
        joined(own.some(own.day < size.enrolled - 1), backs.some(half)), outputs, seed
    )[0]
    last, away = own.some(own.day == size.enrolled - 1), backs.some(~half)
    said = gesture_evidence(before, last), gesture_evidence(before, away)
    users = user_metrics.tuned(said, last.user, away.session, size.users)
    found |= {"temperature": users.temperature, "accept": users.accept}
    found["enrolled"] = {}
    for count in (1, 2, size.enrolled):
        net = train_users(joined(own.some(own.day < count), backs), outputs, seed)[0]
        heard = gesture_evidence(net, new), new.user, new.session
        stranger = gesture_evidence(net, strange), strange.session
        found["enrolled"][str(count)] = {
            "seen": {str(seen): figure(user_metrics.share(*heard, users, seen)) for seen in SEEN},
            "open": [asdict(user_metrics.open_set(heard, stranger, users, seen)) for seen in SEEN],
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
        players = SimulatedUsers(preset, seed, size.minutes, gestures, drifting)

        day = partial(_day, players, ours, labels, tracked)
        varied = VARIED_USER if tracked else UNVARIED_USER
        own = day(0)
        out = user_task.random_windows(len(own.ends), seed)
        net, random = train_users(own, outputs, seed, augmentation=varied, random=out)
        row = {"random": {"value": round(random, 5)}}
        row["new"] = figure(judged(net, day(size.enrolled), users))
        if name != "still":
            for change in ("drift", "hand", "orb"):
                row[change] = figure(judged(net, day(0, change), users))
            early, late = last_block(own)
            net = train_users(early, outputs, seed, augmentation=varied)[0]
            row["time"] = figure(judged(net, late, users))
        found[name] = row
    return found


def _day(
    players: SimulatedUsers,
    users: range,
    labels: int,
    tracked: bool,
    number: int,
    change: Change = "day",
) -> UserGestures:
    """Return one session of each."""
    rows = ((players.session(user, number, change), 1 + user, number) for user in users)
    return prepare_users(rows, labels, tracked=tracked)


def figure(found: Figure) -> dict[str, float]:
    """Return a figure as plain data."""
    return {name: round(value, 5) for name, value in asdict(found).items()}


PARTS: Final[dict[str, tuple[Part, tuple[str, ...]]]] = {
    "one": (open_world, GESTURES[2:3]),  # the paper's: one gesture
    "drift": (drift, GESTURES[2:3]),
    "any": (open_world, GESTURES),
}


def measure(
    preset: str, seed: int, size: Size, path: Path, *, again: bool = False
) -> dict[str, Any]:
    """Return everything of one preset, measuring what a file of results lacks, or all `again`."""
    kept: dict[str, Any] = {}
    if path.exists() and not again:
        kept = storage.read_json(path)
    found: dict[str, Any] = {}
    for name, (run, gestures) in PARTS.items():
        told = repr(
            (name, preset, seed, size, gestures, USER, VARIED_USER, code_hash(HANGS_ON).hex())
        )
        key = hashlib.sha256(told.encode()).hexdigest()[:24]
        if key not in kept:
            kept[key] = run(preset, seed, size, gestures)
            storage.write_text(path, f"{json.dumps(kept, indent=1)}\n")
        found[name] = kept[key]
    return found
