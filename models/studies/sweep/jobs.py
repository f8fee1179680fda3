"""The trainings of a sweep: plain descriptions that any machine understands, with stable names.

A job says everything that its result hangs on, its seed among it, and nothing else: not where it
runs, not when, not what runs beside it.
"""

import hashlib
import itertools
import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

from models.studies.sweep.plan import Plan
from models.studies.sweep.settings import SIMULATED

Job = dict[str, Any]  # "data", "train", "test", "at"; JSON

LETTERS: Final = 24  # of a name: 96 bits


def jobs(plan: Plan, digest: str = "") -> list[Job]:
    """Return all trainings of a plan, in the order of its axes, the folds of each together.

    Args:
        plan: What was asked for.
        digest: hash of the recordings and their vocabulary; "" where people are simulated.
    """
    made: list[Job] = []
    names = [name for name, _ in plan.axes]
    for values in itertools.product(*(values for _, values in plan.axes)):
        at = dict(zip(names, values, strict=True))
        own = {name.removeprefix("data."): one for name, one in at.items() if _of_data(name)}
        data = {**plan.data, **own}
        if digest:
            data["sha256"] = digest
        train = {**plan.train, **{name: one for name, one in at.items() if not _of_data(name)}}
        made += [
            {"at": at, "data": data, "train": train, "test": {**plan.test, "fold": fold}}
            for fold in range(plan.test.get("folds", 1))
        ]
    return made


def name(job: Job, version: Mapping[str, str]) -> str:
    """Return a job's name: a hash of what it says and of the program, not of any folder's place."""
    said = {key: part for key, part in job.items() if key != "at"}
    said["data"] = {key: one for key, one in job["data"].items() if key != "folders"}
    text = json.dumps([said, dict(version)], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:LETTERS]


def words(job: Job) -> str:
    """Return which job it is, for people: "users 3, seed 1, fold 2"."""
    at = [f"{key} {_short(value)}" for key, value in job["at"].items()]
    if "folds" in job["test"]:
        at.append(f"fold {job['test']['fold'] + 1}")
    return ", ".join(at) or "the one training"


def _short(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _of_data(axis: str) -> bool:
    return axis.startswith("data.") and axis.removeprefix("data.") in SIMULATED


def points(listed: Sequence[Job]) -> list[dict[str, Any]]:
    """Return where trainings differ by more than seed and fold, in order."""
    seen: list[dict[str, Any]] = []
    for job in listed:
        at = point(job)
        if at not in seen:
            seen.append(at)
    return seen


def point(job: Job) -> dict[str, Any]:
    """Return where a job is, seed and fold aside: those only repeat it."""
    return {key: value for key, value in job["at"].items() if key != "seed"}
