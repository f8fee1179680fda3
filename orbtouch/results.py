"""Results of judging networks: figures with intervals, as numbers, tables and JSON."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.errors import UserError, count
from models.evaluation import bootstrap
from models.evaluation.evaluate import summarise
from models.evaluation.event_counts import Tally
from models.results import storage
from models.results.evaluation import Figure
from models.results.verdict import GestureVerdict
from orbtouch import checks

if TYPE_CHECKING:
    import pandas

INTERVAL: Final = "95 % by resampling recordings"  # the one kind of interval
_DRAWS: Final = 500  # resamplings of a difference


def _values(tallies: Sequence[Tally]) -> dict[str, float]:
    """Return the figures of which `compare` takes differences, of the counts of recordings."""
    counts = [(t.hits, t.answers.sum(), t.events, t.false_alarms, t.idle_minutes) for t in tallies]
    hits, answers, events, false, idle = np.sum(counts, axis=0).astype(np.float64)
    late = np.concatenate([t.latencies_s for t in tallies])
    with np.errstate(divide="ignore", invalid="ignore"):
        return {
            "f1": 2.0 * hits / (answers + events),
            "precision": hits / answers,
            "recall": hits / events,
            "false_alarms_per_min": false / idle,
            "latency": float(np.median(late)) if len(late) else np.nan,
        }


def html_table(rows: Mapping[str, object], head: str = "") -> str:
    """Return names and values as a table of HTML, for a notebook."""
    cells = ((html.escape(str(cell)) for cell in row) for row in rows.items())
    lines = (f"<tr><td>{name.replace('_', ' ')}</td><td>{value}</td></tr>" for name, value in cells)
    return f"<table>{head}{''.join(lines)}</table>"


@dataclass(frozen=True)
class Figures:
    """Figures; each has `value`, and `low` and `high`, the bounds of `interval`.

    `float(figure)` is its value. Bounds of a single recording are known only if it has
    no failure.

    Attributes:
        sessions: Number of recordings.
        f1: Harmonic mean of precision and recall, over gestures answered once and in time.
        precision: Share of answers that were right.
        recall: Share of gestures that were answered rightly.
        false_alarms_per_min: Answers to nothing, per idle minute.
        latency: Median time from a gesture's onset to its answer, seconds.
    """

    sessions: int
    f1: Figure
    precision: Figure
    recall: Figure
    false_alarms_per_min: Figure
    latency: Figure

    def figures(self) -> dict[str, Figure]:
        """Return the figures that are known, by name."""
        return {name: one for name, one in vars(self).items() if isinstance(one, Figure)}

    def to_dict(self) -> dict[str, dict[str, float | None]]:
        """Return value, low and high of each figure by name; None: not known."""
        return storage.plain(self.figures())  # type: ignore[no-any-return]

    def to_json(self) -> str:
        """Return `to_dict` as JSON."""
        return storage.json_text(self.figures())

    def to_pandas(self) -> "pandas.DataFrame":
        """Return a table with a row for each figure; needs pandas."""
        table = checks.needed("pandas", "a table", "pip install pandas").DataFrame
        return table.from_dict(self.to_dict(), orient="index", dtype=float)

    def __str__(self) -> str:
        lines = [f"{name:20} {figure}" for name, figure in self.figures().items()]
        return "\n".join([*lines, f"interval: {INTERVAL}"])

    def _repr_html_(self) -> str:
        """Return the figures as a table, for a notebook."""
        of = f"{count(self.sessions, 'session')}; intervals: {INTERVAL}"
        return html_table(self.figures(), f"<caption>{of}</caption>")


@dataclass(frozen=True)
class Evaluation(Figures):
    """Figures of a network or a predictor on labelled recordings; and these attributes.

    Attributes:
        classes: Gestures, "null" first.
        events: Number of true gestures.
        position_error: Mean error of presses' positions, grid units; None: places are not known.
        confusion: Counts, (classes, classes): gestures (rows) by answers (columns), 0 is nothing.
        verdict: A line for each gesture, worst first.
    """

    classes: tuple[str, ...]
    events: int
    position_error: Figure | None
    confusion: NDArray[np.int64]
    verdict: tuple[GestureVerdict, ...]
    _tallies: tuple[Tally, ...] = field(default=(), repr=False)

    def _repr_html_(self) -> str:
        """Return the figures as a table, and the verdict, for a notebook."""
        lines = "<br>".join(html.escape(str(line)) for line in self.verdict)
        return f"{super()._repr_html_()}{lines}"


@dataclass(frozen=True)
class Comparison(Figures):
    """Differences of two evaluations, the first less the second, on the same recordings."""


def evaluation_of(classes: Sequence[str], tallies: Sequence[Tally]) -> Evaluation:
    """Return the figures of recordings' counts."""
    found = summarise("recordings", classes, tallies)
    same = ("sessions", "events", "verdict", "f1", "precision", "recall", "false_alarms_per_min")
    return Evaluation(
        **{name: getattr(found, name) for name in same},
        latency=found.latency_s,
        classes=tuple(classes),
        position_error=found.location.error if found.location else None,
        confusion=np.array(found.answered, dtype=np.int64),
        _tallies=tuple(tallies),
    )


def compare(a: Evaluation, b: Evaluation) -> Comparison:
    """Return the differences a - b of the figures, paired by recording, with intervals.

    Error if they are no evaluations, or of different recordings.
    """
    if not (isinstance(a, Evaluation) and isinstance(b, Evaluation)):
        raise UserError("compare takes two evaluations; make them with orbtouch.evaluate")
    ones, others = a._tallies, b._tallies
    if [(t.name, t.events) for t in ones] != [(t.name, t.events) for t in others]:
        raise UserError("the evaluations are of different recordings; evaluate both on the same")
    drawn = np.random.default_rng(0).integers(len(ones), size=(_DRAWS, len(ones)))
    picks, found = [np.arange(len(ones)), *drawn], {}
    values = [[_values([some[i] for i in pick]) for pick in picks] for some in (ones, others)]
    for name in values[0][0]:
        differences = np.array([a[name] - b[name] for a, b in zip(*values, strict=True)])
        known = len(ones) > 1 and np.isfinite(differences[1:]).any()
        bounds = bootstrap.middle(differences[1:]) if known else (np.nan, np.nan)
        found[name] = Figure(float(differences[0]), *bounds)
    return Comparison(len(ones), **found)
