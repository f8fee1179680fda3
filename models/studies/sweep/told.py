"""Results of a sweep in words and tables of plain text."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from controller.console import count
from models.results.figure import Figure
from models.studies.sweep import figures
from models.studies.sweep.choice import FEWEST, Choice, choose
from models.studies.sweep.figures import MEASURES, Measure, Point
from models.studies.sweep.settings import ENROLLED

FEW: Final = 6  # people or sessions: of fewer, resampling says too little


def table(found: Mapping[str, Any]) -> str:
    """Return everything as text: each point, each axis, the best, and what failed."""
    measure = MEASURES[found["train"]["task"]]
    points = figures.points(found)
    parts = [headline(found)]
    if points:
        axes = [axis for axis in found["axes"] if axis != "seed"]
        head = [*axes, "trainings", measure.words, *(["frames"] if points[0].frames else [])]
        head += ["at random", "seeds"]
        parts.append(_lines(head, [_row(point, measure) for point in points]))
        for axis in axes if len(axes) > 1 else ():
            rows = [[*_at(p), str(p.trainings), sure(p.figure, measure)]
                    for p in figures.along(found, axis)]  # fmt: skip
            parts.append(_lines([axis, "trainings", f"{measure.words}, all else together"], rows))
    if chosen := choose(points, measure):
        parts.append("\n".join(best(chosen, measure, len(points))))
    if doubt := few(found, points):
        parts.append(doubt)
    if lines := [*notes(found), *failed(found)]:
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def headline(found: Mapping[str, Any]) -> str:
    """Return what was done, in a sentence."""
    done = sum("result" in job for job in found["jobs"])
    return f"{found['sweep']}: {done} of {count(len(found['jobs']), 'training')}; {held(found)}"


def held(found: Mapping[str, Any]) -> str:
    """Return what was held out, in words."""
    test = found["test"]
    if found["train"]["task"] == ENROLLED:
        if "folds" in test:
            return f"every session of each held out once, in {test['folds']} folds"
        last = "last session" if test["hold"] == 1 else f"last {test['hold']} sessions"
        return f"the {last} of each held out"
    if "folds" in test:
        return f"every {test['by']} held out once, in {test['folds']} folds"
    return f"{test['hold']} {test['by']}{'s' if test['hold'] > 1 else ''} held out, always the same"


def few(found: Mapping[str, Any], points: Sequence[Point]) -> str:
    """Return a warning where too few were held out; "": there were enough."""
    judged = min((len(point.counts) for point in points), default=FEW)
    if judged >= FEW:
        return ""
    by = f"{found['test']['by']}{'s' if judged > 1 else ''}"
    return (
        f"Only {judged} {by} held out: the next ones may be quite different, and the intervals "
        "are too narrow to say how much; hold out more, or say folds."
    )


def best(chosen: Choice, measure: Measure, count: int) -> list[str]:
    """Return which point is the best, and how much that means."""
    at, second, better = chosen.best, chosen.second, chosen.better
    lines = [
        f"Best of {count} on what was held out: {at.title()}, {sure(at.figure, measure)}.",
        f"Next is {second.title()}, by {gap(better.value, measure)}"
        + (f" ({gap(better.low, measure)} to {gap(better.high, measure)})."
           if better.low == better.low else "."),
    ]  # fmt: skip
    if better.low == better.low and better.low <= 0.0:
        lines.append("These data do not tell the two apart: take the cheaper one, or judge more.")
    if chosen.units < FEWEST:
        lines.append(
            f"It was chosen by the scores that it is shown with, so some of them is luck; "
            f"{chosen.units} held out are too few to say how much."
        )
    else:
        lines.append(
            f"It was chosen by the scores that it is shown with, so some of them is luck: chosen "
            f"on {chosen.units} drawn at random from those held out, and judged on the others, "
            f"the best of {count} loses {gap(chosen.luck, measure)} on average, and in "
            f"{100 * chosen.kept:.0f} % of the draws it is this one."
        )
    lines.append("Recordings that no sweep has seen have the last word: models evaluate.")
    return lines


def failed(found: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each reason why trainings failed."""
    reasons: dict[str, list[str]] = {}
    for job in found["jobs"]:
        if "failed" in job:
            reasons.setdefault(job["failed"], []).append(_where(job))
    return [
        f"failed ({len(where)}): {why} [{'; '.join(where[:3])}{'; ...' if len(where) > 3 else ''}]"
        for why, where in reasons.items()
    ]


def notes(found: Mapping[str, Any]) -> list[str]:
    """Return which recordings are left out, a sentence each."""
    every = (note for job in found["jobs"] for note in job.get("result", {}).get("notes", ()))
    return list(dict.fromkeys(every))


def sure(figure: Figure, measure: Measure) -> str:
    """Return a figure and its interval."""
    if not measure.share:
        return _between(figure, 1.0, 3, "")
    return _between(figure, 100.0, 2, " %")


def gap(value: float, measure: Measure) -> str:
    """Return a difference."""
    return f"{100 * value:.2f} points" if measure.share else f"{value:.4f} grid units"


def score(value: float, measure: Measure) -> str:
    """Return a score without its interval."""
    if value != value:
        return "–"
    return f"{100 * value:.1f} %" if measure.share else f"{value:.3f}"


def _between(figure: Figure, times: float, digits: int, unit: str) -> str:
    value = f"{times * figure.value:.{digits}f}{unit}"
    if figure.low != figure.low:
        return value
    return f"{value} ({times * figure.low:.{digits}f}–{times * figure.high:.{digits}f})"


def spread(point: Point, measure: Measure) -> str:
    """Return the worst and the best seed of several."""
    if len(point.by_seed) < 2:
        return "–"
    low, high = (score(one, measure) for one in (min(point.by_seed), max(point.by_seed)))
    return f"{low.removesuffix(' %')}–{high}"


def _row(point: Point, measure: Measure) -> list[str]:
    row = [*_at(point), str(point.trainings), sure(point.figure, measure)]
    if point.frames:
        row.append(score(point.frames.value, figures.FRAMES))
    return [*row, score(point.random, measure), spread(point, measure)]


def _at(point: Point) -> list[str]:
    return [figures.place(axis, value) for axis, value in point.at.items()]


def _where(job: Mapping[str, Any]) -> str:
    at = [f"{key} {figures.place(key, value)}" for key, value in job["at"].items()]
    return ", ".join([*at, f"fold {job['fold'] + 1}"])


def _lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table whose columns stand under one another."""
    every = [head, *rows]
    widths = [max(len(row[i]) for row in every) for i in range(len(head))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in every
    )
