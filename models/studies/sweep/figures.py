"""Scores of a sweep's points with their intervals, and the choice of the best one.

Seeds and folds repeat a training: a point is all of them together. Intervals are 95 %, by
resampling whole users (or sessions) that were held out; each counts once, however many seeds judged
it.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from models.evaluation import bootstrap
from models.results.figure import Figure

AMOUNTS: Final = ("users", "sessions", "minutes")  # axes along which more is better
LEARNED: Final = (*AMOUNTS, "windows")

Counts = NDArray[np.float64]  # sum and count of each held-out user or session, (groups, 2)


@dataclass(frozen=True, slots=True)
class Measure:
    """Score of a task."""

    key: str  # name in a result's "held"
    words: str  # what it is, in reports
    share: bool = True  # it is a share, and more is better; else an error, and less is

    def figure(self, counts: Counts) -> Figure:
        """Return the score of counts, (groups, 2), and its interval."""
        return (bootstrap.share if self.share else bootstrap.rate)(counts[:, 0], counts[:, 1])


MEASURES: Final = {
    "gesture": Measure("events", "unseen events named rightly"),
    "user": Measure("events", "unseen gestures given to the right person"),
    "location": Measure("error", "mean error of unseen touches, grid units", share=False),
}


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """One point of a sweep."""

    at: dict[str, Any]  # values on the axes, without the seed
    trainings: int  # number of trainings
    figure: Figure  # score on what was held out
    frames: float  # share of frames named rightly; NaN if frames are not named
    random: float  # score on windows at random, mean of the trainings; NaN: unknown
    by_seed: tuple[float, ...]  # score of each seed
    learned: dict[str, float]  # users, sessions, minutes and windows learned from, means
    held: tuple[str, ...]  # names of the held-out users or sessions
    counts: Counts  # sums and counts of the score

    def amount(self, axis: str) -> float:
        """Return the place on a numeric axis; for 0, "all", what was learned from."""
        users, sessions = max(1.0, self.learned["users"]), max(1.0, self.learned["sessions"])
        whole = (users, sessions / users, self.learned["minutes"] / sessions)
        every = dict(zip(AMOUNTS, whole, strict=True)).get(axis, 0.0)
        return float(self.at[axis] or every)


def points(found: Mapping[str, Any]) -> list[Point]:
    """Return all points that have a result, in order.

    Args:
        found: Content of results.json.
    """
    groups: dict[str, list[dict[str, Any]]] = {}
    for job in found["jobs"]:
        if "result" in job:
            at = {axis: value for axis, value in job["at"].items() if axis != "seed"}
            groups.setdefault(json.dumps(at), []).append(job)
    group, measure = found["test"]["by"], MEASURES[found["train"]["task"]]
    return [_point(json.loads(at), jobs, group, measure) for at, jobs in groups.items()]


def _point(at: dict[str, Any], jobs: list[dict[str, Any]], group: str, measure: Measure) -> Point:
    results = [job["result"] for job in jobs]
    held, counts = _counted(results, group, measure.key)
    seeds: dict[int, list[dict[str, Any]]] = {}
    for job in jobs:
        seeds.setdefault(job["at"].get("seed", 0), []).append(job["result"])
    framed = "frames" in results[0]["held"][0]
    right, frames = _counted(results, group, "frames")[1].sum(axis=0) if framed else (np.nan, 1.0)
    random = [one["random"] for one in results if one["random"] is not None]
    return Point(
        at,
        len(jobs),
        measure.figure(counts),
        float(right / frames),
        float(np.mean(random)) if random else float("nan"),
        tuple(measure.figure(_counted(own, group, measure.key)[1]).value for own in seeds.values()),
        {key: float(np.mean([one["learned"][key] for one in results])) for key in LEARNED},
        held,
        counts,
    )


def _counted(
    results: Iterable[Mapping[str, Any]], group: str, key: str
) -> tuple[tuple[str, ...], Counts]:
    """Return the held-out groups, and their counts, (groups, 2): means of all trainings."""
    rows: dict[str, list[Counts]] = {}
    for result in results:
        names = np.array([session[group] for session in result["held"]])
        counts = np.array([session[key] for session in result["held"]], dtype=np.float64)
        for name in np.unique(names):
            rows.setdefault(str(name), []).append(counts[names == name].sum(axis=0))
    held = tuple(sorted(rows))
    return held, np.array([np.mean(rows[name], axis=0) for name in held])


@dataclass(frozen=True, slots=True)
class Choice:
    """The best of several points."""

    best: Point  # the point
    second: Point  # the next one
    lead: Figure  # how much better the best one is, with its interval over the same users


def choose(points: Sequence[Point], measure: Measure) -> Choice | None:
    """Return the best of several points; None if they cannot be compared.

    More to learn from is better in any case, and other data sets have other users, so nothing is
    chosen along such axes.
    """
    axes = {axis for point in points for axis in point.at} - set(AMOUNTS)
    if len(points) < 2 or not axes or any(axis.startswith("data.") for axis in axes):
        return None
    if any(point.held != points[0].held for point in points):  # trainings failed
        return None
    ranked = sorted(points, key=lambda point: point.figure.value, reverse=measure.share)
    best, second = ranked[:2]
    own, other = best.counts, second.counts
    scaled = other[:, 0] * own[:, 1] / np.maximum(other[:, 1], 1e-9)  # as if of as many items
    lead = own[:, 0] - scaled if measure.share else scaled - own[:, 0]
    return Choice(best, second, bootstrap.rate(lead, own[:, 1]))


def score(result: Mapping[str, Any]) -> float:
    """Return the score of one training, after checking that its result can be shown.

    Raises:
        KeyError, TypeError, ValueError, AttributeError: It lacks something.
    """
    measure = MEASURES["gesture" if "events" in result["held"][0] else "location"]
    point = _point({}, [{"at": {}, "result": result}], "user", measure)
    if not all(isinstance(note, str) for note in result["notes"]):
        raise TypeError("a note is no text")
    return point.figure.value


def title(at: Mapping[str, Any]) -> str:
    """Return a place on the axes, such as "users 3, seed 1"."""
    return ", ".join(f"{axis} {place(axis, value)}" for axis, value in at.items()) or "no axes"


def place(axis: str, value: Any) -> str:
    """Return a value on an axis, in words."""
    if axis in AMOUNTS and not value:
        return "all"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return "/".join(place("", one) for one in value)
    return f"{value:g}" if isinstance(value, float) else str(value)
