"""What telling ten people apart is worth, by every protocol, and how much of it is the day's drift.

Ten people make one gesture, as in section 4.2 of the paper. The network is judged on windows drawn
at random from the sessions that it learned from (the most that the paper can have done), on a block
of time left out of them, on new sessions, and on sessions of which only the orb, or only the hand,
was drawn anew. Strangers, whom no training met, are to be taken for nobody.
"""

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.simulator.hand import GESTURES
from controller.users import Users
from models import scores, splits
from models.dataset import Source, prepare
from models.intervals import Figure
from models.networks import GestureNet
from models.recipe import RECIPES, Course
from models.users import judge, lesson
from models.users.judge import SEEN
from models.users.lesson import People
from models.users.people import RATE_HZ, Anew, Town
from models.users.recipe import COURSE, MOOD, STEADY, Mood
from models.users.touched import Index, Touched

WINDOW: Final = 10  # images: paper, section 4.1
RANDOM: Final = 0.1  # share of the windows that are drawn at random; the paper does not say
BLOCKS: Final = 6  # of a session, of which the last one is left out
STAY: Final = 0.98  # the next gesture is made by who made the last one: turns are long
FORGET_S: Final = 30.0  # pauses of the same player are shorter
FALSE_ACCEPTS: Final = 0.05  # share of strangers that acceptance is chosen for,
JUDGED: Final = 3  # after so many gestures

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


@dataclass(frozen=True, slots=True)
class Crowd:
    """Gestures of some sessions.

    Attributes:
        touched: Them.
        who: Output of whoever made each, 0 is a stranger, (events,).
        day: Which of their sessions, (events,).
    """

    touched: Touched
    who: Index
    day: Index

    def some(self, events: NDArray[np.bool_]) -> "Crowd":
        """Return some of them."""
        return Crowd(self.touched.some(events), self.who[events], self.day[events])


def crowd(
    sources: Iterable[tuple[Source, int, int]], labels: int = 1, *, tracked: bool = True
) -> Crowd:
    """Return the gestures of (session, output of who it is, day)."""
    rows = list(sources)
    settings = RECIPES["default" if tracked else "paper"].settings(RATE_HZ, WINDOW)
    examples = prepare((source for source, _, _ in rows), settings)
    touched = Touched.of(examples, range(1, 1 + labels))
    who = np.array([number for _, number, _ in rows], dtype=np.int64)
    day = np.array([number for _, _, number in rows], dtype=np.int64)
    return Crowd(touched, who[touched.session], day[touched.session])


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
    net = lesson.teach(work, seed, lesson.silent)
    work.net = net
    return net, work.random()


def users_of(count: int, temperature: float = 1.0, accept: float = 0.9) -> Users:
    """Return so many people as a bundle knows them."""
    names = tuple(f"{number + 1:02d}" for number in range(count))
    return Users(names, GESTURES, temperature, accept, STAY, FORGET_S)


def judged(net: GestureNet, new: Crowd, users: Users, seen: int = 1) -> Figure:
    """Return the share of gestures (or rows of some) whose maker is named."""
    return judge.share(lesson.said(net, new.touched), new.who, new.touched.session, users, seen)


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
    said = lesson.said(before, last.touched), lesson.said(before, away.touched)
    users = tuned(said, last.who, away.touched.session, size.users)
    found |= {"temperature": users.temperature, "accept": users.accept}
    by_sessions: dict[str, Any] = {}
    for count in (1, 2, size.enrolled):
        net = learn(join(own.some(own.day < count), backs), outputs, seed)[0]
        by_sessions[str(count)] = figure(judged(net, new, users))
    heard = lesson.said(net, new.touched)
    stranger = lesson.said(net, strange.touched), strange.touched.session
    found["enrolled"] = by_sessions
    found["seen"] = {
        str(seen): figure(judge.share(heard, new.who, new.touched.session, users, seen))
        for seen in SEEN
    }
    found["open"] = [
        asdict(judge.openly((heard, new.who, new.touched.session), stranger, users, seen))
        for seen in SEEN
    ]
    return found


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
    strange, _ = judge.beliefs(said[1], session, users, JUDGED)
    return replace(users, accept=judge.acceptance(strange, FALSE_ACCEPTS))


