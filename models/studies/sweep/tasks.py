"""Tasks of a sweep: gestures, places, or users; each learned, and judged on what was held out.

A result is plain data. Whatever is learned is split as `models train` splits it: some of it
chooses the epoch; people's network has nothing to choose, and learns from all.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from models.data import splits, touch_images
from models.data.load import Data
from models.data.splits import Split
from models.evaluation import scores
from models.results.training import GestureResult, LocationResult
from models.studies.sweep.recipes import Asked
from models.training import user_task
from models.training.gesture_task import train_gestures
from models.training.location_task import train_locations
from models.training.loop import AT_ONCE, TrainingJob
from models.training.networks import Network
from models.training.user_task import UserGestures

# A GPU adds up in another order, and so does each kind of it: results would hang on the place.
DEVICE: Final = torch.device("cpu")

Result = dict[str, Any]


def _gestures(taught: Data, unseen: Data, asked: Asked, seed: int) -> Result:
    """Train CNN-3D.

    Returns:
        As `Task` says, with "frames" and "events" of each session, each [right, all]; and
        "confusion": events, true class by named class.
    """
    split = splits.hold_out(taught, "", seed)
    found, net = train_gestures(TrainingJob(taught, split, asked.recipe, seed, DEVICE, None))
    examples, classes = unseen.examples, len(unseen.vocabulary.labels)
    held, confusion = [], np.zeros((classes, classes), dtype=np.int64)
    for number in np.unique(examples.session[examples.ends]):
        ends = examples.ends[examples.session[examples.ends] == number]
        logits = _answers(net, examples.windows(ends))
        named = logits.argmax(axis=1)
        events = scores.events(examples, ends, scores.softmax(logits))
        confusion += scores.confusion(events.named, events.label, classes)
        held.append(
            {
                **_whose(unseen, int(number)),
                "frames": [int((named == examples.label[ends]).sum()), len(ends)],
                "events": [int((events.named == events.label).sum()), len(events.label)],
            }
        )
    return {
        "labels": list(unseen.vocabulary.labels),
        **_course(split, found),
        "held": held,
        "confusion": confusion.tolist(),
    }


def _places(taught: Data, unseen: Data, asked: Asked, seed: int) -> Result:
    """Train CNN-2D.

    Returns:
        As `Task` says, with "error" of each session: [sum, touches], means over the axes, grid
        units.
    """
    recipe, split = asked.recipe, splits.hold_out(taught, "", seed)
    found = touch_images.find(taught.examples, recipe.averaged, seed)
    judged = touch_images.find(unseen.examples, recipe.averaged, seed)
    if not len(found.images) or not len(judged.images):
        raise ValueError('no recording knows where a touch is; sweep task = "gesture" instead')
    learned, net = train_locations(TrainingJob(taught, split, recipe, seed, DEVICE, None), found)
    with torch.no_grad():
        off = net(torch.from_numpy(judged.images[judged.last])).numpy()
    each = np.abs(off - judged.place[judged.last]).mean(axis=1)
    session = unseen.examples.session[judged.frame[judged.last]]
    held = [
        {
            **_whose(unseen, int(number)),
            "error": [
                round(float(each[session == number].sum()), 6),
                int((session == number).sum()),
            ],
        }
        for number in np.unique(session)
    ]
    return {
        **_course(split, learned),
        "held": held,
    }


def _people(taught: Data, unseen: Data, asked: Asked, seed: int) -> Result:
    """Train the user network on people's gestures, and ask it who made those of other sessions.

    Returns:
        As `Task` says, with "frames" (windows of gestures) and "events" (gestures) of each session,
        each [right, all].
    """
    labels = range(1, len(taught.vocabulary.labels))
    names = np.unique(taught.user[np.unique(taught.examples.session)])
    own, new = (
        UserGestures.of(data.examples, labels, 1 + np.searchsorted(names, data.user))
        for data in (taught, unseen)
    )
    if not len(own.label) or not len(new.label):
        raise ValueError("no recording has a gesture; nobody can be told apart by it")
    out = user_task.random_windows(len(own.ends), seed)
    net, random = user_task.train_users(
        own, 1 + len(names), seed, recipe=asked.user, augmentation=asked.mood, random=out
    )
    named = 1 + user_task.gesture_evidence(net, new)[:, 1:].argmax(axis=1) == new.user
    answers = user_task.probabilities(net, new, new.ends)
    windows = 1 + answers[:, 1:].argmax(axis=1) == new.user[new.event]
    held = []
    for number in np.unique(new.session):
        events = new.session == number
        frames = events[new.event]
        held.append(
            {
                **_whose(unseen, int(number)),
                "frames": [int(windows[frames].sum()), int(frames.sum())],
                "events": [int(named[events].sum()), int(events.sum())],
            }
        )
    learned = int((~out).sum())
    passes = asked.user.passes(-(-learned // asked.user.batch) * asked.user.batch)
    return {
        "windows": learned,
        "epochs": passes,
        "best": passes,
        "check": None,
        "random": _number(random),
        "held": held,
    }


@dataclass(frozen=True, slots=True)
class Task:
    """What can be swept.

    Attributes:
        run: Takes what is learned from, what is held out, the recipe and the seed; returns the
            "windows" that were learned, "epochs" and the "best" of them; "check" and "random":
            scores on what chose the epoch and on windows at random; and "held": for each session
            held out its "user", "session" and counts.
        enrols: The same people are learned from and judged, on other days.
    """

    run: Callable[[Data, Data, Asked, int], Result]
    enrols: bool = False


# Another network is another line, and a measure in models/studies/sweep/figures.py.
TASKS: Final = {
    "gesture": Task(_gestures),
    "location": Task(_places),
    "user": Task(_people, enrols=True),
}


def _course(split: Split, found: GestureResult | LocationResult) -> Result:
    return {
        "windows": len(split.windows.train),
        "epochs": len(found.epochs),
        "best": found.best,
        "check": _number(found.honesty.unseen),
        "random": _number(found.honesty.random),
    }


def _number(value: float) -> float | None:
    return round(value, 6) if np.isfinite(value) else None


def _whose(data: Data, number: int) -> dict[str, str]:
    """Return whose a recording is; groups have names that no other has."""
    row = data.rows[number]
    return {
        "user": f"{data.user[number]} {row.user}".strip(),
        "session": f"{data.session[number]} {row.session}".strip(),
    }


def _answers(net: Network, windows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return logits, (windows, classes)."""
    with torch.no_grad():
        parts = [
            net(torch.from_numpy(windows[start : start + AT_ONCE])).numpy()
            for start in range(0, len(windows), AT_ONCE)
        ]
    return np.concatenate(parts)
