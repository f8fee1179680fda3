"""Card and page of a training that identifies users."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from importlib import resources
from pathlib import Path

from models import json_values, text, user_files
from models.results.figure import Figure
from models.results.users import Telling


def write(out: Path, found: Telling) -> None:
    """Write NAME.md, NAME.json and NAME.html beside the bundle NAME.orb."""
    user_files.write_text(out.with_suffix(".md"), f"{card(found)}\n")
    user_files.write_text(out.with_suffix(".json"), f"{json_values.text(asdict(found))}\n")
    user_files.write_text(out.with_suffix(".html"), page(found))


def card(found: Telling) -> str:
    """Return the card as Markdown."""
    lines = [
        f"# {found.name}: {text.several(len(found.people), 'person', 'people')}",
        "",
        f"`{found.command}`",
        "",
        f"Told by {', '.join(found.gestures)}. {found.split}",
        *(f"\n{note}" for note in found.notes),
    ]
    for head, rows in _tables(found):
        lines += ["", f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
        lines += [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([*lines, "", _warning()])


def page(found: Telling) -> str:
    """Return the report: one HTML file that needs no network."""
    style = resources.files("models.reports").joinpath("style.css").read_text(encoding="utf-8")
    title = escape(found.name)
    about = text.paragraph(
        escape(f"Told by {', '.join(found.gestures)}. {found.split}"),
        *(escape(note) for note in found.notes),
        escape(_warning()),
    )
    tables = [
        text.table([escape(one) for one in head], [[escape(one) for one in row] for row in rows])
        for head, rows in _tables(found)
    ]
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{style}</style></head>\n<body><h1>{title}: who touches</h1>"
        f"{text.section('People', about, *tables)}"
        f"{text.section('How it was made', f'<code>{escape(found.command)}</code>')}"
        "</body></html>\n"
    )


def _warning() -> str:
    return (
        "This is a convenience: somebody who touches alike is taken for another. It locks nothing, "
        "and nothing may be locked with it."
    )


def _tables(found: Telling) -> list[tuple[Sequence[str], Sequence[Sequence[str]]]]:
    """Return every table: its head, and its rows."""
    protocols = [
        (f"{seen} gesture{'s' if seen > 1 else ''} in a row, unseen", _share(figure))
        for seen, figure in found.seen.items()
    ]
    protocols.append(("windows at random, as the paper's protocol", _percent(found.random)))
    tables: list[tuple[Sequence[str], Sequence[Sequence[str]]]] = [
        (("judged on", "named rightly"), protocols),
        (
            ("person", "sessions", "gestures", "single gestures named rightly, unseen"),
            [
                (one.name, str(one.sessions), str(one.gestures), _percent(one.right))
                for one in found.people
            ],
        ),
    ]
    if found.open:
        tables.append(
            (
                (
                    "gestures in a row", "AUROC", "strangers taken for somebody",
                    "people named rightly", "taken for somebody else",
                ),
                [
                    (
                        str(one.seen), f"{one.auroc:.3f}", _percent(one.false_accepts),
                        _percent(one.right), _percent(one.wrong),
                    )
                    for one in found.open
                ],
            )
        )  # fmt: skip
    return tables


def _share(figure: Figure) -> str:
    if not math.isfinite(figure.low):
        return _percent(figure.value)
    return f"{_percent(figure.value)} ({100 * figure.low:.1f}–{100 * figure.high:.1f})"


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if math.isfinite(share) else "–"
