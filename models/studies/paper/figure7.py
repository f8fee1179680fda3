"""Figure 7 of the paper: gestures, ten users and places, each taught as in section 4.2.

One user makes each gesture by itself and presses the label button, and presses the places of the
taxels; ten users make one gesture, one session each. Windows at random are scored by what was
taught: the button's labels, the taxels that were aimed at; that is the most that the paper can have
done. Other days and people are scored by the truth, from the simulator.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.bundles import vocabulary
from controller.shared.aliases import Index
from controller.simulator.hand.gesture_file import shipped
from controller.simulator.hand.performance import GESTURES
from controller.simulator.hand.session_script import SessionScript
from controller.simulator.hand.user_style import person
from controller.simulator.orb import OrbSimulator
from controller.simulator.session import LABELS
from models.data import label_repair, touch_images
from models.data.augment import Symmetry
from models.data.examples import Examples, Source, prepare
from models.data.recipe import (
    RECIPES,
    UNVARIED_USER,
    USER,
    VARIED_USER,
    Recipe,
)
from models.data.simulate import DataSet
from models.data.splits import Parts
from models.evaluation import scores, user_metrics
from models.results.training import Epoch
from models.training import user_task
from models.training.gesture_task import GestureTask
from models.training.location_task import LocationTask
from models.training.loop import Task, fit, prepare_torch
from models.training.user_task import UserGestures, UserTask

RATE_HZ: Final = 10.0  # paper, section 4.1
WINDOW: Final = 10  # images: paper, section 4.1
OTHERS: Final = 3  # other people
DAYS: Final = 2  # other days of the same user
# Sessions that are judged, by user and number: other days, and other people.
SESSIONS: Final = [(0, 1 + day) for day in range(1 + DAYS)] + [(1 + u, 0) for u in range(OTHERS)]
JUDGED_MIN: Final = 6.0  # minutes of each of their sessions
EVERY: Final = 5  # from one judged window to the next: neighbours share most of their frames
USERS: Final = 10  # paper, section 4.2
USER_GESTURE: Final = GESTURES[2]  # clockwise twists: paper, section 4.2
USER_MINUTES: Final = 3.0  # of each one's session: some 500 windows, 5,000 of all, as the paper's
FEWER: Final = 4  # the paper's recipe runs for so many times fewer epochs than on gestures
_FAMILY: Final = 5  # of seeds, of sessions of presses only
_CHUNK: Final = 600  # frames simulated at once
SHARES: Final = (1 / 16, 1 / 8, 1 / 4, 1 / 2)  # of the examples
POINTS: Final = 30  # of a curve over the epochs, at most

Row = dict[str, float]


@dataclass(frozen=True, slots=True)
class Settings:
    """Amount of teaching and training."""

    minutes: float = 12.0  # of teaching
    epochs: int = 40  # of the paper's CNN-3D
    place_epochs: int = 400  # of the paper's CNN-2D
    seed: int = 7  # of users, sessions, and training

    def recipe(self, name: str) -> Recipe:
        """Return a recipe, the paper's with these numbers of epochs."""
        recipe = RECIPES[name]
        if name != "paper":
            return replace(recipe, gesture=recipe.gesture.of_people(1))
        return replace(
            recipe,
            gesture=recipe.gesture.lasting(self.epochs),
            location=recipe.location.lasting(self.place_epochs),
        )


PAPERS_OWN: Final = Settings(29.0, 500, 2000)  # paper, section 4.2; 30 minutes for places


@dataclass(frozen=True, slots=True)
class Experiment:
    """Training of one network, and its judgement on unseen sessions."""

    # returns the training task of a share of the examples, and their number
    task: Callable[[float], tuple[Task, int]]
    # returns a trained task's scores: "day", "people", ...; with True those of whole touches as
    # well, "day events" or "day presses", ...
    judge: Callable[[Any, bool], Row]


def curves(preset: str, recipe: str, network: str, settings: Settings) -> dict[str, Any]:
    """Return a network's scores over the epochs, and over the number of examples.

    They are plain data: `epochs` and `sizes`, each a dictionary of columns: "epoch", "examples",
    "train", "random" and those of the experiment; and "kept", the number of the kept epoch.
    """
    prepare_torch(settings.seed)
    experiment = NETWORKS[network](preset, recipe, settings)
    *epochs, last = _curve(experiment, 1.0, settings.seed)
    ends = [_curve(experiment, share, settings.seed)[-1] for share in SHARES]
    return {
        "kept": int(last["epoch"]),
        "epochs": _columns(epochs),
        "sizes": _columns([*ends, last]),
    }


