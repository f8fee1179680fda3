"""Tables of results, as Markdown."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from models.formatting import (
    NONE,
    count,
    duration,
    label,
    number,
    number_interval,
    percent,
    points,
    seconds,
    share_interval,
)
from models.results.evaluation import (
    LocationFigures,
    Result,
    Row,
    Tuning,
    numbers,
)
from models.results.training import ClassRow, Training, UserResult

Column = tuple[str, Callable[[Any], str]]  # its title, and its cell of a row


@dataclass(frozen=True, slots=True)
class Table:
    """A table of texts."""

    head: Sequence[str]  # titles of the columns
    rows: Sequence[Sequence[str]]  # their cells

    def markdown(self) -> str:
        """Return it as Markdown."""
        lines = [self.head, ["---"] * len(self.head), *self.rows]
        return "\n".join(f"|{'|'.join(map(_markdown_cell, line))}|" for line in lines)


def _markdown_cell(text: str) -> str:
    return f" {text.replace('|', chr(92) + '|')} " if text else " "


def table(columns: Sequence[Column], rows: Iterable[Any]) -> Table:
    """Return a table with a row for each value."""
    head = [title for title, _ in columns]
    return Table(head, [[cell(row) for _, cell in columns] for row in rows])


def _located(cell: Callable[[LocationFigures], str]) -> Callable[[Result], str]:
    """Return a cell about positions, for sets of sessions of which some have none."""
    return lambda result: cell(result.location) if result.location else NONE


_FIGURES: Final[tuple[Column, ...]] = (
    ("sessions, users", lambda r: f"{r.sessions}, {r.users}"),
    ("events", lambda r: count(r.events)),
    ("idle time", lambda r: duration(60 * r.idle_minutes)),
    ("F1", lambda r: share_interval(r.f1)),
    ("recall", lambda r: share_interval(r.recall)),
    ("precision", lambda r: share_interval(r.precision)),
    ("missed", lambda r: share_interval(r.missed)),
    ("answered with another name", lambda r: share_interval(r.wrong)),
    ("answered twice", lambda r: share_interval(r.duplicates)),
    ("false alarms per idle minute", lambda r: number_interval(r.false_alarms_per_min)),
    ("latency from onset, median", lambda r: f"{number_interval(r.latency_s, 2)} s"),
    ("– 95 % within", lambda r: seconds(r.latency_p95_s)),
    ("latency from first contact, median", lambda r: seconds(r.contact_latency_s.value)),
    ("– 95 % within", lambda r: seconds(r.contact_latency_p95_s)),
    ("event accuracy", lambda r: share_interval(r.event_accuracy)),
    ("– interval over users", lambda r: share_interval(r.new_user_accuracy)),
    ("frame accuracy", lambda r: share_interval(r.frame_accuracy)),
    ("calibration error", lambda r: number(r.calibration.error, 4)),
)
_POSITIONS: Final[tuple[Column, ...]] = (
    ("position error of a press, grid units", _located(lambda it: number_interval(it.error))),
    ("– on the taxels", _located(lambda it: number_interval(it.on_site))),
    ("– between them", _located(lambda it: number_interval(it.off_site))),
    (
        "– half, and 95 % of presses within",
        _located(lambda it: f"{number(it.half_within)}, {number(it.most_within)}"),
    ),
    ("– standard deviation given, median", _located(lambda it: number(it.sigma))),
    (
        "– errors within one of them (68 % is right), and two (95 %)",
        _located(lambda it: f"{percent(it.within_one)}, {percent(it.within_two)}"),
    ),
)
_CLASSES: Final[tuple[Column, ...]] = (
    ("gesture", lambda c: label(c.label)),
    ("events", lambda c: count(c.events)),
    ("recall", lambda c: share_interval(c.recall)),
    ("precision", lambda c: share_interval(c.precision)),
    ("event accuracy", lambda c: share_interval(c.named)),
)
_ROWS: Final[tuple[Column, ...]] = (
    ("events", lambda r: count(r.events)),
    ("F1", lambda r: number(r.f1, 4)),
    ("event accuracy", lambda r: percent(r.event_accuracy)),
    ("frame accuracy", lambda r: percent(r.frame_accuracy)),
    ("false alarms / min", lambda r: number(r.false_alarms_per_min)),
    ("latency", lambda r: seconds(r.latency_s)),
    ("position error", lambda r: number(r.location_error)),
)


def figures(results: Sequence[Result]) -> Table:
    """Return the figures of an evaluation: a row each, a column for each set of sessions."""
    columns = _FIGURES + (_POSITIONS if any(result.location for result in results) else ())
    rows = [[name, *(cell(result) for result in results)] for name, cell in columns]
    return Table(["figure", *(result.name for result in results)], rows)


def answered(result: Result) -> Table:
    """Return the confusion matrix of events (rows) by answers, nothing last."""
    names = [*map(label, result.labels[1:]), "nothing"]
    counts = [[*row[1:], row[0]] for row in (*result.answered[1:], result.answered[0])]
    rows = [[f"**{name}**", *map(count, row)] for name, row in zip(names, counts, strict=True)]
    rows[-1][-1] = ""  # nothing happened, and nothing was answered
    return Table(["done \\ answered", *names], rows)


def gestures(result: Result) -> Table:
    """Return the figures of every gesture."""
    return table(_CLASSES, result.classes)


def sessions(what: str, rows: Iterable[Row]) -> Table:
    """Return the figures of sessions or users, the worst first."""
    ranked = sorted(rows, key=lambda row: row.f1 if math.isfinite(row.f1) else 2.0)
    return table(((what, lambda row: row.name), *_ROWS), ranked)


def thresholds(found: Tuning) -> Table:
    """Return the debounce settings before and after a tuning, and their figures."""
    names = numbers(found.chosen.settings)
    rows = [
        [
            title,
            *(f"{getattr(point.settings, name):g}" for name in names),
            percent(point.recall, 2),
            number(point.f1, 4),
            number(point.false_alarms_per_min),
            seconds(point.latency_s),
        ]
        for title, point in (("before", found.before), ("chosen", found.chosen))
    ]
    return Table(["", *names, "recall", "F1", "false alarms / min", "latency"], rows)


def classes(found: Training) -> Table:
    """Return the figures of every class of a training, in sessions held out."""
    columns: tuple[Column, ...] = (
        ("gesture", lambda row: label(row.label)),
        ("examples", lambda row: count(row.examples) if row.examples else ""),
        ("time", lambda row: duration(row.seconds)),
        ("window recall", lambda row: percent(row.recall)),
        ("window precision", lambda row: percent(row.precision)),
        ("event recall", lambda row: percent(row.event_recall) if row.label != "null" else ""),
        ("answered", lambda row: _answered(found, row)),
    )
    return table(columns, found.classes)


def _answered(found: Training, row: ClassRow) -> str:
    """Return the number of gestures of a class that are answered rightly: "13 of 20"."""
    number_of = found.classes.index(row)
    if not number_of or found.gesture is None or not found.gesture.answered:
        return ""
    counts = found.gesture.answered[number_of]
    return f"{count(counts[number_of])} of {count(sum(counts))}"


def honesty(found: Training) -> Table:
    """Return the scores on unseen sessions beside those of the paper's protocol."""
    rows: list[list[str]] = []
    if (gesture := found.gesture) is not None:
        honest = gesture.honesty
        # Of its outputs, one a class, two are wrong where the name of a window is.
        unseen, random = (
            1.0 - 2.0 * (1.0 - share) / len(found.labels)
            for share in (honest.unseen, honest.random)
        )
        understood, events = (
            sum(getattr(one, name) for one in gesture.verdict) for name in ("understood", "of")
        )
        rows += [
            [
                "right windows",
                share_interval(honest.figure),
                percent(honest.random, 2),
                points(honest.gap),
            ],
            [
                "right outputs (“binary”)",
                percent(unseen, 2),
                percent(random, 2),
                points(random - unseen),
            ],
            ["right events", percent(gesture.event_accuracy, 2), "", ""],
            ["understood, as in play", f"{understood} of {events}", "", ""],
        ]
    if (location := found.location) is not None:
        honest = location.honesty
        sites = f"{number(location.on_site)}, {number(location.off_site)}"
        rows += [
            [
                "position error, grid units",
                number_interval(honest.figure),
                number(honest.random),
                number(-honest.gap),
            ],
            ["– on the taxels, between them", sites, "", ""],
            ["– change at half the strength", number(location.half_strength), "", ""],
        ]
    return Table(["", "unseen", "windows at random, as the paper's protocol", "gap"], rows)


def users(found: UserResult) -> list[Table]:
    """Return the tables of a user identification: by protocol, by person, against strangers."""
    protocols = [
        [
            f"{seen} {'gesture' if seen == 1 else 'gestures'} in a row, unseen",
            share_interval(figure),
        ]
        for seen, figure in found.seen.items()
    ]
    protocols.append(["windows at random, as the paper's protocol", percent(found.random)])
    people: tuple[Column, ...] = (
        ("person", lambda one: one.name),
        ("sessions", lambda one: count(one.sessions)),
        ("gestures", lambda one: count(one.gestures)),
        ("single gestures named rightly, unseen", lambda one: percent(one.right)),
    )
    strangers: tuple[Column, ...] = (
        ("gestures in a row", lambda one: str(one.seen)),
        ("AUROC", lambda one: number(one.auroc)),
        ("strangers accepted", lambda one: percent(one.false_accepts)),
        ("people named rightly", lambda one: percent(one.right)),
        ("people taken for another", lambda one: percent(one.wrong)),
    )
    made = [Table(["judged on", "named rightly"], protocols), table(people, found.people)]
    return [*made, table(strangers, found.open)] if found.open else made
