"""Page writer: reports as one HTML file that needs no network, light and dark, on paper too.

Pages are Jinja2 templates in `templates/`, with autoescape. The functions that they call come last.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from controller.bundles.bundle import Bundle
from controller.shared import errors
from models import formatting
from models.formatting import count, duration, label, percent
from models.reports import cards, figures, tables
from models.reports.tables import Table
from models.results import storage, verdict
from models.results.evaluation import Evaluation
from models.results.training import SessionRow, Training, UserResult
from models.results.verdict import Verdict

# Functions of `models.formatting` that templates use.
FILTERS: Final = [
    "label",
    "percent",
    "number",
    "count",
    "seconds",
    "duration",
    "lateness",
    "joined",
]


def html(found: Training | Evaluation) -> str:
    """Return the report page of a training or an evaluation."""
    name = "training" if isinstance(found, Training) else "evaluation"
    return _environment().get_template(f"{name}.html").render(found=found)


def write(path: Path, found: Training | Evaluation) -> None:
    """Write the report page."""
    storage.write_text(path, html(found))


def write_training(out: Path, loaded: Bundle, found: Training) -> None:
    """Write NAME.md, NAME.json and NAME.html beside the bundle NAME.orb."""
    storage.write_text(out.with_suffix(".md"), f"{cards.training(loaded, found)}\n")
    storage.write_json(out.with_suffix(".json"), found)
    write(out.with_suffix(".html"), found)


def write_users(out: Path, found: UserResult) -> None:
    """Write NAME.md and NAME.json beside the bundle NAME.orb of identified users."""
    storage.write_text(out.with_suffix(".md"), f"{cards.users(found)}\n")
    storage.write_json(out.with_suffix(".json"), found)


@cache
def _environment() -> Environment:
    """Return the templates with the filters and functions that they use."""
    made = Environment(
        loader=PackageLoader("models.reports"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    for name in FILTERS:
        made.filters[name] = getattr(formatting, name)
    made.filters |= {"interval": _interval, "several": errors.count}
    style = resources.files("models.reports").joinpath("style.css").read_text(encoding="utf-8")
    own = (matrix_of, without_null, understood, label_summary, session_table)
    made.globals.update({one.__name__: one for one in own})
    made.globals.update(figures=figures, tables=tables, style=Markup(style))
    return made


def _interval(cell: str) -> str:
    """Return a table's cell with its interval, "(0.97–0.99)", in small print."""
    if isinstance(cell, Markup):
        return cell
    parts = re.fullmatch(r"(\S.*) \((-?[\d.]+–-?[\d.]+)\)(.*)", cell)
    if parts is None:
        return cell
    return Markup('{} <span class="interval">{}</span>{}').format(parts[1], parts[2], parts[3])


@dataclass(frozen=True, slots=True)
class _Matrix:
    """A confusion matrix: rows are what was done, columns what it was taken for."""

    columns: Sequence[str]  # names of the columns
    # name of each row, its counts, and their sum; 0 where the row has no shares
    rows: Sequence[tuple[str, Sequence[int], int]]


def matrix_of(
    names: Sequence[str], counts: Sequence[Sequence[int]], first: tuple[str, str] = ("", "")
) -> _Matrix:
    """Return a confusion matrix (classes, classes); `first` renames its first row and column."""
    titles, columns = ([first[i] or label(names[0]), *map(label, names[1:])] for i in (0, 1))
    totals = [sum(row) for row in counts]
    if first[0]:
        totals[0] = 0
    return _Matrix(columns, list(zip(titles, counts, totals, strict=True)))


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


def _chip(kind: str, text: str) -> Markup:
    """Return a short text with a border, in the colour of "good", "doubtful" or "failed"."""
    return Markup('<span class="chip {}">{}</span>').format(kind, text)


def label_summary(found: Training) -> dict[str, Any] | None:
    """Return sums and means of all labels' lateness, by name; None where labels are the truth."""
    late = [row.lateness for row in found.sessions if row.lateness is not None]
    if not late:
        return None
    begins = sorted(of.begin_s for of in late if math.isfinite(of.begin_s))
    wrong = [(of.wrong, of.wrong_after) for of in late if math.isfinite(of.wrong)]
    sums = ("edges", "moved", "masked", "unfelt", "unlabelled", "named", "changed")
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
        ("check", lambda row: _chip(row.verdict, row.verdict)),
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
