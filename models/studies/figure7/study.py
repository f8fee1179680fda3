"""Figure 7 measured: one user teaches, and both recipes are judged twice.

Parts c and d, ten users, are in models/studies/figure7/people.py.

As in section 4.2, one user makes each gesture by itself and presses the label button, and presses
the places of the taxels. The networks are judged on windows drawn at random from the same session,
which is the most that the paper can have done, and on other days and other people.

The first is scored by what was taught: the button's labels, the taxels that were aimed at. The
others are scored by the truth, which the simulator knows.
"""

import hashlib
import json
import math
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from controller.bundles import vocabulary
from controller.recordings.recording import Recording
from controller.simulator.presets import PRESETS
from controller.simulator.session import LABELS
from models import user_files
from models.data import label_repair as people
from models.data import splits, touch_images
from models.data.augment import Symmetry
from models.data.examples import Source, prepare
from models.data.recipe import RECIPES, Recipe
from models.data.simulate import DataSet
from models.data.splits import Parts
from models.studies.figure7 import people as ten
from models.studies.figure7.curves import Row, Say, curve, error, events, first, share, study
from models.studies.figure7.pressing import RATE_HZ, pressing
from models.training.gesture_task import GestureTask
from models.training.location_task import LocationTask

WINDOW: Final = 10  # images: likewise
RANDOM: Final = 0.1  # share of the windows that are drawn at random; the paper does not say
OTHERS: Final = 3  # other people
DAYS: Final = 2  # other days of the same user
JUDGED_MIN: Final = 6.0  # minutes of each of their sessions
EVERY: Final = 5  # so manieth of their windows is judged: neighbours share most of their frames


@dataclass(frozen=True, slots=True)
class Settings:
    """How much is measured.

    Attributes:
        minutes: Of teaching; the paper's 29, and 30 for places.
        epochs: Of the paper's CNN-3D; its own are 500.
        place_epochs: Of the paper's CNN-2D; its own are 2,000.
        seed: Of users, sessions, and training.
    """

    minutes: float = 12.0
    epochs: int = 40
    place_epochs: int = 400
    seed: int = 7

    def recipe(self, name: str) -> Recipe:
        """Return a recipe, the paper's with so many epochs."""
        recipe = RECIPES[name]
        if name != "paper":
            return replace(recipe, gesture=recipe.gesture.of_people(1))
        return replace(
            recipe,
            gesture=recipe.gesture.lasting(self.epochs),
            location=recipe.location.lasting(self.place_epochs),
        )


def measure(settings: Settings, path: Path, say: Say) -> dict[str, Any]:
    """Return everything, measuring what the file does not hold yet.

    Args:
        settings: How much.
        path: Where the results are; written after each part, so that an interrupted one goes on.
        say: Takes lines of progress.

    Returns:
        "settings"; "labels": what `labels` returns for each preset; and "parts": for each preset,
        recipe and network what `gestures`, `people` or `locations` returns, under "PRESET RECIPE
        NETWORK".
    """
    fresh: dict[str, Any] = {"settings": asdict(settings), "parts": {}}
    found = _kept(path) if path.exists() else fresh
    if found["settings"] != fresh["settings"]:
        found = fresh
    found["labels"] = {preset: labels(preset, settings) for preset in PRESETS}
    _keep(path, found)
    for name in RECIPES:
        recipe = settings.recipe(name)
        people = partial(_people, recipe=recipe)
        for preset in PRESETS:
            for network, trained, own in (
                ("CNN-3D", gestures, _digest(recipe)),
                (ten.NETWORK, people, _digest(recipe, ten.course(name, recipe))),
                ("CNN-2D", locations, _digest(recipe)),
            ):
                key = f"{preset} {name} {network}"
                if found["parts"].get(key, {}).get("recipe") == own:
                    continue
                part = trained(preset, name, settings, say)
                found["parts"][key] = {"recipe": own, **part}
                _keep(path, found)
    found["parts"] = dict(sorted(found["parts"].items(), key=lambda part: _place(part[0])))
    _keep(path, found)
    return found


def _kept(path: Path) -> dict[str, Any]:
    """Return what a file holds.

    Raises:
        UserFileError: It cannot be read, or holds something else.
    """
    found = user_files.read_json(path)
    if isinstance(found, dict) and {"settings", "parts"} <= set(found):
        parts = found["parts"]
        if isinstance(parts, dict) and all(isinstance(part, dict) for part in parts.values()):
            return found
    raise user_files.UserFileError(
        f"{path} holds no figures of this program; remove it, or choose another DIR"
    )


def _keep(path: Path, found: dict[str, Any]) -> None:
    user_files.write_text(path, f"{json.dumps(found, indent=1)}\n")


def _people(
    preset: str, name: str, settings: Settings, say: Say, *, recipe: Recipe
) -> dict[str, Any]:
    return ten.people(preset, name, recipe, settings.seed, say)


def _place(key: str) -> tuple[int, ...]:
    """Return where a part stands in the tables: by preset and network, the paper's recipe first."""
    preset, name, network = key.split()
    networks = ("CNN-3D", ten.NETWORK, "CNN-2D")
    return list(PRESETS).index(preset), networks.index(network), -list(RECIPES).index(name)


def _digest(recipe: Recipe, *more: object) -> str:
    """Return what a result hangs on beside the settings, as far as it is told by numbers."""
    told = repr((recipe, recipe.settings(RATE_HZ, WINDOW), *more))
    return hashlib.sha256(told.encode()).hexdigest()[:16]


