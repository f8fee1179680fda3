"""Report of a sweep: scores of its points with their intervals, as a table.

Seeds and folds repeat a training: a point is all of them together. Intervals are 95 %, by
resampling whole users (or sessions) that were held out; each counts once, however many seeds judged
it. Differences to the first point are of the same users, so their intervals are narrower.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.shared.errors import count
from models.evaluation import bootstrap
from models.formatting import number_interval
from models.reports.tables import Table
from models.results.evaluation import Figure
from models.studies.sweep.plan import AMOUNTS

FEW: Final = 6  # users or sessions: of fewer, resampling says too little
LEARNED: Final = (*AMOUNTS, "windows")
WINDOWS: Final = "frames"  # in a result's "held": windows named rightly

Results = Sequence[Mapping[str, Any]]  # of trainings
Sums = dict[str, NDArray[np.float64]]  # by held-out group: sum and count of scores, (2,)


class Measure(NamedTuple):
    """Score of a task."""

    key: str  # name in a result's "held"
    words: str  # what it is
    share: bool = True  # it is a share, and more is better; else an error


MEASURES: Final = {
    "gesture": Measure("events", "unseen events named rightly"),
    "location": Measure("error", "mean error of unseen touches, grid units", share=False),
}


@dataclass(frozen=True, slots=True)
class Point:
    """One point of a sweep."""

    at: dict[str, Any]  # values on the axes, without the seed
    trainings: int  # number of trainings
    figure: Figure  # score on what was held out
    gain: Figure  # score less that of the first point, on what both judge
    windows: Figure  # share of held-out windows named rightly; NaN: unknown
    windows_gain: Figure  # that share less the first point's
    random: float  # score on windows at random, mean of the trainings; NaN: unknown
    learned: dict[str, float]  # users, sessions, minutes and windows learned from, means
    held: int  # number of held-out users or sessions


def points(found: Mapping[str, Any]) -> list[Point]:
    """Return all points that have a result, in order, from the content of results.json.

    Models are judged on the groups that all of them judge, should a training of one have failed.
    """
    groups: dict[str, list[dict[str, Any]]] = {}
    for job in found["jobs"]:
        if "result" in job:
            at = {axis: value for axis, value in job["at"].items() if axis != "seed"}
            groups.setdefault(json.dumps(at), []).append(job["result"])
    by, measure = found["test"]["by"], _measure(found)
    if "model" in found["axes"] and groups:
        same = set.intersection(*(_held(some, by) for some in groups.values()))
        groups = {at: _of(some, by, same) for at, some in groups.items() if same}
    first = next(iter(groups.values()), [])
    return [_point(json.loads(at), results, by, measure, first) for at, results in groups.items()]


def _held(results: Results, by: str) -> set[str]:
    """Return the names of the held-out users or sessions."""
    return {one[by] for result in results for one in result["held"]}


def _of(results: list[dict[str, Any]], by: str, names: set[str]) -> list[dict[str, Any]]:
    """Return results with some of their held-out groups only."""
    kept = [[one for one in result["held"] if one[by] in names] for result in results]
    return [{**one, "held": held} for one, held in zip(results, kept, strict=True) if held]


def _measure(found: Mapping[str, Any]) -> Measure:
    return MEASURES[found["train"].get("task", "gesture")]


def _sums(results: Results, by: str, key: str) -> Sums:
    """Return the sum and count of scores of each held-out group, means of the trainings."""
    rows: dict[str, list[Any]] = {}
    for result in results:
        sums: dict[str, Any] = {}
        for session in result["held"]:
            counts = np.array(session.get(key, (0, 0)), dtype=np.float64)
            sums[session[by]] = sums.get(session[by], 0.0) + counts
        for name, counts in sums.items():
            rows.setdefault(name, []).append(counts)
    return {name: np.mean(rows[name], axis=0) for name in sorted(rows)}


def _point(
    at: dict[str, Any], results: Results, by: str, measure: Measure, first: Results
) -> Point:
    random = [one["random"] for one in results if one["random"] is not None]
    return Point(
        at,
        len(results),
        *_figures(results, first, by, measure.key, measure.share),
        *_figures(results, first, by, WINDOWS),
        float(np.mean(random)) if random else float("nan"),
        {key: float(np.mean([one["learned"][key] for one in results])) for key in LEARNED},
        len(_held(results, by)),
    )


def _figures(
    results: Results, first: Results, by: str, key: str, share: bool = True
) -> tuple[Figure, Figure]:
    """Return a score, and its difference to the first point's on the groups of both."""
    sums, base = (_sums(some, by, key) for some in (results, first))
    score, amount = np.array([*sums.values()]).T
    if not amount.any():
        return (Figure(np.nan, np.nan, np.nan),) * 2
    both = np.array([[*sums[name], *base[name]] for name in sums if name in base]).reshape(-1, 4)
    figure = (bootstrap.share if share else bootstrap.rate)(score, amount)
    return figure, bootstrap.rate(both[:, 0] - both[:, 2], both[:, 3])


