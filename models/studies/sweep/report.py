"""The report of a sweep: one page that needs nothing else, curves first."""

import json
import math
from collections.abc import Mapping, Sequence
from html import escape
from importlib import resources
from typing import Any, Final

from models import text as words
from models.reports.svg import Plot, fitted
from models.studies.sweep import figures, told
from models.studies.sweep.choice import choose
from models.studies.sweep.figures import MEASURES, Measure, Point

LINES: Final = 6  # of one drawing; of more, all are drawn as one
FAR: Final = 8.0  # of the largest amount over the smallest, from which on factors are equally long

# Of the lines of a drawing: on light paper, on dark.
_COLOURS: Final = (
    ("#1f6fd0", "#6fb0ff"), ("#1b7f4b", "#62cf95"), ("#8a3fb0", "#cf95ee"),
    ("#96640a", "#e4b04e"), ("#b8336a", "#ff8fb8"), ("#0f7f8c", "#5fd3df"),
)  # fmt: skip


def html(found: Mapping[str, Any], times: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the page.

    Args:
        found: What `study.run` returns.
        times: For each job done, "where", "seconds" and "cpu_s".
    """
    style = resources.files("models.reports").joinpath("style.css").read_text(encoding="utf-8")
    measure, points = MEASURES[found["train"]["task"]], figures.points(found)
    title = escape(f"Sweep {found['sweep']}")
    parts = [
        _failed(found),
        words.warning(escape(doubt)) if (doubt := told.few(found, points)) else "",
        *(_curve(found, axis, measure) for axis, values in found["axes"].items()
          if points and figures.numeric(axis, values)),
        _choice(points, measure),
        _axes(found, measure),
        _every(points, measure),
        _confusion(found),
        _made(found, times),
    ]  # fmt: skip
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{style}{_style()}</style></head>\n<body><h1>{title}</h1>"
        f"{_lead(found, points, measure, times)}\n{chr(10).join(filter(None, parts))}\n"
        f"<footer>Written by models sweep, OrbTouch {escape(found['version']['orbtouch'])}. "
        "This file needs nothing else.</footer></body></html>\n"
    )


def _style() -> str:
    """Return the colours of many lines, on light paper and on dark."""
    light, dark = (
        "".join(
            f"svg .line.l{i}, svg .range.l{i} {{ stroke: {pair[which]}; }} "
            f"svg .mark.l{i}, svg .name.l{i} {{ fill: {pair[which]}; }} "
            for i, pair in enumerate(_COLOURS)
        )
        for which in (0, 1)
    )
    return f"{light}@media screen and (prefers-color-scheme: dark) {{ {dark}}}"


def _lead(
    found: Mapping[str, Any],
    points: Sequence[Point],
    measure: Measure,
    times: Mapping[str, Mapping[str, Any]],
) -> str:
    done = sum("result" in job for job in found["jobs"])
    spent = sum(one["cpu_s"] for one in times.values())
    cards = [
        words.card(
            f"{done} of {len(found['jobs'])}", "trainings", f"{words.duration(spent)} of one core"
        )
    ]
    if points:
        best = max(points, key=lambda one: measure.sign() * one.figure.value)
        cards.append(
            words.card(told.score(best.figure.value, measure), escape(measure.words),
                       f"at best: {escape(best.title())}")
        )  # fmt: skip
        gap = measure.sign() * (best.random - best.figure.value)
        if best.frames and math.isfinite(best.random):
            gap = best.random - best.frames.value
            cards.append(
                words.card(
                    words.points(gap), "promised too much by windows at random", "at that point"
                )
            )
    said = f"{escape(told.held(found))}. Data: {escape(_data(found))}."
    return (
        f'<p class="lead">{said[0].upper()}{said[1:]}</p><div class="cards">{"".join(cards)}</div>'
    )


def _data(found: Mapping[str, Any]) -> str:
    data = found["data"]
    if "folders" in data:
        return f"recordings in {', '.join(data['folders'])}"
    varied = [key for key in ("preset", "seed") if f"data.{key}" not in found["axes"]]
    said = [
        f"{words.several(data['users'], 'simulated person', 'simulated people')}",
        f"{words.several(data['sessions'], 'session')} of {data['minutes']:g} minutes each",
        *(["all on one orb"] if data["one_orb"] else []),
        *(f"{key} {data[key]}" for key in varied),
    ]
    return ", ".join(said)


def _curve(found: Mapping[str, Any], axis: str, measure: Measure) -> str:
    """Return the score over the amounts of an axis, a line for each place on the others."""
    lines = _series(figures.points(found), axis)
    together = len(lines) > LINES
    if together:
        lines = {"all else together": figures.along(found, axis)}
    every = [point for some in lines.values() for point in some]
    amounts = [figures.amount(point, axis) for point in every]
    low, high = fitted(
        [bound for p in every for bound in (p.figure.value, p.figure.low, p.figure.high)],
        least=0.02 if measure.share else 0.01,
    )
    low, high = max(0.0, low), min(1.0, high) if measure.share else high
    log = min(amounts) > 0 and max(amounts) / min(amounts) >= FAR
    longest = max(len(name) for name in lines)
    plot = Plot((760, 320), (min(amounts), max(amounts)), (low, high),
                margins=(26, 30 + min(260, 7 * longest), 44, 62), log_x=log)  # fmt: skip
    plot.axes(axis, measure.words, lambda v: f"{v:g}", lambda v: _tick(v, measure, high - low))
    ends = []
    for number, (name, some) in enumerate(lines.items()):
        some = sorted(some, key=lambda one: figures.amount(one, axis))
        kind = f"l{number}"
        plot.path([(figures.amount(p, axis), p.figure.value) for p in some], f"line {kind}")
        for point in some:
            x = plot.x(figures.amount(point, axis)) + 3.0 * (number - (len(lines) - 1) / 2)
            if math.isfinite(point.figure.low):
                plot.line((x, plot.y(point.figure.low)), (x, plot.y(point.figure.high)),
                          f"range {kind}")  # fmt: skip
            says = f"{point.title()}: {told.sure(point.figure, measure)}"
            plot.circle((x, plot.y(point.figure.value)), 4.0, f"mark {kind}", says)
        ends.append((some[-1].figure.value, name, f"name {kind}"))
    plot.ends(ends)
    below = (
        "Bars are 95 % intervals over those held out. They are the same people at every point, so "
        "a difference may be sure where bars overlap."
    )
    drawn = words.figure(plot.svg(f"{measure.words} over {axis}"), below)
    return words.section(f"Over {axis}", drawn)


def _series(points: Sequence[Point], axis: str) -> dict[str, list[Point]]:
    """Return the points of each place on the other axes."""
    lines: dict[str, list[Point]] = {}
    for point in points:
        others = [
            f"{key} {figures.place(key, value)}" for key, value in point.at.items() if key != axis
        ]
        lines.setdefault(", ".join(others), []).append(point)
    return lines


def _tick(value: float, measure: Measure, length: float) -> str:
    if not measure.share:
        return f"{value:.3f}" if length < 0.05 else f"{value:.2f}"
    return f"{100 * value:.1f} %" if length < 0.05 else f"{100 * value:.0f} %"


def _choice(points: Sequence[Point], measure: Measure) -> str:
    chosen = choose(points, measure)
    if chosen is None:
        return ""
    lines = told.best(chosen, measure, len(points))
    return words.section("The best of many", words.paragraph(*map(escape, lines)))


def _axes(found: Mapping[str, Any], measure: Measure) -> str:
    """Return a table for each axis, all others together."""
    axes = [axis for axis in found["axes"] if axis != "seed"]
    tables = []
    for axis in axes if len(axes) > 1 else ():
        rows = [
            (escape(figures.place(axis, p.at[axis])), words.count(p.trainings), _sure(p, measure))
            for p in figures.along(found, axis)
        ]
        tables.append(words.table((escape(axis), "trainings", escape(measure.words)), rows))
    return words.section("Each axis, all else together", words.beside(*tables)) if tables else ""


def _every(points: Sequence[Point], measure: Measure) -> str:
    """Return all points, with what they learned from."""
    if not points:
        return ""
    axes = list(points[0].at)
    learned = [key for key in ("users", "sessions", "windows") if key not in axes]
    head = [*map(escape, axes), *learned, escape(measure.words)]
    head += [*(["frames"] if points[0].frames else []), "at random", "seeds"]
    rows = [
        [
            *(escape(figures.place(axis, point.at[axis])) for axis in axes),
            *(words.count(point.learned[key]) for key in learned),
            _sure(point, measure),
            *([words.sure_share(point.frames)] if point.frames else []),
            told.score(point.random, measure).replace(" ", "&nbsp;"),
            told.spread(point, measure).replace(" ", "&nbsp;"),
        ]
        for point in points
    ]
    below = words.paragraph(
        "Users, sessions and windows are what was learned from. “At random” is the score on "
        "windows drawn at random from those sessions, whose neighbours were learned: what the "
        "paper’s protocol would report. “Seeds” are the worst and best of the repeats; the small "
        "figures are 95 % intervals over those held out, each counted once."
    )
    return words.section("Every point", words.table(head, rows, text=len(axes)), below)


def _sure(point: Point, measure: Measure) -> str:
    return words.sure_share(point.figure) if measure.share else words.sure(point.figure)


def _confusion(found: Mapping[str, Any]) -> str:
    """Return what unseen events were taken for, in all trainings together."""
    results = [job["result"] for job in found["jobs"] if "confusion" in job.get("result", {})]
    if not results:
        return ""
    labels = results[0]["labels"]
    some = [one["confusion"] for one in results if one["labels"] == labels]
    summed = [
        [sum(one[i][j] for one in some) for j in range(1, len(labels))]
        for i in range(1, len(labels))
    ]
    said = words.paragraph(
        "Rows are what was done, columns what it was taken for, by all trainings."
    )
    return words.section("Which are confused", said, words.matrix(labels[1:], summed))


def _failed(found: Mapping[str, Any]) -> str:
    lines = told.failed(found)
    if not lines:
        return ""
    listed = words.listed(lines)
    return words.section(
        "What failed", words.warning(listed + "The same command tries them again.")
    )


def _made(found: Mapping[str, Any], times: Mapping[str, Mapping[str, Any]]) -> str:
    machines: dict[str, list[float]] = {}
    for one in times.values():
        machines.setdefault(one["where"], []).append(one["cpu_s"])
    rows = [
        (escape(where), words.count(len(spent)), words.duration(sum(spent)))
        for where, spent in sorted(machines.items())
    ]
    asked = {key: found[key] for key in ("data", "train", "test", "axes", "version")}
    text = json.dumps(asked, indent=1, ensure_ascii=False)
    said = words.paragraph(
        "Results hang on the settings and on this version of the program, not on where a training "
        "ran, on their order or on what ran beside them."
    )
    left = words.listed(lines) if (lines := told.notes(found)) else ""
    where = words.folded(
        "where they ran", words.table(("machine, process", "trainings", "core"), rows)
    )
    what = words.folded("what was asked for", f"<pre><code>{escape(text)}</code></pre>")
    return words.section("How it was made", said, left, where, what)
