"""Results of judging networks: figures with intervals, as numbers, tables and JSON."""

import html
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.errors import UserError, count
from models.evaluation import bootstrap
from models.evaluation.evaluate import summarise
from models.evaluation.event_counts import Tally
from models.results.evaluation import Figure
from models.results.verdict import GestureVerdict

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


@dataclass(frozen=True)
class Figures:
    """Figures; each has `value`, and `low` and `high`, the bounds of `interval`.

    `float(figure)` is its value; bounds of a single recording are not known.

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
        return {
            name: {key: None if np.isnan(v) else v for key, v in asdict(one).items()}
            for name, one in self.figures().items()
        }

    def to_json(self) -> str:
        """Return `to_dict` as JSON."""
        return json.dumps(self.to_dict())

    def to_pandas(self) -> "pandas.DataFrame":
        """Return a table with a row for each figure; needs pandas."""
        return pandas_of("a table").DataFrame.from_dict(self.to_dict(), orient="index", dtype=float)

    def __str__(self) -> str:
        lines = [f"{name:20} {figure}" for name, figure in self.figures().items()]
        return "\n".join([*lines, f"interval: {INTERVAL}"])

    def _repr_html_(self) -> str:
        """Return the figures as a table, for a notebook."""
        cells = [(name.replace("_", " "), str(figure)) for name, figure in self.figures().items()]
        rows = "".join(f"<tr><td>{a}</td><td>{html.escape(b)}</td></tr>" for a, b in cells)
        of = f"{count(self.sessions, 'session')}; intervals: {INTERVAL}"
        return f"<table><caption>{of}</caption>{rows}</table>"


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

    Raises:
        Error: They are no evaluations, or of different recordings.
    """
    if not (isinstance(a, Evaluation) and isinstance(b, Evaluation)):
        raise UserError("compare takes two evaluations; make them with orbtouch.evaluate")
    ones, others = a._tallies, b._tallies
    if [(t.name, t.events) for t in ones] != [(t.name, t.events) for t in others]:
        raise UserError("the evaluations are of different recordings; evaluate both on the same")
    whole = np.arange(len(ones))
    picks = [whole, *np.random.default_rng(0).integers(len(ones), size=(_DRAWS, len(ones)))]
    values = [[_values([some[i] for i in pick]) for pick in picks] for some in (ones, others)]
    found = {}
    for name in values[0][0]:
        value, *drawn = [one[name] - other[name] for one, other in zip(*values, strict=True)]
        known = len(ones) > 1 and np.isfinite(drawn).any()
        bounds = bootstrap.middle(np.array(drawn)) if known else (np.nan, np.nan)
        found[name] = Figure(float(value), *bounds)
    return Comparison(len(ones), **found)


def pandas_of(what: str) -> Any:
    """Return pandas; Error if it is missing."""
    try:
        import pandas
    except ImportError:
        raise UserError(f"{what} needs pandas; install it with: pip install pandas") from None
    return pandas
