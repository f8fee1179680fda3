"""Content of a report's sections that is computed: warnings, summaries, maps and matrices."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from models.formatting import count, duration, label, percent
from models.reports import tables
from models.reports.tables import Table
from models.results import verdict
from models.results.training import SessionRow, Training
from models.results.verdict import Verdict


@dataclass(frozen=True, slots=True)
class Matrix:
    """A confusion matrix: rows are what was done, columns what it was taken for."""

    columns: Sequence[str]  # names of the columns
    # name of each row, its counts, and their sum; 0 where the row has no shares
    rows: Sequence[tuple[str, Sequence[int], int]]


def matrix(
    names: Sequence[str], counts: Sequence[Sequence[int]], first: tuple[str, str] = ("", "")
) -> Matrix:
    """Return a confusion matrix (classes, classes); `first` renames its first row and column."""
    titles, columns = ([first[i] or label(names[0]), *map(label, names[1:])] for i in (0, 1))
    totals = [sum(row) for row in counts]
    if first[0]:
        totals[0] = 0
    return Matrix(columns, list(zip(titles, counts, totals, strict=True)))


def without_null(counts: Sequence[Sequence[int]]) -> list[Sequence[int]]:
    """Return a confusion matrix without the row and the column of null."""
    return [row[1:] for row in counts[1:]]


def understood(found: Verdict, on: str) -> tuple[str, str, str]:
    """Return a headline: share of the events understood, its meaning, counts and worst gesture.

    Nothing but all of them is 100 %.
    """
    share, events = verdict.share(found), sum(one.of for one in found)
    worst = found[0]
    below = f"{count(sum(one.understood for one in found))} of {count(events)} {on}"
    if share < 1.0:
        share = min(share, 0.9999)
        below += f"; worst: {worst.label}, {worst.understood} of {worst.of}"
    return percent(share), "of gestures understood", below


def chip(kind: str, text: str) -> Markup:
    """Return a short text with a border, in the colour of "good", "doubtful" or "failed"."""
    return Markup('<span class="chip {}">{}</span>').format(kind, text)


def label_summary(found: Training) -> dict[str, Any] | None:
    """Return sums and means of all labels' lateness, by name; None where labels are the truth."""
    late = [row.lateness for row in found.sessions if row.lateness is not None]
    if not late:
        return None
    begins = sorted(of.begin_s for of in late if math.isfinite(of.begin_s))
    wrong = [(of.wrong, of.wrong_after) for of in late if math.isfinite(of.wrong)]
    sums = ("edges", "moved", "masked", "unfelt", "unlabelled")
    return {
        **{name: sum(getattr(of, name) for of in late) for name in sums},
        "begin_s": begins[len(begins) // 2] if begins else math.nan,
        "wrong": [sum(one) / len(wrong) for one in zip(*wrong, strict=True)],
    }


def session_table(found: Training, rows: Sequence[SessionRow]) -> Table:
    """Return the table of recordings."""
    columns: tuple[tables.Column, ...] = (
        ("session", _session),
        ("", lambda row: "held out" if row.held_out else ""),
        ("length", lambda row: duration(row.seconds)),
        ("check", lambda row: chip(row.verdict, row.verdict)),
        ("labels", lambda row: row.labeller),
        *(
            (label(name), lambda row, name=name: count(row.examples.get(name, 0)))
            for name in found.labels[1:]
        ),
    )
    return tables.table(columns, rows, words=2)


def _session(row: SessionRow) -> Markup:
    name = Markup("{}").format(row.path.rpartition("/")[2])
    if row.verdict == "good":
        return name
    findings = (Markup("<br><small>{}</small>").format(text) for text in row.findings)
    return name + Markup("").join(findings)