def score(result: Mapping[str, Any]) -> float:
    """Return the score of one training; raise an error if its result cannot be shown."""
    measure = MEASURES["gesture" if "events" in result["held"][0] else "location"]
    if not all(isinstance(note, str) for note in result["notes"]):
        raise TypeError("a note is no text")
    return _point({}, [result], "user", measure, [result]).figure.value


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


def table(found: Mapping[str, Any]) -> str:
    """Return the report as text: every point, remarks, and what failed."""
    made = points(found)
    done = sum("result" in job for job in found["jobs"])
    held = {key: value for key, value in found["test"].items() if value}
    parts = [
        f"{found['sweep']}: {done} of {count(len(found['jobs']), 'training')}; held out: "
        f"{title(held)}; scores: {_measure(found).words}"
    ]
    if made:
        parts.append(rows(made).markdown())
    fewest = min((point.held for point in made), default=FEW)
    if fewest < FEW:
        parts.append(
            f"Only {count(fewest, found['test']['by'])} held out: others may score otherwise, and "
            "the intervals are too narrow to show how much; hold out more, or give folds."
        )
    notes = (note for job in found["jobs"] for note in job.get("result", {}).get("notes", ()))
    if lines := [*dict.fromkeys(notes), *_failed(found)]:
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def _failed(found: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each reason why trainings failed."""
    reasons: dict[str, list[str]] = {}
    for job in found["jobs"]:
        if "failed" in job:
            where = title({**job["at"], "fold": job["fold"] + 1})
            reasons.setdefault(job["failed"], []).append(where)
    return [f"failed ({len(where)}): {why} [{where[0]}]" for why, where in reasons.items()]


def rows(points: Sequence[Point]) -> Table:
    """Return a table of all points, a row for each."""
    learned = [f"learned {key}" for key in LEARNED]
    head = [*points[0].at, "trainings", "score", "low", "high", "beside the first", "windows"]
    head += ["windows beside the first", "at random", *learned]
    made: list[list[str]] = []
    for point in points:
        figure, gain = point.figure, point.gain
        scored = [figure.value, figure.low, figure.high]
        beside = _difference(gain) if made else ""
        windows = [number_interval(point.windows), _difference(point.windows_gain) if made else ""]
        others = map(_number, [point.random, *point.learned.values()])
        cells = [*map(_number, scored), beside, *windows, *others]
        at = [place(axis, value) for axis, value in point.at.items()]
        made.append([*at, str(point.trainings), *cells])
    return Table(head, made)


def _difference(gain: Figure) -> str:
    words = f"{gain.value:+.4g} ({gain.low:+.3g} … {gain.high:+.3g})"
    return words if gain.value == gain.value else ""


def _number(value: float) -> str:
    return "" if value != value else f"{value:.4g}"
