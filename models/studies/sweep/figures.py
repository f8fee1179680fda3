"""Aggregation of many trainings: a figure with its interval for each point of a sweep.

Seeds and folds only repeat a training: a point is all of them. Its interval is 95 %, by
resampling whole people (or sessions) that were held out; every one counts once, however many
seeds judged it.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from models.evaluation import bootstrap
from models.results.figure import Figure

Counts = dict[str, tuple[float, float]]  # unit -> what was counted, of how much

LEARNED: Final = ("users", "sessions", "minutes", "windows")


@dataclass(frozen=True, slots=True)
class Measure:
    """What a task is judged by.

    Attributes:
        key: Of the counts in a result.
        words: What it is.
        share: It is a share, and more is better; else an error, and less is.
    """

    key: str
    words: str
    share: bool

    def figure(self, counts: Counts) -> Figure:
        """Return the figure of what was counted."""
        top, bottom = columns(counts)
        return (bootstrap.share if self.share else bootstrap.rate)(top, bottom)

    def sign(self) -> float:
        """Return +1 where more is better, else -1."""
        return 1.0 if self.share else -1.0


MEASURES: Final = {
    "gesture": Measure("events", "unseen events named rightly", share=True),
    "user": Measure("events", "unseen gestures given to the right person", share=True),
    "location": Measure("error", "mean error of unseen touches, grid units", share=False),
}
FRAMES: Final = Measure("frames", "unseen frames named rightly", share=True)


@dataclass(frozen=True, slots=True)
class Point:
    """One point of a sweep, or several together.

    Attributes:
        at: Its place on the axes, seed aside.
        trainings: How many were judged.
        figure: What they are worth on what was held out.
        frames: The same for frames; None: frames are not named.
        random: What windows at random promise: the mean of the trainings; NaN: unknown.
        by_seed: The figure of each seed.
        learned: From how many users, sessions, minutes and windows: means.
        counts: What was counted on each person or session held out.
    """

    at: dict[str, Any]
    trainings: int
    figure: Figure
    frames: Figure | None
    random: float
    by_seed: tuple[float, ...]
    learned: dict[str, float]
    counts: Counts

    def title(self) -> str:
        """Return where it is, in words."""
        return (
            ", ".join(f"{key} {place(key, value)}" for key, value in self.at.items())
            or "as they are"
        )


def points(found: Mapping[str, Any]) -> list[Point]:
    """Return all points that have a result, in order.

    Args:
        found: What `study.run` returns.
    """
    axes = [name for name in found["axes"] if name != "seed"]
    return _grouped(found, axes)


def along(found: Mapping[str, Any], axis: str) -> list[Point]:
    """Return a point for each value of an axis: all others together."""
    return _grouped(found, [axis])


def _grouped(found: Mapping[str, Any], axes: Sequence[str]) -> list[Point]:
    groups: dict[str, list[dict[str, Any]]] = {}
    for job in found["jobs"]:
        if "result" in job:
            key = json.dumps([job["at"][axis] for axis in axes])
            groups.setdefault(key, []).append(job)
    unit, measure = found["test"]["by"], MEASURES[found["train"]["task"]]
    return [
        _point({axis: some[0]["at"][axis] for axis in axes}, some, unit, measure)
        for some in groups.values()
    ]


def _point(at: dict[str, Any], some: list[dict[str, Any]], unit: str, measure: Measure) -> Point:
    results = [job["result"] for job in some]
    counts = counted(results, unit, measure.key)
    framed = "frames" in results[0]["held"][0]
    seeds: dict[int, list[dict[str, Any]]] = {}
    for job in some:
        seeds.setdefault(job["at"].get("seed", 0), []).append(job["result"])
    random = [one["random"] for one in results if one["random"] is not None]
    return Point(
        at,
        len(some),
        measure.figure(counts),
        FRAMES.figure(counted(results, unit, FRAMES.key)) if framed else None,
        float(np.mean(random)) if random else float("nan"),
        tuple(measure.figure(counted(own, unit, measure.key)).value for own in seeds.values()),
        {key: float(np.mean([one["learned"][key] for one in results])) for key in LEARNED},
        counts,
    )


def counted(results: Iterable[Mapping[str, Any]], unit: str, key: str) -> Counts:
    """Return what was counted on each unit, the mean of all that judged it."""
    rows: dict[str, list[NDArray[np.float64]]] = {}
    for result in results:
        own: dict[str, NDArray[np.float64]] = {}
        for session in result["held"]:
            row = np.array(session[key], dtype=np.float64)
            own[session[unit]] = own.get(session[unit], np.zeros(2)) + row
        for name, row in own.items():
            rows.setdefault(name, []).append(row)
    means = {name: np.mean(rows[name], axis=0) for name in sorted(rows)}
    return {name: (float(row[0]), float(row[1])) for name, row in means.items()}


def columns(counts: Counts) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return counts as two arrays, (units,)."""
    rows = np.array(list(counts.values()), dtype=np.float64).reshape(-1, 2)
    return rows[:, 0], rows[:, 1]


def amount(point: Point, axis: str) -> float:
    """Return how far along an axis a point is; what was learned, where the axis says "all"."""
    people, sessions = max(1.0, point.learned["users"]), max(1.0, point.learned["sessions"])
    all_of = {
        "users": people,
        "sessions": sessions / people,
        "minutes": point.learned["minutes"] / sessions,
    }
    value = point.at[axis]
    return all_of[axis] if axis in all_of and not value else float(value)


def numeric(axis: str, values: Sequence[Any]) -> bool:
    """Whether an axis is one of amounts, and so may be drawn as a curve."""
    return axis != "seed" and len(values) > 1 and all(type(one) in (int, float) for one in values)


def place(axis: str, value: Any) -> str:
    """Return a value of an axis for people."""
    return "all" if axis in LEARNED and not value else short(value)


def short(value: Any) -> str:
    """Return a setting's value for people."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return "/".join(map(short, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
