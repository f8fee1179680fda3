"""Bundles that identify users: a bundle gets a user network and its enrolled users."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import tomli_w
import torch
from numpy.typing import NDArray

from controller.bundles import bundle, container
from controller.bundles.bundle import Bundle
from controller.bundles.head import EVERYBODY
from controller.shared import files
from controller.shared.aliases import Say
from controller.shared.errors import count
from models.data.load import Data
from models.data.recipe import USER
from models.evaluation import user_metrics
from models.evaluation.user_metrics import FORGET_S, SEEN, STAY
from models.reports import cards
from models.results.training import Enrolled, SessionRow, UserResult
from models.training import export, user_task
from models.training.networks import Network
from models.training.request import Request
from models.training.user_task import UserGestures


@dataclass(frozen=True, slots=True)
class UserPlan:
    """A training of a user network."""

    request: Request  # its options
    data: Data  # examples
    names: tuple[str, ...]  # enrolled users; the network's outputs 1 and on
    labels: tuple[str, ...]  # gestures that identify them
    gestures: UserGestures  # gestures of all people, strangers among them
    held: NDArray[np.bool_]  # gestures that are held out, (events,)

    @property
    def enrolled(self) -> str:
        """Return the number of users in words."""
        return count(len(self.names), "person", "people")

    @classmethod
    def of(cls, request: Request, data: Data, base: Bundle, say: Say) -> "UserPlan":
        """Check a training, and announce it; ValueError, one sentence, if it cannot be done."""
        for note in data.notes:
            say(note)
        _check_windows(base, data)
        labels = _labels(request.gestures, data, base)
        names, gestures = _gestures(request, data, labels)
        if odd := sorted(set(base.taught) - {EVERYBODY, *names}):
            raise ValueError(
                f"the bundle was taught gestures of {odd[0]}, who was not recorded here; record "
                f"{odd[0]}, too, or name another bundle with --with"
            )
        made = cls(request, data, names, labels, gestures, _held(data, gestures, names))
        say(f"{made.enrolled}: {', '.join(names)}; identified by {', '.join(labels)}")
        return made

    def train(self, device: torch.device, folder: Path, say: Say) -> UserResult:
        """Train the networks; write the bundle, its card and its figures as JSON.

        The figures are of a network that learned nothing from the gestures held out; the bundle
        gets one that learned from all.
        """
        request, seed = self.request, self.request.seed
        learned = self.gestures.some(~self.held)
        random = user_task.random_windows(len(learned.ends), seed)
        train = partial(
            user_task.train_users,
            outputs=1 + len(self.names),
            seed=seed,
            recipe=USER.lasting(request.epochs or 0),
            folder=folder,
        )
        net, score = train(learned, random=random, name="users")
        found = _scored(self, net, score)
        net, _ = train(self.gestures, name="users, all")
        entry = f"{self.enrolled}, {request.command}; single gestures named rightly, unseen: "
        write_users(self, net, found, f"{entry}{found.seen[1].value:.1%}")
        cards.write(request.out, cards.users(found), found)
        return found


def write_users(plan: UserPlan, net: Network, found: UserResult, entry: str) -> None:
    """Write the base bundle with its users; mappings, strengths and rows of theirs stay."""
    request = plan.request
    data = files.read_bytes(request.base or bundle.default_path(), container.MAX_BYTES)
    base, parts = bundle.parse(data), container.unpack(data)
    table, content = container.manifest(parts[container.MANIFEST]), container.content(parts)
    exported = export.export_users(net, base.golden.windows)
    before = table.get("users", {})
    own = {
        key: {name: each for name, each in before.get(key, {}).items() if name in plan.names}
        for key in ("mapping", "strength")
    }
    table["users"] = {
        "names": list(plan.names),
        "gestures": list(plan.labels),
        "temperature": found.temperature,
        "accept": found.accept,
        "stay": STAY,
        "forget_s": FORGET_S,
        **{key: kept for key, kept in own.items() if kept},
    }
    table["card"]["users"] = entry
    golden = replace(base.golden, people=exported.outputs)
    content |= {**exported.parts, container.GOLDEN: golden.pack()}
    bundle.write(request.out, manifest=tomli_w.dumps(table).encode(), parts=content)


def _check_windows(base: Bundle, data: Data) -> None:
    """Raise ValueError if the recordings' windows are not the bundle's."""
    shape = data.examples.images.shape[1:]
    if shape != (base.rows, base.columns) or data.settings != base.preprocess.plain:
        raise ValueError(
            f"the recordings are of {shape[0]}×{shape[1]} taxels at {data.settings.rate_hz:g} Hz, "
            f"and the bundle makes its windows of {base.rows}×{base.columns} at "
            f"{base.rate_hz:g} Hz in another way; train its gestures on such recordings first, and "
            "name it with --with"
        )


def _labels(wanted: Sequence[str], data: Data, base: Bundle) -> tuple[str, ...]:
    """Return the gestures that identify users; ValueError if one is not known."""
    known = data.vocabulary.labels[1:]
    for label in wanted:
        if label not in known:
            raise ValueError(f"there is no gesture {label!r}; there are {', '.join(known)}")
    labels = tuple(wanted) or known
    if strange := [label for label in labels if label not in base.labels]:
        raise ValueError(
            f"the bundle does not know {' and '.join(strange)}; train its gestures on such "
            "recordings first, and name that bundle with --with, or choose others by --gestures"
        )
    return labels


def _gestures(
    request: Request, data: Data, labels: Sequence[str]
) -> tuple[tuple[str, ...], UserGestures]:
    """Return the enrolled users' names, and all people's gestures; ValueError if they are mixed."""
    strange = np.array([_within(row, request.others) for row in data.rows])
    for folder in request.others:
        if not any(_within(row, (folder,)) for row in data.rows):
            raise ValueError(f"{folder} holds nothing to learn strangers from; leave it out")
    if strange.all():
        raise ValueError("all recordings are of --others; name those of the people to enrol first")
    own = [row.user for row, out in zip(data.rows, strange, strict=True) if not out]
    names = tuple(sorted(set(own)))
    if not all(name.isascii() and name.isalnum() and len(name) <= 40 for name in names):
        raise ValueError(
            "a recording does not say who made it; rename it: sub-NAME_ses-DATE_run-01"
        )
    if len(names) < 2 and not strange.any():
        raise ValueError(
            f"only {names[0]} was recorded; record a second person, or others, who shall be "
            "nobody, and name them with --others DIR"
        )
    output = {name: number for number, name in enumerate(names, 1)}
    rows = zip(data.rows, strange, strict=True)
    user = np.array([0 if out else output[row.user] for row, out in rows])
    for group in (data.user, data.session):
        if any(len(set(user[group == number])) > 1 for number in np.unique(group)):
            raise ValueError(
                "recordings of two people share frames, or one person is to be known and is "
                "among the others as well; remove the copies"
            )
    classes = [data.vocabulary.labels.index(label) for label in labels]
    return names, UserGestures.of(data.examples, classes, user, data.session)


def _within(row: SessionRow, folders: Sequence[Path]) -> bool:
    return any(Path(row.path).is_relative_to(folder) for folder in folders)


def _held(data: Data, gestures: UserGestures, names: Sequence[str]) -> NDArray[np.bool_]:
    """Return which gestures are held out, (events,): users' last sessions, half the strangers."""
    person = data.user[gestures.session]
    stranger = gestures.user == 0
    held: NDArray[np.bool_] = stranger & np.isin(person, np.unique(person[stranger])[1::2])
    for number, name in enumerate(names, 1):
        own = gestures.user == number
        sessions = np.unique(gestures.day[own])
        if len(sessions) < 2:
            raise ValueError(
                f"{name} has one session only, and a network would learn that day, not {name}: "
                "record more on other days"
            )
        held |= own & (gestures.day == sessions[-1])
    return held


