"""Report of a sweep: a table and the best point as text, a CSV, and curves."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from controller.errors import count
from models.reports import markdown
from models.reports.tables import Table
from models.results import storage
from models.studies.sweep import figures
from models.studies.sweep.figures import MEASURES, Choice, Measure, Point

POINTS: Final = "points.csv"
CURVES: Final = "curves.svg"
FEW: Final = 6  # users or sessions: of fewer, resampling says too little


def table(found: Mapping[str, Any]) -> str:
    """Return the report as text: every point, the best, and what failed."""
    measure, points = MEASURES[found["train"]["task"]], figures.points(found)
    done = sum("result" in job for job in found["jobs"])
    parts = [
        f"{found['sweep']}: {done} of {count(len(found['jobs']), 'training')}; "
        f"held out: {figures.title(found['test'])}; scores: {measure.words}"
    ]
    if points:
        head, *cells = rows(points, measure)
        parts.append(markdown.table(Table(head, cells)))
    if chosen := figures.choose(points, measure):
        parts.append(best(chosen, len(points)))
    fewest = min((len(point.held) for point in points), default=FEW)
    if fewest < FEW:
        parts.append(
            f"Only {count(fewest, found['test']['by'])} held out: others may score otherwise, and "
            "the intervals are too narrow to show how much; hold out more, or give folds."
        )
    notes = (note for job in found["jobs"] for note in job.get("result", {}).get("notes", ()))
    if lines := [*dict.fromkeys(notes), *failed(found)]:
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def best(chosen: Choice, points: int) -> str:
    """Return sentences about the best point."""
    one, other = figures.title(chosen.best.at), figures.title(chosen.second.at)
    lines = [
        f"Best of {points} on what was held out: {one}, {chosen.best.figure}.",
        f"Next is {other}; the lead is {chosen.lead}.",
    ]
    if chosen.lead.low <= 0.0:
        lines.append("These data do not separate the two: take the cheaper one, or judge more.")
    lines.append(
        "The best was chosen by the scores shown here, so part of its lead is luck; judge it on "
        "recordings that no sweep has used: models evaluate."
    )
    return "\n".join(lines)


def failed(found: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each reason why trainings failed."""
    reasons: dict[str, list[str]] = {}
    for job in found["jobs"]:
        if "failed" in job:
            where = figures.title({**job["at"], "fold": job["fold"] + 1})
            reasons.setdefault(job["failed"], []).append(where)
    return [
        f"failed ({len(where)}): {why} [{'; '.join(where[:3])}{'; ...' if len(where) > 3 else ''}]"
        for why, where in reasons.items()
    ]


def rows(points: Sequence[Point], measure: Measure) -> list[list[str]]:
    """Return a table of all points: a head, and a row for each."""
    learned = [f"learned {key}" for key in figures.LEARNED]
    scores = ["score", "low", "high", "frames", "at random", "worst seed", "best seed"]
    made = [[*points[0].at, "trainings", *scores, *learned]]
    for point in points:
        figure, seeds = point.figure, sorted(point.by_seed, reverse=not measure.share)
        numbers = [figure.value, figure.low, figure.high, point.frames, point.random]
        numbers += [seeds[0], seeds[-1], *point.learned.values()]
        cells = ["" if number != number else f"{number:.4g}" for number in numbers]
        at = [figures.place(axis, value) for axis, value in point.at.items()]
        made.append([*at, str(point.trainings), *cells])
    return made


def write(found: Mapping[str, Any], folder: Path) -> list[Path]:
    """Write the points as CSV and, if an axis has amounts, curves; return the files."""
    points, measure = figures.points(found), MEASURES[found["train"]["task"]]
    if not points:
        return []
    whole = io.StringIO(newline="")
    csv.writer(whole, lineterminator="\n").writerows(rows(points, measure))
    storage.write_text(folder / POINTS, whole.getvalue())
    axes = [axis for axis, values in found["axes"].items() if numeric(axis, values)]
    if not axes:
        return [folder / POINTS]
    from models.studies.sweep import curves  # imports matplotlib

    return [folder / POINTS, curves.save(points, axes, measure, folder / CURVES)]


def numeric(axis: str, values: Sequence[Any]) -> bool:
    """Whether an axis has several amounts, and is drawn as a curve."""
    return axis != "seed" and len(values) > 1 and all(type(one) in (int, float) for one in values)
