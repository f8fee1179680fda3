"""Identification of ten people: the rows `user_...` of tests/benchmarks/recognition.py.

    python -m tests.benchmarks.recognition_users [--quick] [--json]

Ten simulated people whom no training accepts make the paper's gesture (twists clockwise) or any of
the four, in four enrolment sessions and two new ones of four minutes each; ten others may be
learned from as nobody, and ten more are strangers. `user_accuracy` is the share of single gestures
in the new sessions whose maker the network names. What follows `@` is another protocol: windows at
random, a block of time left out, or a new session, learned from one session of each, as in the
paper; with the drift alone, the hand alone or the orb drawn anew, without drift, and on images
whose rest stays where it was. `user_auroc`, `user_false_accepts`, `user_right` (named rightly) and
`user_wrong` (taken for another) include strangers, by gestures seen and by enrolment sessions.
Intervals are 95 %, by resampling whole sessions. Some ten minutes of one core for each preset.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, Final, Literal

import numpy as np

from controller.recognition.user_id import Users
from controller.simulator.hand.performance import GESTURES
from controller.simulator.orb import PRESETS
from controller.simulator.session import DATA
from models.data import touch_images
from models.data.examples import Examples, Source, prepare
from models.data.recipe import RECIPES, UNVARIED_USER, VARIED_USER
from models.data.simulate import ORB, DataSet
from models.evaluation import user_metrics
from models.evaluation.user_metrics import SEEN
from models.results.evaluation import Figure
from models.training import user_task
from models.training.loop import prepare_torch
from models.training.networks import Network
from models.training.user_task import UserGestures, gesture_evidence, train_users

from .results import BENCHMARK_SEED, Results, Row, command_line, figure_row, say

SEED: Final = BENCHMARK_SEED + 1
GOAL: Final = 0.80
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


# What another session differs in: in all that another day of the same orb does, in drift and noise
# alone, in the hand alone, or in the orb with its drift and noise.
Change = Literal["day", "drift", "hand", "orb"]
RATE_HZ: Final = 10.0
WINDOW: Final = 10  # images: paper, section 4.1
_OTHER: Final = 77  # tag of the seeds of what is changed
_DAYS: Final = 200  # more sessions than any user has


@dataclass(frozen=True, slots=True)
class SimulatedUsers:
    """Users who make gestures."""

    preset: str  # quality of their orbs
    seed: int  # of users and sessions
    minutes: float = 3.0  # of a session
    gestures: tuple[str, ...] = ("twist_cw",)  # labels of the gestures that they make
    drifting: bool = True  # the baseline drifts; else it stays where it is
    shared: bool = True  # all of them touch one orb; else each session has an orb of its own

    def session(self, user: int, day: int, change: Change = "day") -> Source:
        """Return a session; changes other than "day" are of this session."""
        own, other = (
            np.random.SeedSequence([DATA, self.seed, *tag], spawn_key=(user, day)).spawn(5)
            for tag in ((), (_OTHER,))
        )
        orb = np.random.SeedSequence([DATA, self.seed, ORB, *([_OTHER] if change == "orb" else [])])
        seeds = [orb if self.shared else own[0], *(other if change == "hand" else own)[1:]]
        number = 1 + user * _DAYS + day + (_DAYS // 2 if change in ("drift", "orb") else 0)
        data = DataSet(self.seed, self.minutes, preset=self.preset, gestures=self.gestures)
        model = data.model()
        if not self.drifting:
            none = 0.0, 1.0
            still = replace(model.electronics, taxel_drift=none, common_drift=none)
            model = replace(model, electronics=still)
        played = data.played(seeds, user, number if self.shared else 0, model)
        return Source(played.frames, played.label, played.touch)


def prepare_users(
    sessions: Iterable[tuple[Source, int, int]], labels: int = 1, *, tracked: bool = True
) -> UserGestures:
    """Return the gestures of sessions, each with the output for its user, and its day."""
    rows = list(sessions)
    settings = RECIPES["default" if tracked else "paper"].settings(RATE_HZ, WINDOW)
    examples = prepare((source for source, _, _ in rows), settings)
    user, day = [number for _, number, _ in rows], [number for _, _, number in rows]
    return UserGestures.of(examples, range(1, 1 + labels), user, day)


def last_block(own: UserGestures) -> tuple[UserGestures, UserGestures]:
    """Return the gestures of all blocks of time but the last of each session, and of the last."""
    late = touch_images.last_events(own.session)
    early = ~late
    edge = np.flatnonzero(late & np.roll(early, 1))  # the gesture between belongs to neither
    early[edge - 1] = False
    return own.some(early), own.some(late)


def joined(one: UserGestures, other: UserGestures) -> UserGestures:
    """Return the gestures of two groups of recordings."""
    frames, sessions = len(one.examples.images), int(one.examples.session.max()) + 1
    moved = replace(
        other.examples, ends=other.examples.ends + frames, session=other.examples.session + sessions
    )
    pairs = {
        name: (getattr(one, name), getattr(other, name)) for name in UserGestures.__slots__[1:]
    }
    shift = {"ends": frames, "event": len(one.label), "session": sessions}
    return UserGestures(
        Examples.joined([one.examples, moved]),
        **{n: np.concatenate([a, b + shift.get(n, 0)]) for n, (a, b) in pairs.items()},
    )


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
    who: SimulatedUsers, users: range, labels: int, tracked: bool, day: int, change: Change = "day"
) -> UserGestures:
    """Return one session of each."""
    rows = ((who.session(user, day, change), 1 + user, day) for user in users)
    return prepare_users(rows, labels, tracked=tracked)


def figure(found: Figure) -> dict[str, float]:
    """Return a figure as plain data."""
    return {name: round(value, 5) for name, value in asdict(found).items()}


PARTS: Final[dict[str, tuple[Part, tuple[str, ...]]]] = {
    "one": (open_world, GESTURES[2:3]),  # the paper's: one gesture
    "drift": (drift, GESTURES[2:3]),
    "any": (open_world, GESTURES),
}


def rows(preset: str, size: Size) -> list[Row]:
    """Return the rows of one preset."""
    prepare_torch(SEED)
    found = {name: run(preset, SEED, size, of) for name, (run, of) in PARTS.items()}
    one, every, drift = found["one"], found["any"], found["drift"]
    say(
        f"{preset}: {size.users} people; {one['events']} twists in {one['sessions']} new sessions, "
        f"{every['events']} gestures of any kind; {size.strangers} strangers"
    )
    most = str(size.enrolled)
    listed = [_row("user_accuracy", preset, one["enrolled"][most]["seen"]["1"], GOAL)]
    listed += [
        _row(f"user_accuracy@{count}_enrolled", preset, told["seen"]["1"])
        for count, told in one["enrolled"].items() if count != most
    ]  # fmt: skip
    listed += [
        _row(f"user_accuracy@{seen}_gestures", preset, figure)
        for seen, figure in one["enrolled"][most]["seen"].items() if seen != "1"
    ]  # fmt: skip
    listed += [
        _row(
            f"user_accuracy@any_{seen}_gestures".replace("_1_gestures", "_gesture"), preset, figure
        )
        for seen, figure in every["enrolled"][most]["seen"].items()
    ]
    for images, protocols in drift.items():
        suffix = "" if images == "tracked" else f"_{images}"
        listed += [
            _row(f"user_accuracy@1_{protocol}{suffix}", preset, figure)
            for protocol, figure in protocols.items()
        ]
    for prefix, found in (("", one), ("any_", every)):
        for count, told in found["enrolled"].items():
            suffix = "" if count == most else f"_{count}_enrolled"
            listed += [
                _row(f"user_{name}@{prefix}{opened['seen']}_gestures{suffix}", preset,
                     {"value": opened[name]})
                for opened in told["open"] for name in ("auroc", "false_accepts", "right", "wrong")
            ]  # fmt: skip
    return listed


def _row(name: str, preset: str, figure: dict[str, float], goal: float | None = None) -> Row:
    found = Figure(*(figure.get(part, math.nan) for part in ("value", "low", "high")))
    return figure_row(name, found, preset=preset, goal=goal)


def main() -> None:
    parser = command_line(__doc__, quick=False)
    arguments, results = parser.parse_args(), Results("recognition_users")
    size = QUICK if arguments.quick else Size()
    for preset in PRESETS:
        for row in rows(preset, size):
            results.keep(row)
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
