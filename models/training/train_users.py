"""`models train --task user`: from recordings of several people to a bundle that knows them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import bundle, mapping_file
from controller.bundles.bundle import Bundle
from controller.recognition.user_id import Users
from models import text, user_files
from models.data import load, splits
from models.data.examples import refuse_test_seed
from models.data.load import Choice, Data
from models.data.recipe import RECIPES
from models.evaluation import user_metrics
from models.evaluation.user_metrics import FORGET_S, SEEN, STAY
from models.reports import users_page
from models.results.training import SessionRow
from models.results.users import Enrolled, Telling
from models.training import enroll, user_task
from models.training.loop import prepare_torch
from models.training.networks import GestureNet
from models.training.user_recipe import COURSE, MOOD
from models.training.user_task import People
from models.training.user_windows import Index, Touched

Say = Callable[[str], None]
SPLITS: Final = ("session", "time")
LATE: Final = 6  # of a session's gestures one in so many, the last ones, where time is split


@dataclass(frozen=True, slots=True)
class Request:
    """What somebody asked for.

    Attributes:
        paths: Recordings of the people to enrol, at least two sessions of each.
        out: The bundle.
        others: Recordings of people who shall not be known.
        base: The bundle that people are added to; None: the one that ships.
        gestures: Labels that tell; (): all.
        labels: Whose labels count.
        every: Recordings that fail the check are taken too.
        split: "session" or "time".
        seed: Of everything random.
        epochs: 0: the course's.
        command: What was typed.
        mapping: What gestures mean for single people: its [users.NAME]; None: what the bundle says.
    """

    paths: tuple[Path, ...]
    out: Path
    others: tuple[Path, ...] = ()
    base: Path | None = None
    gestures: tuple[str, ...] = ()
    labels: Choice = "auto"
    every: bool = False
    split: str = ""
    seed: int = 0
    epochs: int = 0
    command: str = ""
    mapping: Path | None = None


@dataclass(frozen=True, slots=True)
class Group:
    """Gestures, and who made them.

    Attributes:
        touched: Them.
        who: Output of the network for whoever made each, 0 is nobody known, (events,).
        person: Which person, enrolled or not, (events,).
        session: Which session, (events,).
    """

    touched: Touched
    who: Index
    person: Index
    session: Index

    def some(self, events: NDArray[np.bool_]) -> "Group":
        """Return some of them."""
        return Group(
            self.touched.some(events), self.who[events], self.person[events], self.session[events]
        )


def train(request: Request, say: Say) -> Telling:
    """Train; write the bundle, its card and its figures.

    Raises:
        ValueError: It cannot be done; one sentence.
    """
    refuse_test_seed(request.seed, "this training")
    user_files.bundle_target(request.out)
    base = bundle.read(request.base or bundle.default_path())
    rules = mapping_file.read(request.mapping, base.labels) if request.mapping is not None else None
    prepare_torch(request.seed)
    data = load.read(
        (*request.paths, *request.others), RECIPES["default"], request.labels, say,
        window=base.window, every=request.every,
    )  # fmt: skip
    for note in data.notes:
        say(note)
    _fits(base, data)
    gestures = _gestures(request.gestures, data, base)
    names, group = _people(request, data, gestures)
    if rules is not None:  # a mistake in it is told before anything is learned
        Users(names).overridden(*rules)
    held = _held(group, names, request.split)
    count = text.several(len(names), "person", "people")
    say(f"{count}: {', '.join(names)}; told by {', '.join(gestures)}")
    found, who = _judge(request, group, held, names, gestures)
    whole = _learn(group, len(names), request)[0] if request.split != "time" else who[0]
    known = Users(names, tuple(gestures), *who[1], STAY, FORGET_S)
    path = request.base or bundle.default_path()
    said = f"{count}, {request.command}; single gestures named rightly, unseen: "
    said += f"{found.seen[1].value:.1%}"
    enroll.write(path, request.out, whole, known, said, request.mapping)
    users_page.write(request.out, found)
    return found


def _fits(base: Bundle, data: Data) -> None:
    """Refuse recordings whose windows are not the bundle's.

    Raises:
        ValueError: They are not.
    """
    shape = data.examples.images.shape[1:]
    if shape != (base.rows, base.columns) or data.settings != base.preprocess:
        raise ValueError(
            f"the recordings are of {shape[0]}×{shape[1]} taxels at {data.settings.rate_hz:g} Hz, "
            f"and the bundle makes its windows of {base.rows}×{base.columns} at "
            f"{base.rate_hz:g} Hz in another way; train its gestures on such recordings first, and "
            "name it with --with"
        )


def _gestures(wanted: Sequence[str], data: Data, base: Bundle) -> tuple[str, ...]:
    """Return the labels that tell.

    Raises:
        ValueError: One was not recorded, or the bundle would never answer it.
    """
    known = data.vocabulary.labels[1:]
    for label in wanted:
        if label not in known:
            raise ValueError(f"there is no gesture {label!r}; there are {', '.join(known)}")
    told = tuple(wanted) or known
    if strange := [label for label in told if label not in base.labels]:
        both = ",".join(label for label in known if label in base.labels)
        raise ValueError(
            f"the bundle does not know {' and '.join(strange)}; train its gestures on such "
            "recordings first, and name that bundle with --with"
            + (f", or leave some out: --gestures {both}" if both else "")
        )
    return told


def _people(request: Request, data: Data, gestures: Sequence[str]) -> tuple[tuple[str, ...], Group]:
    """Return who is enrolled, and everybody's gestures.

    Raises:
        ValueError: Somebody has no name, shares recordings with another, or is alone.
    """
    labels = [data.vocabulary.labels.index(label) for label in gestures]
    touched = Touched.of(data.examples, labels)
    other = np.array([_among(row, request.others) for row in data.rows])
    for folder in request.others:
        if not any(_among(row, (folder,)) for row in data.rows):
            raise ValueError(f"{folder} holds nothing to learn strangers from; leave it out")
    if other.all():
        raise ValueError("all recordings are of --others; name those of the people to enrol first")
    own = [row.user for row, out in zip(data.rows, other, strict=True) if not out]
    names = tuple(sorted(set(own)))
    if not all(name.isascii() and name.isalnum() and len(name) <= 40 for name in names):
        raise ValueError(
            "a recording does not say who made it; rename it: sub-NAME_ses-DATE_run-01"
        )
    if len(names) < 2 and not other.any():
        raise ValueError(
            f"only {names[0]} was recorded; record a second person, or others, who shall be "
            "nobody, and name them with --others DIR"
        )
    who = np.array(
        [0 if out else 1 + names.index(row.user) for row, out in zip(data.rows, other, strict=True)]
    )
    for group in (data.user, data.session):
        for number in np.unique(group):
            if len(set(who[group == number])) > 1:
                raise ValueError(
                    "recordings of two people share frames, or one person is to be known and is "
                    "among the others as well; remove the copies"
                )
    at = touched.session
    return names, Group(touched, who[at].astype(np.int64), data.user[at], data.session[at])


def _among(row: SessionRow, folders: Sequence[Path]) -> bool:
    return any(Path(row.path).is_relative_to(folder) for folder in folders)


def _held(group: Group, names: Sequence[str], split: str) -> NDArray[np.bool_]:
    """Return which gestures are held out: each person's last session, and half of the others.

    Raises:
        ValueError: Somebody has one session only, or there is no such split.
    """
    if (split or "session") not in SPLITS:
        splits.require(split)  # says why windows at random are refused
        raise ValueError(f"people are split by {' or '.join(SPLITS)}, not by {split}")
    held = np.zeros(len(group.who), dtype=np.bool_)
    for number, name in enumerate(names, 1):
        own = group.who == number
        sessions = np.unique(group.session[own])
        if split == "time":
            for session in sessions:
                events = np.flatnonzero(own & (group.session == session))
                held[events[-max(1, len(events) // LATE) :]] = True
        elif len(sessions) < 2:
            raise ValueError(
                f"{name} has one session only, and a network would learn that day, not {name}: "
                "record more on other days, or see with --split time what one is worth"
            )
        else:
            held |= own & (group.session == sessions[-1])
    strangers = np.unique(group.person[group.who == 0])
    held |= (group.who == 0) & np.isin(group.person, strangers[1::2])
    return held


def _learn(
    group: Group, people: int, request: Request, random: NDArray[np.bool_] | None = None
) -> tuple[GestureNet, float]:
    """Return a network, and its score on windows at random."""
    course = replace(COURSE, epochs=request.epochs or COURSE.epochs)
    work = People(group.touched, group.who, 1 + people, course, MOOD, random)
    net = user_task.teach(work, request.seed, user_task.silent)
    work.net = net
    return net, work.random()


def _judge(
    request: Request,
    group: Group,
    held: NDArray[np.bool_],
    names: Sequence[str],
    gestures: tuple[str, ...],
) -> tuple[Telling, tuple[GestureNet, tuple[float, float]]]:
    """Train without what is held out, and say what that is worth."""
    learned = group.some(~_near(group, held) if request.split == "time" else ~held)
    drawn = user_task.drawn(len(learned.touched.ends), request.seed)
    net, random = _learn(learned, len(names), request, drawn)
    away = group.some(held)
    said = user_task.said(net, away.touched)
    strange = away.who == 0
    own = said[~strange], away.who[~strange], away.session[~strange]
    others = said[strange], away.session[strange]
    fitted = user_metrics.tuned((own[0], others[0]), own[1], others[1], len(names))
    known = replace(fitted, names=tuple(names))
    belief, first = user_metrics.beliefs(own[0], own[2], known, 1)
    right = 1 + belief[:, 1:].argmax(axis=1) == own[1][first]
    people = tuple(
        Enrolled(
            name,
            len(np.unique(group.session[group.who == number])),
            int((group.who == number).sum()),
            float(right[own[1][first] == number].mean()),
        )
        for number, name in enumerate(names, 1)
    )
    strangers = len(np.unique(away.person[strange]))
    found = Telling(
        name=request.out.name,
        command=request.command,
        gestures=gestures,
        people=people,
        split=(
            "Held out: the last gestures of each session, which says little of another day."
            if request.split == "time"
            else "Held out: the last session of each; the network in the bundle learned from all."
        ),
        random=random,
        seen={seen: user_metrics.share(*own, known, seen) for seen in SEEN},
        events=len(first),
        strangers=strangers,
        open=tuple(user_metrics.openly(own, others, known, seen) for seen in SEEN)
        if strangers
        else (),
        temperature=known.temperature,
        accept=known.accept,
        notes=_notes(len(names), strangers),
    )
    return found, (net, (known.temperature, known.accept))


def _notes(people: int, strangers: int) -> tuple[str, ...]:
    """Return what else there is to say of so many people, and strangers held out."""
    notes = []
    if people == 1:
        notes.append(
            "One person alone is enrolled, so which of them it is was no question: what counts is "
            "how strangers fare."
        )
    if not strangers:
        notes.append(
            "Nobody was held out as a stranger, so nothing is known of how often one is taken for "
            "somebody; add recordings of two others or more with --others DIR."
        )
    return tuple(notes)


def _near(group: Group, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return what is held out and the gesture before it: their windows may share frames."""
    near = held.copy()
    near[:-1] |= held[1:] & (group.session[1:] == group.session[:-1])
    return near
