"""One training of a sweep: read, hold out, train as `models train` does, and judge what was held.

What is judged shares no session with the rest, and decides nothing.
"""

import json
import tempfile
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from models.data import load
from models.data.examples import Choice
from models.data.load import Data
from models.data.recipe import DEFAULT, Recipe
from models.data.simulate import generate
from models.studies.sweep import people, recipes
from models.studies.sweep.settings import data_set
from models.studies.sweep.tasks import TASKS, Result
from models.training.loop import prepare_torch

KEPT: Final = 2  # data sets that a process remembers; jobs of one set come after one another


def train(job: dict[str, Any]) -> Result:
    """Train one network, and judge it on what was held out.

    Args:
        job: As models/studies/sweep/jobs.py makes it.

    Returns:
        "learned": how many people, sessions, minutes and windows; "notes": which recordings are
        left out; and what models/studies/sweep/tasks.py returns.

    Raises:
        ValueError: It cannot be done; one sentence.
    """
    asked = job["train"]
    prepare_torch(asked["seed"])
    task, how = TASKS[asked["task"]], recipes.asked(asked)
    plain = replace(how.recipe, gesture=DEFAULT.gesture, location=DEFAULT.location)
    said = json.dumps(job["data"], sort_keys=True)
    data = _read(said, plain, asked["labels"], asked["window"], asked["all"])
    present = np.zeros(len(data.rows), dtype=np.bool_)
    present[np.unique(data.examples.session[data.examples.ends])] = True
    user, session = data.user[present], data.session[present]
    # Recordings without a window are nobody's: they are neither held out nor learned from.
    if task.enrols:
        held = people.held_of_each(user, session, job["test"])
    else:
        held = people.held(user if job["test"]["by"] == "user" else session, job["test"])
    taken = people.learned(user, session, held, asked)
    if task.enrols:  # nobody is asked who a stranger is
        held &= np.isin(user, user[taken])
    tested, chosen = np.zeros_like(present), np.zeros_like(present)
    tested[present], chosen[present] = held, taken
    taught, unseen = _only(data, chosen, asked["minutes"]), _only(data, tested, 0.0)
    count = len(np.unique(data.user[chosen]))
    recipe = replace(how.recipe, gesture=how.recipe.gesture.of_people(count))
    result = task.run(taught, unseen, replace(how, recipe=recipe), asked["seed"])
    learned = {
        "users": count,
        "sessions": len(np.unique(data.session[chosen])),
        "minutes": round(len(taught.examples.label) / data.settings.rate_hz / 60.0, 3),
        "windows": result.pop("windows"),
    }
    return {"learned": learned, "notes": list(data.notes), **result}


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
def _read(said: str, recipe: Recipe, labels: Choice, window: int, every: bool) -> Data:
    """Return what there is to learn from; simulated people are simulated here."""
    data = json.loads(said)
    if "folders" not in data:
        with tempfile.TemporaryDirectory(prefix="orbtouch-sweep-") as place:
            folder = Path(place)
            generate(data_set(data), folder, data["users"], data["sessions"], 1, _quiet)
            return load.read([folder], recipe, labels, _quiet, window=window, every=every)
    read = load.read([Path(one) for one in data["folders"]], recipe, labels, _quiet,
                        window=window, every=every)  # fmt: skip
    if load.fingerprint(read.digest, read.vocabulary) != data["sha256"]:
        listed = ", ".join(data["folders"])
        raise ValueError(
            f"the recordings in {listed}, or what gestures.toml says of them, are others here; "
            "copy them anew"
        )
    return read


def _quiet(line: str) -> None:
    """Say nothing: there are many trainings, and each is one line."""