def _curve(experiment: Experiment, share: float, seed: int) -> list[Row]:
    """Train, and return a row for some of the epochs, and last the one of the kept network."""
    torch.manual_seed(seed)
    task, examples = experiment.task(share)
    rows: list[Row] = []
    passes = task.recipe.passes(task.steps() * task.recipe.batch)
    shown = set(np.unique(np.geomspace(1, passes, POINTS).round().astype(int)).tolist())

    def row(epoch: Epoch, last: bool) -> Row:
        scores = {"train": epoch.train, "random": epoch.random, **experiment.judge(task, last)}
        return {"epoch": float(epoch.number), "examples": float(examples), **scores}

    def watch(epoch: Epoch) -> None:
        if epoch.number in shown:
            rows.append(row(epoch, last=False))

    epochs = fit(task, seed, None, watch)  # `watch` adds rows
    return [*rows, row(epochs[-1], last=True)]


def _columns(rows: list[Row]) -> dict[str, list[float]]:
    return {key: [round(row[key], 5) for row in rows] for key in rows[0]}


def gestures(preset: str, name: str, settings: Settings) -> Experiment:
    """Return the experiment of CNN-3D for the quality of an orb and the name of a recipe."""
    recipe = settings.recipe(name)
    taught = DataSet(settings.seed, settings.minutes, "blocks", preset)
    short = replace(taught, minutes=JUDGED_MIN)
    first = taught.session(0, 0)
    label = label_repair.repair(first, "button")[0] if recipe.repair else first.button
    sources = [Source.of(first, "button", label=label)]
    sources += [Source.of(short.session(*one)) for one in SESSIONS]
    examples = prepare(sources, recipe.settings(RATE_HZ, WINDOW))
    session = examples.session[examples.ends]
    own, judged = np.flatnonzero(session == 0), _judged(session)
    symmetry = Symmetry.of(vocabulary.shipped(), *examples.images.shape[1:])

    def task(share: float) -> tuple[Task, int]:
        check = np.flatnonzero(session == 1)[::EVERY]
        parts = _parts(own, check, _first_windows(examples, own, share), settings.seed)
        cpu = torch.device("cpu")
        taught = GestureTask(examples, parts, len(LABELS), symmetry, recipe.gesture, cpu)
        return taught, len(parts.train)

    def judge(trained: GestureTask, whole: bool) -> Row:
        row = {key: _right_windows(trained, at[::EVERY]) for key, at in judged.items()}
        if whole:
            row |= {f"{key} events": _right_events(trained, at) for key, at in judged.items()}
        return row

    return Experiment(task, judge)


def _judged(session: NDArray[np.integer]) -> dict[str, Index]:
    """Return the positions of other days, other people, and presses on sites, by session (n,)."""
    ends = np.cumsum([2, DAYS, OTHERS, 1])  # session 0 teaches, session 1 chooses the epoch
    at = {
        name: np.flatnonzero((session >= first) & (session < end))
        for name, (first, end) in zip(
            ("day", "people", "site"), itertools.pairwise(ends.tolist()), strict=True
        )
    }
    return {name: index for name, index in at.items() if len(index)}


def _parts(own: Index, check: Index, kept: Index, seed: int) -> Parts:
    """Split a user's examples as the paper, (n,), some kept for training and test."""
    random = user_task.random_windows(len(own), seed)
    train, test = (np.intersect1d(own[part], kept) for part in (~random, random))
    return Parts(train, check, test)


def _first_windows(examples: Examples, own: Index, share: float) -> Index:
    """Return the first windows of each class's block with its pauses, (n,): less training."""
    label = examples.label[examples.ends[own]]
    begins = [int(np.flatnonzero(label == number)[0]) for number in range(1, len(LABELS))]
    edges = [0, *sorted(begins), len(own)]
    blocks = [own[begin:end] for begin, end in itertools.pairwise(edges)]
    return np.concatenate([block[: math.ceil(share * len(block))] for block in blocks])


def _right_windows(trained: GestureTask, at: Index) -> float:
    """Return the share of windows (n,) whose class is recognised."""
    logits, label = trained.answers(trained.examples.ends[at])
    return float((logits.argmax(dim=1) == label).float().mean())


def _right_events(trained: GestureTask, at: Index) -> float:
    """Return the share of gestures in windows (n,) that their mean probability names."""
    ends = trained.examples.ends[at]
    logits, _ = trained.answers(ends)
    label, named = scores.events(trained.examples, ends, scores.softmax(logits.numpy()))
    return float((named == label).mean())


def places(preset: str, name: str, settings: Settings) -> Experiment:
    """Return the experiment of CNN-2D for the quality of an orb and the name of a recipe.

    The paper's recipe is taught by presses on the taxels, each labelled with its taxel; ours by as
    many minutes of presses anywhere, each labelled with its place. Scores are errors in grid units,
    means over the axes; "site" is another day's presses on the taxels, by the taxel aimed at.
    """
    recipe, on_sites = settings.recipe(name), name == "paper"
    sources = [
        presses(preset, settings.seed, 0, 0, settings.minutes, on_sites=on_sites),
        *(presses(preset, settings.seed, *one, JUDGED_MIN, on_sites=False) for one in SESSIONS),
        presses(preset, settings.seed, 0, 1 + DAYS + 1, JUDGED_MIN, on_sites=True),
    ]
    examples = prepare(sources, recipe.settings(RATE_HZ, WINDOW))
    found = touch_images.find(examples, recipe.averaged, settings.seed)
    session = examples.session[found.frame]
    own, judged, ends = np.flatnonzero(session == 0), _judged(session), found.last
    symmetry = Symmetry.of(vocabulary.shipped(), *examples.images.shape[1:])

    def task(share: float) -> tuple[Task, int]:
        kept = own[: math.ceil(share * len(own))]
        parts = _parts(own, np.flatnonzero(session == 1), kept, settings.seed)
        press = symmetry.common([LABELS.index("press")])
        taught = LocationTask(found, parts, press, recipe.location, torch.device("cpu"))
        return taught, len(parts.train)

    def judge(trained: LocationTask, whole: bool) -> Row:
        row = {key: _error(trained, at) for key, at in judged.items()}
        if whole:
            row |= {f"{key} presses": _error(trained, at[ends[at]]) for key, at in judged.items()}
        return row

    return Experiment(task, judge)


