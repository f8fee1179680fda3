"""Measurement of the paper's figures and section 6: each part once, kept in a file."""

import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

from controller.bundles import bundle
from controller.recordings import reader
from controller.shared.aliases import Say
from controller.simulator.session import TEST_SEEDS
from models import formatting, processes
from models.data.simulate import DataSet
from models.results import storage
from models.studies.paper import figure7, section6
from models.studies.paper.figure7 import Settings
from models.studies.paper.tables import RECIPES

MEASURED: Final = "paper.json"
SEED: Final = TEST_SEEDS.start + 20  # no training accepts it
DAYS: Final = 4  # of one person
MINUTES: Final = 6.0  # of each

Results = dict[str, Any]
Paths = tuple[Path, ...]  # of recordings; none: people are simulated

_DIGITS: Final = 8  # of the bundle's hash, by which its results are known
_EMPTY: Final = ("settings", "parts")


def measure(
    sets: Mapping[str, Paths],
    only: Sequence[str],
    path: Path,
    settings: Settings,
    kept: Path,
    say: Say,
) -> Results:
    """Return all results, measuring what the file `kept`, written after each part, does not hold.

    "parts": under "SET|PART" the values of a part, in nats; "settings" of each part.
    `sets` are recordings by their title; those of a preset without any are simulated. `only` has
    first words of parts' names; if it is empty, all are measured. `path` is that of the bundle.
    """
    found = storage.read_tables(kept, *_EMPTY) or {name: {} for name in _EMPTY}
    jobs = {}
    for title, paths in sets.items():
        for name, (how, job) in parts(title, paths, path, settings).items():
            key = f"{title}|{name}"
            if found["settings"].get(key) != how:  # measured otherwise
                found["parts"].pop(key, None)
            found["settings"][key] = how
            if key not in found["parts"] and (not only or name.split()[0] in only):
                jobs[key] = job
    done = processes.completed(jobs, os.cpu_count() or 1)
    for number, (key, result, left_s) in enumerate(done, 1):
        left = formatting.duration(left_s)
        say(f"{number}/{len(jobs)} {key.replace('|', ': ')}; {left} left")
        found["parts"][key] = result
        storage.write_json(kept, found)
    done_parts = found["parts"]
    found["parts"] = {key: done_parts[key] for key in found["settings"] if key in done_parts}
    return found


def parts(
    title: str, paths: Paths, path: Path, settings: Settings
) -> dict[str, tuple[str, Callable[[], Any]]]:
    """Return settings and measurement of a set's parts, by name; each returns plain data."""
    of = f"{paths}"
    found: dict[str, tuple[str, Callable[[], Any]]] = {
        "section6": (of, partial(_section6, title, paths)),
        "bound": (f"{of} {bundle.read(path).hash[:_DIGITS]}", partial(_bound, title, paths, path)),
    }
    if not paths:
        of = f"{settings}"
        for recipe in RECIPES:
            for network in figure7.NETWORKS:
                job = partial(figure7.curves, title, recipe, network, settings)
                found[f"figure7 {recipe} {network}"] = of, job
    return found


def _section6(title: str, paths: Paths) -> dict[str, float]:
    recorded = [reader.load(one) for one in paths]
    sessions = [section6.recorded(recorded)] if recorded else section6.simulated(title)
    return section6.measure(sessions)


def _bound(title: str, paths: Paths, path: Path) -> dict[str, Any]:
    """Measure the bound; simulated people make the bundle's gestures."""
    loaded = bundle.read(path)
    recordings = [reader.load(one) for one in paths]
    if not recordings:
        people = DataSet.of(loaded, title, SEED, MINUTES)
        recordings = [recording for _, recording in people.sessions(1, DAYS)]
    return section6.bounds(section6.answers(loaded, recordings))