def _scored(plan: UserPlan, net: Network, random: float) -> UserResult:
    """Return the scores of a network on the gestures held out; `random` is by windows at random."""
    names, gestures, request = plan.names, plan.gestures, plan.request
    away = gestures.some(plan.held)
    found = user_task.gesture_evidence(net, away)
    strange = away.user == 0
    own = found[~strange], away.user[~strange], away.day[~strange]
    others = found[strange], away.day[strange]
    fitted = user_metrics.tuned((own[0], others[0]), own[1], others[1], len(names))
    known = replace(fitted, names=names)
    belief, first = user_metrics.beliefs(own[0], own[2], known, 1)
    right = 1 + belief[:, 1:].argmax(axis=1) == own[1][first]
    people = tuple(
        Enrolled(
            name,
            len(np.unique(gestures.day[gestures.user == number])),
            int((gestures.user == number).sum()),
            float(right[own[1][first] == number].mean()),
        )
        for number, name in enumerate(names, 1)
    )
    strangers = len(np.unique(plan.data.user[away.session[strange]]))
    return UserResult(
        name=request.out.name,
        command=request.command,
        gestures=plan.labels,
        people=people,
        random=random,
        seen={seen: user_metrics.share(*own, known, seen) for seen in SEEN},
        events=len(first),
        strangers=strangers,
        open=tuple(user_metrics.open_set(own, others, known, seen) for seen in SEEN)
        if strangers
        else (),
        temperature=known.temperature,
        accept=known.accept,
        notes=tuple(_notes(len(names), strangers)),
    )


def _notes(people: int, strangers: int) -> list[str]:
    """Return remarks on the limits of the figures, by number of users and of strangers."""
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
    return notes
