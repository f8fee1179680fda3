"""Card of a cross-validation, as Markdown."""

from collections.abc import Iterator, Sequence

from models.results.figure import Figure
from models.studies.fold_statistics import TOUCHED, CrossValidation, Model


def text(found: CrossValidation) -> str:
    """Return the report."""
    touched = [f"{name}: {n} windows" for name, n in zip(TOUCHED, found.touched, strict=True)]
    tables = [
        _scores(found),
        [
            f"CPU time of all, {found.reading_cpu_s:.0f} s of reading included: "
            f"{found.cpu_minutes:.1f} minutes."
        ],
        _shares("fold", found.held, found.models, "by_fold", found.chosen),
        _shares("person", found.people, found.models, "by_person"),
        *([_shares("session", found.kinds, found.models, "by_kind")] if found.kinds else []),
        _shares("images of the window that are touched", touched, found.models, "by_touched"),
        *(_confusion(found.labels, model) for model in found.models),
    ]
    head = (
        f"{found.data}; folds: {len(found.held)}. Always naming the commonest class gets "
        f"{found.majority:.3f} of the windows right. Intervals are 95 %, by resampling people."
    )
    return "\n\n".join([head, *("\n".join(lines) for lines in tables)])


def _scores(found: CrossValidation) -> Iterator[str]:
    yield from _head(["", "windows", "stretches", "CPU minutes"])
    for model in found.models:
        yield _row([model.name, model.windows, model.stretches, f"{model.cpu_s / 60.0:.1f}"])
    for gain in found.gains:
        ahead = f"better for {gain.ahead} of {len(found.people)} people"
        leads = _points(gain.windows), _points(gain.stretches)
        yield _row([f"ours more than {gain.name}", *leads, ahead])


def _shares(
    what: str,
    names: Sequence[str],
    models: Sequence[Model],
    key: str,
    chosen: Sequence[str] = (),
) -> Iterator[str]:
    """Yield a table of the share of windows named rightly, a row for each name."""
    yield from _head([what, *(model.name for model in models), *(["chosen"] if chosen else [])])
    for number, name in enumerate(names):
        shares = [f"{getattr(model, key)[number]:.3f}" for model in models]
        yield _row([name, *shares, *chosen[number : number + 1]])


def _confusion(labels: Sequence[str], model: Model) -> Iterator[str]:
    """Yield what each class was named, in per cent; classes that do not occur are left out."""
    rows = [number for number, row in enumerate(model.confusion) if sum(row)]
    yield from _head([f"{model.name}: done \\ named", *(labels[i] for i in rows)])
    for number in rows:
        row = model.confusion[number]
        yield _row([f"**{labels[number]}**", *(f"{100.0 * row[i] / sum(row):.1f} %" for i in rows)])


def _points(figure: Figure) -> str:
    """Return a difference of shares in points."""
    value, low, high = (100.0 * one for one in (figure.value, figure.low, figure.high))
    return f"{value:+.1f} points ({low:+.1f} … {high:+.1f})"


def _head(cells: Sequence[object]) -> Iterator[str]:
    yield _row(cells)
    yield "|---" * len(cells) + "|"


def _row(cells: Sequence[object]) -> str:
    return f"| {' | '.join(map(str, cells))} |"