def drift(preset: str, seed: int, size: Size, gestures: tuple[str, ...]) -> dict[str, Any]:
    """Return what one session of each is worth, as in the paper, by every protocol."""
    labels, outputs, users = len(gestures), 1 + size.users, users_of(size.users)
    ours = range(size.users)
    found: dict[str, Any] = {}
    for name, drifting, tracked in (
        ("tracked", True, True), ("raw", True, False), ("still", False, True),
    ):  # fmt: skip
        town = Town(preset, seed, size.minutes, gestures, drifting)

        day = partial(_day, town, ours, labels, tracked)
        mood = MOOD if tracked else STEADY
        own = day(0)
        out = np.zeros(len(own.touched.ends), dtype=np.bool_)
        fold = splits.random_windows(len(out), RANDOM, np.random.default_rng(seed))
        out[fold.test] = True
        net, random = learn(own, outputs, seed, mood=mood, random=out)
        row = {"random": {"value": round(random, 5)}}
        row["new"] = figure(judged(net, day(size.enrolled), users))
        if name != "still":
            row["orb"] = figure(judged(net, day(0, "orb"), users))
            row["hand"] = figure(judged(net, day(0, "hand"), users))
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


def blocks(own: Crowd) -> tuple[Crowd, Crowd]:
    """Return the gestures of all blocks of time but the last, and those of the last."""
    session = own.touched.session
    late = np.zeros(len(session), dtype=np.bool_)
    for number in np.unique(session):
        events = np.flatnonzero(session == number)
        late[events[-max(1, len(events) // BLOCKS) :]] = True
    early = ~late
    edge = np.flatnonzero(late & np.roll(early, 1))  # the gesture between is nobody's
    early[edge - 1] = False
    return own.some(early), own.some(late)


def join(one: Crowd, other: Crowd) -> Crowd:
    """Return the gestures of two crowds as one."""
    a, b = one.touched, other.touched
    frames, sessions = len(a.examples.images), int(a.examples.session.max()) + 1
    examples = replace(
        a.examples,
        images=np.concatenate([a.examples.images, b.examples.images]),
        label=np.concatenate([a.examples.label, b.examples.label]),
        touch=np.concatenate([a.examples.touch, b.examples.touch]),
        ends=np.concatenate([a.examples.ends, b.examples.ends + frames]),
        session=np.concatenate([a.examples.session, b.examples.session + sessions]),
        idle=np.concatenate([a.examples.idle, b.examples.idle]),
    )
    touched = Touched(
        examples,
        np.concatenate([a.ends, b.ends + frames]),
        np.concatenate([a.event, b.event + len(a.label)]),
        np.concatenate([a.label, b.label]),
        np.concatenate([a.session, b.session + sessions]),
    )
    return Crowd(
        touched, np.concatenate([one.who, other.who]), np.concatenate([one.day, other.day])
    )


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
        kept = json.loads(path.read_text(encoding="utf-8"))
    found: dict[str, Any] = {}
    for name in parts:
        run, gestures = PARTS[name]
        told = repr((name, preset, seed, size, gestures, COURSE, MOOD, _code()))
        key = hashlib.sha256(told.encode()).hexdigest()[:24]
        if key not in kept:
            kept[key] = run(preset, seed, size, gestures)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
        found[name] = kept[key]
        say(f"{preset}, {name}: {json.dumps(found[name])}")
    return found


def _code() -> str:
    """Return what a result hangs on in this folder."""
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.glob("*.py")):
        if file.stem in ("judge", "lesson", "people", "study", "touched", "recipe"):
            digest.update(file.read_bytes())
    return digest.hexdigest()