def _error(trained: LocationTask, at: Index) -> float:
    """Return the mean error of images (n,), grid units."""
    return float(np.abs(trained.errors(at)).mean())


def presses(
    preset: str, seed: int, user: int, day: int, minutes: float, *, on_sites: bool
) -> Source:
    """Return a session of presses only, by user and day, from 0.

    If `on_sites`, the taxels are pressed, and each press is labelled with the taxel aimed at; else
    any place, and it is labelled with the true place.
    """
    model = DataSet(preset=preset).model()
    orb, order = np.random.SeedSequence([_FAMILY, seed], spawn_key=(user, day, on_sites)).spawn(2)
    simulator = OrbSimulator(orb, RATE_HZ, model=model)
    each = simulator.steps_per_frame
    frames = round(minutes * 60 * RATE_HZ)
    script = _SiteScript if on_sites else SessionScript
    grid, steps = (model.rows, model.columns, model.pitch_mm), (frames * each, RATE_HZ * each)
    rng = np.random.default_rng(order)
    hand = script(*steps, grid, person(seed, user), (0.0, 0.0), shipped(), rng)
    hand.stream(("press",))
    scans = [
        simulator.advance(hand.point[at], hand.depth_mm[at], hand.radius_mm[at])
        for at in (slice(i * each, (i + _CHUNK) * each) for i in range(0, frames, _CHUNK))
    ]
    time_s = (np.arange(frames, dtype=np.float64) + 1.0) / RATE_HZ
    label, _ = hand.truth(time_s, LABELS)
    place = hand.contact(each)[:, 0, :2]
    place[label != LABELS.index("press")] = np.nan
    return Source(np.concatenate(scans), label, np.rint(place) if on_sites else place)


class _SiteScript(SessionScript):
    """Presses aimed at the taxels, as in section 4.2."""

    def _place(self, kind: str) -> tuple[float, float]:
        x, y = super()._place(kind)
        return float(np.rint(x)), float(np.rint(y))


def users(preset: str, name: str, settings: Settings) -> Experiment:
    """Return the experiment of the user network; "day" is another session of each user."""
    recipe, varied, plain = USER, VARIED_USER, settings.recipe(name)
    if name == "paper":
        epochs = max(1, plain.gesture.epochs // FEWER)
        recipe, varied = replace(plain.gesture, epochs=epochs), UNVARIED_USER
    data = DataSet(settings.seed, USER_MINUTES, preset=preset, gestures=(USER_GESTURE,))
    images = plain.settings(RATE_HZ, WINDOW)
    taught, other = (
        UserGestures.of(
            prepare((Source.of(data.session(user, day)) for user in range(USERS)), images),
            [1],
            np.arange(1, 1 + USERS),
        )
        for day in range(2)
    )
    known = user_metrics.users_of(USERS)

    def task(share: float) -> tuple[Task, int]:
        own = taught.some(_first_gestures(taught, share))
        random = user_task.random_windows(len(own.ends), settings.seed)
        return UserTask(own, 1 + USERS, recipe, varied, random), int((~random).sum())

    def judge(trained: UserTask, whole: bool) -> Row:
        answers = user_task.probabilities(trained.net, other, other.ends[::EVERY])
        right = answers[:, 1:].argmax(axis=1) + 1 == other.user[other.event[::EVERY]]
        row = {"day": float(right.mean())}
        if whole:
            evidence = user_task.gesture_evidence(trained.net, other)
            share = user_metrics.share(evidence, other.user, other.session, known)
            row["day events"] = share.value
        return row

    return Experiment(task, judge)


def _first_gestures(taught: UserGestures, share: float) -> NDArray[np.bool_]:
    """Return which gestures are the first ones of each user's session, (gestures,)."""
    session = taught.session
    kept = np.zeros(len(session), dtype=np.bool_)
    for number in np.unique(session):
        own = np.flatnonzero(session == number)
        kept[own[: max(1, round(share * len(own)))]] = True
    return kept


NETWORKS: Final[dict[str, Callable[[str, str, Settings], Experiment]]] = {
    "CNN-3D": gestures,
    "users": users,
    "CNN-2D": places,
}
