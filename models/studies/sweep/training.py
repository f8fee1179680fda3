"""One training of a sweep: read, hold out, train, and score what is held out.

The held-out recordings decide nothing, and all others are learned from, for as long as the recipe
says. By the others' cross-validation symmetries that no vocabulary declares are chosen.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.recognition.images.scale import FIRM
from models.data import load, splits, touch_images
from models.data.examples import Choice, Examples
from models.data.load import Data
from models.data.recipe import DEFAULT, Recipe
from models.data.splits import HoldOut
from models.data.touch_images import Touches
from models.evaluation import scores
from models.results.training import Epoch
from models.studies.sweep import baseline, plan
from models.studies.sweep.peers import PEERS
from models.studies.sweep.plan import Training
from models.training import symmetry_search
from models.training.gesture_task import gesture_task
from models.training.location_task import location_task
from models.training.loop import batched, fit, prepare_torch

KEPT: Final = 2  # data sets that a process keeps in memory; jobs of one set are neighbours
FIRM_SHARE: Final = 0.75  # quantile of the strength of touched images: a firm touch
# A GPU adds up in another order, and so does each kind of it: results would depend on the machine.
DEVICE: Final = torch.device("cpu")

Result = dict[str, Any]  # JSON
Scores = NDArray[np.bool_] | NDArray[np.floating]  # one for each judged item, (items,)


def train(job: Mapping[str, Any]) -> Result:
    """Train one network, judge it on what is held out, and return plain data; or raise ValueError.

    "learned": number of users, sessions, minutes and windows; "notes": sentences about recordings
    that are left out, and symmetries found; "epochs"; "random": score on windows at random; "held":
    for each held-out session its "user", "session", and [sum, count] of its scores.
    """
    asked = plan.training(job["train"])
    prepare_torch(asked.seed)
    plain = replace(asked.recipe, gesture=DEFAULT.gesture, location=DEFAULT.location)
    source = json.dumps(job["data"], sort_keys=True)
    data = _read(source, plain, asked.labels, asked.window, asked.every)
    # Recordings without a window are neither held out nor learned from.
    present = np.unique(data.examples.session[data.examples.ends]).astype(np.int64)
    user, session = data.user[present], data.session[present]
    test = dict(job["test"])
    fold = test.pop("fold")
    held = HoldOut(**test).held(user, session, fold)
    taken = splits.learned(user, session, held, asked.users, asked.sessions, asked.seed)
    if data.settings.normalise == "difference":
        data = replace(data, examples=scaled(data.examples, present[taken]))
    taught = _some(data, present[taken], asked.minutes)
    unseen = _some(data, present[held], 0.0)
    users = len(np.unique(user[taken]))
    asked = replace(asked, gesture=asked.gesture.of_people(users))
    result = TASKS[asked.task, asked.model](taught, unseen, asked)
    learned = {
        "users": users,
        "sessions": len(np.unique(session[taken])),
        "minutes": round(len(taught.examples.label) / data.settings.rate_hz / 60.0, 3),
        "windows": result.pop("windows"),
    }
    notes = [*data.notes, *result.pop("notes", ())]
    return {"learned": learned, "notes": notes, **result}


def scaled(examples: Examples, recordings: NDArray[np.int64]) -> Examples:
    """Return examples in which a firm touch, as in some recordings (n,), is as on the orb."""
    ends = examples.ends[np.isin(examples.session[examples.ends], recordings)]
    ends = ends[examples.label[ends] > 0]
    strength = np.abs(examples.images[ends] - 1.0).mean(axis=(1, 2))
    session = examples.session[ends]
    firm = [np.quantile(strength[session == one], FIRM_SHARE) for one in np.unique(session)]
    usual = float(np.median(firm)) if firm else 0.0
    if not usual > 0.0:
        return examples
    signal = np.float32(FIRM / usual) * (examples.images - np.float32(1.0))
    return replace(examples, images=signal + np.float32(1.0))


@lru_cache(maxsize=KEPT)
def _read(source: str, recipe: Recipe, labels: Choice, window: int, every: bool) -> Data:
    """Return the data set that [data] describes as JSON."""
    data = json.loads(source)
    folders = [Path(folder) for folder in data["folders"]]
    found = load.read(folders, recipe, labels, lambda _: None, window=window, every=every)
    if load.fingerprint(found.digest, found.vocabulary) != data["sha256"]:
        raise ValueError(
            f"the recordings in {', '.join(data['folders'])}, or their gestures.toml, differ on "
            "this machine; copy them again"
        )
    return found


def _some(data: Data, recordings: NDArray[np.int64], minutes: float) -> Data:
    """Return the data of some recordings, (n,); of each the first minutes (0: all)."""
    examples = data.examples
    kept = np.isin(examples.session, recordings)
    if minutes:
        begins = np.flatnonzero(np.diff(examples.session, prepend=-1))
        since = np.arange(len(kept)) - np.repeat(begins, np.diff([*begins, len(kept)]))
        kept &= since < minutes * 60.0 * data.settings.rate_hz
    ends = examples.ends[kept[examples.ends]]
    if not len(ends):
        raise ValueError("nothing is left to learn from; give more minutes, or record more")
    columns = ("images", "label", "touch", "session", "idle")
    own = {name: getattr(examples, name)[kept] for name in columns}
    moved = np.cumsum(kept) - 1  # a window is of neighbouring frames of one session: it stays whole
    return replace(data, examples=replace(examples, **own, ends=moved[ends]))


def _gestures(taught: Data, unseen: Data, asked: Training) -> Result:
    """Train CNN-3D; frames and events are judged."""
    recipe, seed, words = asked.gesture, asked.seed, ""
    parts = splits.undivided(len(taught.examples.ends), seed)
    if not asked.declared:
        taught, words = symmetry_search.declared(taught, parts.train, recipe, seed, DEVICE)
    task = gesture_task(taught, parts, recipe, seed, DEVICE)
    curve, net, examples = fit(task, seed), task.net.folded().eval(), unseen.examples
    logits = batched(net, lambda some: torch.from_numpy(examples.windows(some)), examples.ends)
    notes = [f"symmetries: {words}"] if words else []
    held = _judged(unseen, scores.softmax(logits.numpy()))
    return {**_summary(curve, len(parts.train)), "held": held, "notes": notes}


def _peer(taught: Data, unseen: Data, asked: Training) -> Result:
    """Train a peer on at most `baseline.LEARNED` windows, evenly spread; judge it as CNN-3D."""
    own, judged = taught.examples, unseen.examples
    ends = own.ends[:: -(-len(own.ends) // baseline.LEARNED)]
    known, label = np.unique(own.label[ends], return_inverse=True)
    peer = PEERS[asked.model](asked.gesture, asked.seed)
    peer.fit(own.windows(ends), label)
    answers = np.zeros((len(judged.ends), len(taught.vocabulary.labels)), dtype=np.float32)
    for first in range(0, len(answers), baseline.AT_ONCE):
        some = slice(first, first + baseline.AT_ONCE)
        answers[some, known] = peer.predict_proba(judged.windows(judged.ends[some]))
    return {**_summary((), len(ends)), "held": _judged(unseen, answers)}


def _judged(unseen: Data, probabilities: NDArray[np.floating]) -> list[Result]:
    """Return the scores of each held-out session, by probabilities (windows, classes)."""
    examples, held = unseen.examples, []
    session = examples.session[examples.ends]
    for number in np.unique(session):
        ends, own = examples.ends[session == number], probabilities[session == number]
        label, named = scores.events(examples, ends, own.astype(np.float64))
        right = own.argmax(axis=1) == examples.label[ends]
        held.append(_session(unseen, number, frames=right, events=named == label))
    return held


def _locations(taught: Data, unseen: Data, asked: Training) -> Result:
    """Train CNN-2D; each touch is judged by its error, grid units, mean of the axes."""
    found, judged = _located(taught, unseen, asked)
    parts = splits.undivided(len(found.images), asked.seed)
    task = location_task(taught, found, parts, asked.location, asked.seed, DEVICE)
    curve, net = fit(task, asked.seed), task.net.folded().eval()
    inputs, corners = asked.location.touch.of(judged.images[judged.last])
    places = batched(net, lambda some: torch.from_numpy(inputs[some]), np.arange(len(inputs)))
    held = _placed(unseen, judged, places.numpy() + corners)
    return {**_summary(curve, len(parts.train)), "held": held}


def _location_trees(taught: Data, unseen: Data, asked: Training) -> Result:
    """Train trees on shares of the sum, judged as CNN-2D is."""
    found, judged = _located(taught, unseen, asked)
    trees = baseline.train_places(found.images, found.place, asked.seed)
    places = trees.predict(baseline.shares(judged.images[judged.last]))
    return {**_summary((), len(found.images)), "held": _placed(unseen, judged, places)}


def _located(taught: Data, unseen: Data, asked: Training) -> tuple[Touches, Touches]:
    """Return the touches with a place to learn from and to judge; ValueError if there are none."""
    found, judged = (
        touch_images.find(data.examples, asked.averaged, asked.seed) for data in (taught, unseen)
    )
    if not len(found.images) or not len(judged.images):
        raise ValueError('no recording has positions of touches; sweep task = "gesture" instead')
    return found, judged


def _placed(unseen: Data, judged: Touches, places: NDArray[np.floating]) -> list[Result]:
    """Return the errors of each held-out session, by places (touches, 2), grid units."""
    error = np.abs(places - judged.place[judged.last]).mean(axis=1)
    session = unseen.examples.session[judged.frame[judged.last]]
    return [
        _session(unseen, number, error=error[session == number]) for number in np.unique(session)
    ]


# A task is a line here, and its measure in models/studies/sweep/report.py.
TASKS: Final[Mapping[tuple[str, str], Callable[[Data, Data, Training], Result]]] = {
    ("gesture", "network"): _gestures,
    **{("gesture", name): _peer for name in PEERS},
    ("location", "network"): _locations,
    ("location", "trees"): _location_trees,
}


def _summary(curve: tuple[Epoch, ...], windows: int) -> Result:
    """Return the counts of a training, and the last epoch's score on examples at random."""
    random = curve[-1].random if curve else np.nan
    known = round(random, 6) if np.isfinite(random) else None
    return {"windows": windows, "epochs": len(curve), "random": known}


def _session(data: Data, number: int, **items: Scores) -> Result:
    """Return the user and session of a recording, and [sum, count] of each of its scores."""
    row = data.rows[number]
    return {
        "user": f"{data.user[number]} {row.user}".strip(),  # groups have names that no other has
        "session": f"{data.session[number]} {row.session}".strip(),
        **{name: [round(own.sum().item(), 6), len(own)] for name, own in items.items()},
    }
