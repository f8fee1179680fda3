"""Card of a cross-validation, as Markdown."""

from collections.abc import Sequence

from models.reports import markdown
from models.reports.tables import Table
from models.results.figure import Figure
from models.studies.fold_statistics import TOUCHED, CrossValidation, Model


def text(found: CrossValidation) -> str:
    """Return the report."""
    touched = [f"{name}: {n} windows" for name, n in zip(TOUCHED, found.touched, strict=True)]
    tables = [
        _shares("fold", found.held, found.models, "by_fold", found.chosen),
        _shares("person", found.people, found.models, "by_person"),
        *([_shares("session", found.kinds, found.models, "by_kind")] if found.kinds else []),
        _shares("images of the window that are touched", touched, found.models, "by_touched"),
        *(_confusion(found.labels, model) for model in found.models),
    ]
    parts = [
        f"{found.data}; folds: {len(found.held)}. Always naming the commonest class gets "
        f"{found.majority:.3f} of the windows right. Intervals are 95 %, by resampling people.",
        markdown.table(_scores(found)),
        f"CPU time of all, {found.reading_cpu_s:.0f} s of reading included: "
        f"{found.cpu_minutes:.1f} minutes.",
    ]
    return "\n\n".join([*parts, *map(markdown.table, tables)])


def _scores(found: CrossValidation) -> Table:
    rows = [
        [model.name, str(model.windows), str(model.stretches), f"{model.cpu_s / 60.0:.1f}"]
        for model in found.models
    ]
    for gain in found.gains:
        ahead = f"better for {gain.ahead} of {len(found.people)} people"
        name = f"ours more than {gain.name}"
        rows.append([name, _points(gain.windows), _points(gain.stretches), ahead])
    return Table(["", "windows", "stretches", "CPU minutes"], rows)


def _shares(
    what: str,
    names: Sequence[str],
    models: Sequence[Model],
    key: str,
    chosen: Sequence[str] = (),
) -> Table:
    """Return a table of the share of windows named rightly, a row for each name."""
    head = [what, *(model.name for model in models), *(["chosen"] if chosen else [])]
    rows = [
        [name, *(f"{getattr(model, key)[i]:.3f}" for model in models), *chosen[i : i + 1]]
        for i, name in enumerate(names)
    ]
    return Table(head, rows)


def _confusion(labels: Sequence[str], model: Model) -> Table:
    """Return the confusion matrix in per cent, without classes that do not occur."""
    used = [number for number, row in enumerate(model.confusion) if sum(row)]
    rows = []
    for number in used:
        row = model.confusion[number]
        shares = [f"{100.0 * row[i] / sum(row):.1f} %" for i in used]
        rows.append([f"**{labels[number]}**", *shares])
    return Table([f"{model.name}: done \\ named", *(labels[i] for i in used)], rows)


def _points(figure: Figure) -> str:
    """Return a difference of shares in points."""
    value, low, high = (100.0 * one for one in (figure.value, figure.low, figure.high))
    return f"{value:+.1f} points ({low:+.1f} … {high:+.1f})"
