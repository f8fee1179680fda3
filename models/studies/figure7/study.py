"""Measurement of figure 7: the curves of both recipes over the epochs and over the examples.

One user teaches as in section 4.2 of the paper. The networks are judged on windows drawn at random
from the same session, which is the most that the paper can have done, and on other days and other
people. The experiments are in models/studies/figure7/experiments.py.
"""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from controller.shared.aliases import Say
from controller.simulator.orb import PRESETS
from models.data.recipe import RECIPES
from models.results import storage
from models.results.training import Epoch
from models.studies.figure7 import experiments
from models.studies.figure7.experiments import Experiment, Row, Settings
from models.training.loop import fit

SHARES: Final = (1 / 16, 1 / 8, 1 / 4, 1 / 2)  # of the examples
POINTS: Final = 30  # of a curve over the epochs, at most
NETWORKS: Final[dict[str, Callable[[str, str, Settings], Experiment]]] = {
    "CNN-3D": experiments.gestures,
    "users": experiments.users,
    "CNN-2D": experiments.places,
}


def measure(settings: Settings, path: Path, say: Say) -> dict[str, Any]:
    """Return all results, measuring what the file, written after each part, does not hold.

    They are "settings"; "labels": `experiments.label_lateness` of each preset; and "parts":
    `curves` of each preset, recipe and network, under "PRESET RECIPE NETWORK".
    """
    found: dict[str, Any] = {"settings": asdict(settings), "parts": {}}
    kept = storage.read_tables(path, "settings", "parts")
    if kept is not None and kept["settings"] == found["settings"]:
        found = kept
    found["labels"] = {preset: experiments.label_lateness(preset, settings) for preset in PRESETS}
    storage.write_json(path, found)
    # The order of the tables: by preset and network, the paper's recipe first.
    for key in [f"{p} {r} {n}" for p in PRESETS for n in NETWORKS for r in reversed(RECIPES)]:
        preset, name, network = key.split()
        part = found["parts"].pop(key, None)
        if not isinstance(part, dict):
            experiment = NETWORKS[network](preset, name, settings)
            title = f"{preset}, recipe {name}: {network}"
            part = curves(experiment, settings.seed, title, say)
        found["parts"][key] = part
        storage.write_json(path, found)
    return found


def curves(experiment: Experiment, seed: int, title: str, say: Say) -> dict[str, Any]:
    """Return a network's scores over the epochs, and over the number of examples.

    They are plain data: `epochs` and `sizes`, each a dictionary of columns: "epoch", "examples",
    "train", "random" and those of the experiment; and "kept", the number of the kept epoch.
    """
    *epochs, last = _curve(experiment, 1.0, seed)
    say(f"{title}: {_words(last)}")
    ends = []
    for share in SHARES:
        ends.append(_curve(experiment, share, seed)[-1])
        say(f"{title}, {ends[-1]['examples']:.0f} examples: {_words(ends[-1])}")
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

    fitted = fit(task, seed, None, watch)
    return [*rows, row(fitted.epochs[fitted.best - 1], last=True)]


def _columns(rows: list[Row]) -> dict[str, list[float]]:
    return {key: [round(row[key], 5) for row in rows] for key in rows[0]}


def _words(row: Row) -> str:
    return ", ".join(f"{key} {value:.4g}" for key, value in row.items() if key != "examples")