def gestures(preset: str, name: str, settings: Settings, say: Say) -> dict[str, Any]:
    """Train CNN-3D, and return its curve over epochs and over examples.

    Args:
        preset: Quality of the orb.
        name: Of the recipe.
        settings: How much.
        say: Takes lines of progress.

    Returns:
        Plain data: `epochs` and `sizes`, each a dictionary of columns: "epoch" or "examples",
        "train", "random", "day", "people"; and "kept", the number of the epoch that is kept.
    """
    recipe = settings.recipe(name)
    data = DataSet(settings.seed, settings.minutes, "blocks", preset)
    short = replace(data, minutes=JUDGED_MIN)
    taught = data.session(0, 0)
    judged = [short.session(0, 1 + day) for day in range(1 + DAYS)]
    judged += [short.session(1 + user, 0) for user in range(OTHERS)]
    sources = [_as_taught(taught, recipe), *(Source.of(one) for one in judged)]
    examples = prepare(sources, recipe.settings(RATE_HZ, WINDOW))
    of = examples.session[examples.ends]
    sets = {
        "day": np.flatnonzero((of >= 2) & (of < 2 + DAYS)),
        "people": np.flatnonzero(of >= 2 + DAYS),
    }
    own = np.flatnonzero(of == 0)
    random = splits.random_windows(len(own), RANDOM, np.random.default_rng(settings.seed))
    symmetry = Symmetry.of(vocabulary.shipped(), *examples.images.shape[1:])

    def run(part: float) -> list[Row]:
        kept = first(examples, own, part)
        parts = Parts(
            np.intersect1d(own[random.train], kept),
            np.flatnonzero(of == 1)[::EVERY],
            np.intersect1d(own[random.test], kept),
        )
        torch.manual_seed(settings.seed)
        task = GestureTask(
            examples, parts, len(LABELS), symmetry, recipe.gesture, torch.device("cpu")
        )

        def judge(last: bool) -> dict[str, float]:
            row = {key: share(task, at[::EVERY]) for key, at in sets.items()}
            if last:
                row |= {f"{key} events": events(task, at) for key, at in sets.items()}
            return row

        return curve(task, judge, len(parts.train), settings.seed)

    return study(run, f"{preset}, recipe {name}: CNN-3D", say)


def locations(preset: str, name: str, settings: Settings, say: Say) -> dict[str, Any]:
    """Train CNN-2D, and return its curve over epochs and over examples.

    The paper's recipe learns from presses on the taxels, each labelled with its taxel; ours from as
    many minutes of presses anywhere, each labelled with its place.

    Args:
        preset: Quality of the orb.
        name: Of the recipe.
        settings: How much.
        say: Takes lines of progress.

    Returns:
        As `gestures`; errors in grid units, means over the axes. "site" is another day's presses
        on the taxels, judged by what was aimed at.
    """
    recipe = settings.recipe(name)
    on_sites = name == "paper"
    minutes = (settings.minutes, JUDGED_MIN)
    sources = [pressing(preset, settings.seed, 0, 0, minutes[0], on_sites=on_sites)]
    for user, day in [(0, 1 + d) for d in range(1 + DAYS)] + [(1 + u, 0) for u in range(OTHERS)]:
        sources.append(pressing(preset, settings.seed, user, day, minutes[1], on_sites=False))
    sources.append(pressing(preset, settings.seed, 0, 1 + DAYS + 1, minutes[1], on_sites=True))
    examples = prepare(sources, recipe.settings(RATE_HZ, WINDOW))
    found = touch_images.find(examples, recipe.averaged, settings.seed)
    of = examples.session[found.frame]
    sets = {
        "day": np.flatnonzero((of >= 2) & (of < 2 + DAYS)),
        "people": np.flatnonzero((of >= 2 + DAYS) & (of < 2 + DAYS + OTHERS)),
        "site": np.flatnonzero(of == 2 + DAYS + OTHERS),
    }
    own, ends = np.flatnonzero(of == 0), found.last
    random = splits.random_windows(len(own), RANDOM, np.random.default_rng(settings.seed))
    press = LABELS.index("press") - 1
    whole = Symmetry.of(vocabulary.shipped(), *examples.images.shape[1:])

    def run(part: float) -> list[Row]:
        kept = own[: math.ceil(part * len(own))]
        parts = Parts(
            np.intersect1d(own[random.train], kept),
            np.flatnonzero(of == 1),
            np.intersect1d(own[random.test], kept),
        )
        torch.manual_seed(settings.seed)
        task = LocationTask(
            found, parts, whole.common([1 + press]), recipe.location, torch.device("cpu")
        )

        def judge(last: bool) -> dict[str, float]:
            row = {key: error(task, at) for key, at in sets.items()}
            if last:
                row |= {f"{key} presses": error(task, at[ends[at]]) for key, at in sets.items()}
            return row

        return curve(task, judge, len(parts.train), settings.seed)

    return study(run, f"{preset}, recipe {name}: CNN-2D", say)


def labels(preset: str, settings: Settings) -> dict[str, float]:
    """Return how late the label button was while gestures were taught, and how often wrong.

    Returns:
        Medians of the lags, seconds, as estimated and as they truly were; and the share of frames
        labelled wrongly, as they were said and after the repair.
    """
    taught = DataSet(settings.seed, settings.minutes, "blocks", preset).session(0, 0)
    late = asdict(people.repair(taught, "button")[1])
    kept = ("begin_s", "true_begin_s", "end_s", "true_end_s", "wrong", "wrong_after")
    return {name: round(late[name], 4) for name in kept}


def _as_taught(taught: Recording, recipe: Recipe) -> Source:
    """Return a session with the button's labels, repaired where the recipe does so."""
    if recipe.repair:
        taught = people.with_labels(taught, "button", people.repair(taught, "button")[0])
    return Source.of(taught, "button")
