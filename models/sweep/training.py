"""One training of a sweep: read, hold out, train as `models train` does, and judge what was held.

What is judged shares no session with the rest, and decides nothing. The rest is split as `models
train` splits it: some of it chooses the epoch.
"""

import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from models import learn, reading, scores, splitting, touches
from models.fit import prepare_torch
from models.lessons import AT_ONCE
from models.networks import GestureNet
from models.reading import Data
from models.recipe import DEFAULT, RECIPES, Recipe
from models.simulate import generate
from models.splitting import Split
from models.sweep import people, recipes
from models.sweep.settings import KINDS, data_set

KEPT: Final = 2  # data sets that a process remembers; jobs of one set come after one another
# A GPU adds up in another order, and so does each kind of it: results would hang on the place.
DEVICE: Final = torch.device("cpu")

Result = dict[str, Any]


def train(job: dict[str, Any]) -> Result:
    """Train one network, and judge it on what was held out.

    Args:
        job: As models/sweep/jobs.py makes it.

    Returns:
        "learned": how many people, sessions, minutes and windows; "epochs", and the "best" of
        them; "check" and "random": scores on what chose the epoch and on windows at random; and
        "held": for each session held out its "user", "session" and counts, see `TASKS`.

    Raises:
        ValueError: It cannot be done; one sentence.
    """
    asked = job["train"]
    prepare_torch(asked["seed"])
    own = {key: value for key, value in asked.items() if key not in KINDS["train"]}
    recipe = recipes.changed(RECIPES[asked["recipe"]], own)
    plain = replace(recipe, gesture=DEFAULT.gesture, location=DEFAULT.location)
    data = _read(json.dumps(job["data"], sort_keys=True), plain, asked["labels"], asked["window"])
    present = np.zeros(len(data.rows), dtype=np.bool_)
    present[np.unique(data.examples.session[data.examples.ends])] = True
    unit = data.user if job["test"]["by"] == "user" else data.session
    # Recordings without a window are nobody's: they are neither held out nor learned from.
    tested = np.zeros_like(present)
    tested[present] = people.held(unit[present], job["test"])
    chosen = np.zeros_like(present)
    chosen[present] = people.learned(
        data.user[present], data.session[present], tested[present], asked
    )
    taught, unseen = _only(data, chosen, asked["minutes"]), _only(data, tested, 0.0)
    count = len(np.unique(data.user[chosen]))
    recipe = replace(recipe, gesture=recipe.gesture.of_people(count))
    split = splitting.split(taught, "", asked["seed"])
    result = TASKS[asked["task"]](taught, unseen, split, recipe, asked["seed"])
    return {
        "learned": {
            "users": count,
            "sessions": len(np.unique(data.session[chosen])),
            "minutes": round(len(taught.examples.label) / data.settings.rate_hz / 60.0, 3),
            "windows": len(split.windows.train),
        },
        **result,
    }


def _gestures(taught: Data, unseen: Data, split: Split, recipe: Recipe, seed: int) -> Result:
    """Train CNN-3D.

    Returns:
        `train`'s, with "frames" and "events" of each session, each [right, all]; and "confusion":
        events, true class by named class.
    """
    found, net = learn.gestures(learn.Work(taught, split, recipe, seed, DEVICE, None))
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
        **_course(found.epochs, found.best, found.honesty.unseen, found.honesty.random),
        "held": held,
        "confusion": confusion.tolist(),
    }


def _places(taught: Data, unseen: Data, split: Split, recipe: Recipe, seed: int) -> Result:
    """Train CNN-2D.

    Returns:
        `train`'s, with "error" of each session: [sum, touches], means over the axes, grid units.
    """
    found = touches.find(taught.examples, recipe.averaged, seed)
    judged = touches.find(unseen.examples, recipe.averaged, seed)
    if not len(found.images) or not len(judged.images):
        raise ValueError('no recording knows where a touch is; sweep task = "gesture" instead')
    learned, net = learn.places(learn.Work(taught, split, recipe, seed, DEVICE, None), found)
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
        **_course(learned.epochs, learned.best, learned.honesty.unseen, learned.honesty.random),
        "held": held,
    }


# What can be swept; another network is another line, and a measure in models/sweep/figures.py.
TASKS: Final[dict[str, Callable[[Data, Data, Split, Recipe, int], Result]]] = {
    "gesture": _gestures,
    "location": _places,
}


def _course(epochs: tuple[Any, ...], best: int, check: float, random: float) -> Result:
    return {
        "epochs": len(epochs),
        "best": best,
        "check": _number(check),
        "random": _number(random),
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


def _answers(net: GestureNet, windows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return logits, (windows, classes)."""
    with torch.no_grad():
        parts = [
            net(torch.from_numpy(windows[start : start + AT_ONCE])).numpy()
            for start in range(0, len(windows), AT_ONCE)
        ]
    return np.concatenate(parts)


def _only(data: Data, chosen: NDArray[np.bool_], minutes: float) -> Data:
    """Return what some of the recordings hold, of each the first minutes (0: all)."""
    examples = data.examples
    kept = chosen[examples.session]
    if minutes:
        begins = np.flatnonzero(np.diff(examples.session, prepend=-1))
        since = np.arange(len(kept)) - np.repeat(begins, np.diff([*begins, len(kept)]))
        kept &= since < minutes * 60.0 * data.settings.rate_hz
    ends = examples.ends[kept[examples.ends]]
    if not len(ends):
        raise ValueError("nothing is left to learn from; say more minutes, or record more")
    moved = np.cumsum(kept) - 1  # windows are of frames in a row, of one session: they stay whole
    own = replace(
        examples,
        images=examples.images[kept],
        label=examples.label[kept],
        touch=examples.touch[kept],
        ends=moved[ends],
        session=examples.session[kept],
        idle=examples.idle[kept],
    )
    return replace(data, examples=own)


@lru_cache(maxsize=KEPT)
def _read(said: str, recipe: Recipe, labels: reading.Choice, window: int) -> Data:
    """Return what there is to learn from; simulated people are simulated here."""
    data = json.loads(said)
    if "folders" not in data:
        with tempfile.TemporaryDirectory(prefix="orbtouch-sweep-") as place:
            folder = Path(place)
            generate(data_set(data), folder, data["users"], data["sessions"], 1, _quiet)
            return reading.read([folder], recipe, labels, _quiet, window=window)
    read = reading.read([Path(one) for one in data["folders"]], recipe, labels, _quiet,
                        window=window)  # fmt: skip
    if read.digest != data["sha256"]:
        listed = ", ".join(data["folders"])
        raise ValueError(f"the recordings in {listed} are others here; copy them anew")
    return read


def _quiet(line: str) -> None:
    """Say nothing: there are many trainings, and each is one line."""
