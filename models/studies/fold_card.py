"""Card of a cross-validation, as Markdown."""

from collections.abc import Iterable, Sequence

from models.results.figure import Figure
from models.studies.fold_statistics import TOUCHED, Crossed, Gain, Model


def text(found: Crossed) -> str:
    """Return the report."""
    lines = [
        f"{found.data}; folds: {len(found.held)}. Who knows nothing gets {found.majority:.3f} of "
        "the windows right. Intervals are 95 %, by resampling people.",
        "",
        "| | windows | stretches | CPU minutes |",
        "|---|---|---|---|",
        *(
            f"| {one.name} | {one.windows} | {one.stretches} | {one.cpu_s / 60.0:.1f} |"
            for one in found.models
        ),
        *(_ahead(found, one) for one in found.gains),
        "",
        f"CPU time of all, {found.reading_cpu_s:.0f} s of reading included: "
        f"{found.cpu_minutes:.1f} minutes.",
        "",
        *_table("fold", found.held, [(m.name, m.by_fold) for m in found.models], found.chosen),
        "",
        *_table("person", found.people, [(m.name, m.by_person) for m in found.models]),
    ]
    if found.kinds:
        lines += ["", *_table("session", found.kinds, [(m.name, m.by_kind) for m in found.models])]
    touched = [f"{name}: {n} windows" for name, n in zip(TOUCHED, found.touched, strict=True)]
    columns = [(m.name, m.by_touched) for m in found.models]
    lines += ["", *_table("images of the window that are touched", touched, columns)]
    for model in found.models:
        lines += ["", *_confusion(found.labels, model)]
    return "\n".join(lines)


def _ahead(found: Crossed, gain: Gain) -> str:
    return (
        f"| ours more than {gain.name} | {_signed(gain.windows)} | {_signed(gain.stretches)} | "
        f"better for {gain.ahead} of {len(found.people)} people |"
    )


def _signed(figure: Figure) -> str:
    """Return a difference in points."""
    value, low, high = (100.0 * one for one in (figure.value, figure.low, figure.high))
    return f"{value:+.1f} points ({low:+.1f} … {high:+.1f})"


def _table(
    what: str,
    names: Sequence[str],
    columns: Sequence[tuple[str, Sequence[float]]],
    chosen: Sequence[str] = (),
) -> Iterable[str]:
    """Return the share of windows named rightly, a row for each name."""
    more = " chosen |" if chosen else ""
    yield f"| {what} | " + " | ".join(name for name, _ in columns) + " |" + more
    yield "|---" * (1 + len(columns) + bool(chosen)) + "|"
    for number, name in enumerate(names):
        cells = " | ".join(f"{shares[number]:.3f}" for _, shares in columns)
        yield f"| {name} | {cells} |" + (f" {chosen[number]} |" if chosen else "")


def _confusion(labels: Sequence[str], model: Model) -> Iterable[str]:
    """Return what each class was taken for, in per cent; what nobody did is left out."""
    rows = [number for number, row in enumerate(model.confusion) if sum(row)]
    yield f"| {model.name}: done \\ named | " + " | ".join(labels[i] for i in rows) + " |"
    yield "|---" * (1 + len(rows)) + "|"
    for number in rows:
        row = model.confusion[number]
        cells = " | ".join(f"{100.0 * row[i] / sum(row):.1f} %" for i in rows)
        yield f"| **{labels[number]}** | {cells} |"
