"""Numbers and texts as a report shows them."""

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import Final

from models.results import missed_gestures
from models.results.figure import Figure

NONE: Final = "–"  # a figure that could not be had
LABELS: Final = {"null": "nothing", "twist_cw": "twist ↻", "twist_ccw": "twist ↺"}


def label(name: str) -> str:
    """Return a class's name for people."""
    return escape(LABELS.get(name, name.replace("_", " ")))


def percent(share: float, digits: int = 1) -> str:
    """Return a share, such as "98.8 %"; more digits close to everything."""
    if not math.isfinite(share):
        return NONE
    if share in (0.0, 1.0):
        return f"{share:.0%}".replace("%", " %")
    if share > 0.99 or share < 0.01:
        digits = max(digits, 2)
    return f"{100 * share:.{digits}f} %"


def number(value: float, digits: int = 3) -> str:
    """Return a number with so many places after the point."""
    return f"{value:.{digits}f}" if math.isfinite(value) else NONE


def count(value: float) -> str:
    """Return a whole number, thousands apart."""
    return f"{value:,.0f}".replace(",", " ") if math.isfinite(value) else NONE


def seconds(value: float) -> str:
    """Return a short time."""
    return f"{value:.2f} s" if math.isfinite(value) else NONE


def duration(value: float) -> str:
    """Return a length of time: seconds below two minutes, minutes below two hours, else hours."""
    if not math.isfinite(value):
        return NONE
    if value < 120:
        return f"{value:.0f} s"
    return f"{value / 60:.0f} min" if value < 7200 else f"{value / 3600:.1f} h"


def late(value: float) -> str:
    """Return how long after something else, or before it, in milliseconds."""
    if not math.isfinite(value):
        return f"{NONE} after"
    return f"{abs(1000 * value):.0f} ms {'after' if value >= 0 else 'before'}"


def points(share: float) -> str:
    """Return a difference of shares in points of a hundred."""
    return f"{100 * share:.1f} points" if math.isfinite(share) else NONE


def sure_share(figure: Figure) -> str:
    """Return a share and its interval."""
    return f"{percent(figure.value)}{_interval(figure, 100.0, 2)}"


def sure(figure: Figure, digits: int = 3) -> str:
    """Return a number and its interval."""
    return f"{number(figure.value, digits)}{_interval(figure, 1.0, digits)}"


def _interval(figure: Figure, times: float, digits: int) -> str:
    if not (math.isfinite(figure.low) and math.isfinite(figure.high)):
        return ""
    low, high = (f"{times * bound:.{digits}f}" for bound in (figure.low, figure.high))
    return f' <span class="interval">{low}–{high}</span>'


def several(number_of: int, one: str, many: str = "") -> str:
    """Return how many, with the word for it."""
    return f"{count(number_of)} {one if number_of == 1 else many or one + 's'}"


def joined(names: Sequence[str]) -> str:
    """Return names in a row: "a, b and c"."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def paragraph(*sentences: str) -> str:
    """Return a paragraph of sentences that are HTML already."""
    return f"<p>{' '.join(sentence for sentence in sentences if sentence)}</p>"


def listed(lines: Iterable[str]) -> str:
    """Return a list of plain sentences."""
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], *, text: int = 1) -> str:
    """Return a table whose cells are HTML already.

    Args:
        head: Its columns.
        rows: Their cells.
        text: So many columns on the left hold words; the others hold numbers.
    """

    def line(cells: Sequence[str], kind: str) -> str:
        return "".join(
            f"<{kind}{'' if i < text else ' class=n'}>{cell}</{kind}>"
            for i, cell in enumerate(cells)
        )

    body = "".join(f"<tr>{line(row, 'td')}</tr>" for row in rows)
    return (
        f'<div class="wide"><table><thead><tr>{line(head, "th")}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def warning(sentence: str) -> str:
    """Return a sentence that nobody shall overlook."""
    return f'<div class="next doubt">{sentence}</div>'


def folded(summary: str, content: str) -> str:
    """Return what is shown only to who asks for it."""
    return f"<details><summary>{escape(summary)}</summary>{content}</details>"


def figure(drawn: str, caption: str = "") -> str:
    """Return a drawing and its sentence."""
    below = f"<figcaption>{caption}</figcaption>" if caption else ""
    return f"<figure>{drawn}{below}</figure>"


def section(title: str, *parts: str) -> str:
    """Return a section; nothing where nothing is in it."""
    inside = "".join(parts)
    return f"<section><h2>{escape(title)}</h2>{inside}</section>" if inside else ""


def card(value: str, meaning: str, below: str = "") -> str:
    """Return a headline figure."""
    small = f'<span class="below">{below}</span>' if below else ""
    return f'<div class="card"><b>{value}</b><span>{meaning}</span>{small}</div>'


def answered(labels: Sequence[str], table: missed_gestures.Table, on: str) -> str:
    """Return the headline figure of what is answered rightly, with each gesture that fails.

    Args:
        labels: "null" first.
        table: Events by what was answered.
        on: What it was measured on.
    """
    right, events = missed_gestures.right(table)
    worst = [
        missed_gestures.counts(labels, table, number) for number in missed_gestures.failing(table)
    ]
    below = "; ".join([f"{count(right)} of {count(events)} {on}", *worst])
    share = right / events if events else math.nan
    return card(percent(share), "of gestures answered rightly", escape(below))


def matrix(
    names: Sequence[str], counts: Sequence[Sequence[int]], first: tuple[str, str] = ("", "")
) -> str:
    """Return a confusion matrix: rows are what was done, columns what it was taken for.

    Args:
        names: Of the classes.
        counts: How often, (classes, classes).
        first: What the first row and the first column are called instead, where they are of
            nothing; "": as they are.
    """
    columns = [escape(first[1]) if first[1] else label(names[0]), *map(label, names[1:])]
    titles = [escape(first[0]) if first[0] else label(names[0]), *map(label, names[1:])]
    lines = []
    for i, (title, row) in enumerate(zip(titles, counts, strict=True)):
        total = 0 if first[0] and not i else sum(row)  # nothing has no shares
        cells = "".join(_cell(value, total, right=i == j) for j, value in enumerate(row))
        lines.append(f'<tr><th class="row">{title}</th>{cells}</tr>')
    head = "".join(f"<th>{column}</th>" for column in columns)
    return (
        f'<div class="wide"><table class="matrix"><thead><tr><th></th>{head}</tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def _cell(value: int, total: int, *, right: bool) -> str:
    """Return a cell: a share of `total` above the count, or the count alone where that is 0."""
    if not value:
        return "<td></td>"
    share = value / total if total else 0.0
    # What is wrong is rare, and shall be seen all the same.
    strength = 65 * share if right else 12 + 65 * share**0.5
    kind = "right" if right else "wrong"
    inside = f"{percent(share)}<small>{count(value)}</small>" if total else count(value)
    return f'<td class="{kind}" style="--v:{strength:.0f}%">{inside}</td>'


def beside(*parts: str, even: bool = True) -> str:
    """Return parts side by side, where there is room.

    Args:
        parts: What is shown.
        even: All are equally wide; else each is as wide as it needs.
    """
    inside = "".join(f"<div>{part}</div>" for part in parts)
    return f'<div class="side{"" if even else " own"}">{inside}</div>'


def place_maps(arrows: str, tiles: str) -> str:
    """Return the two maps of places side by side."""
    leads = "Each line leads from where a touch was (dot) to where it was thought to be."
    means = "Mean error of the touches around each taxel, grid units."
    return beside(figure(arrows, leads), figure(tiles, means))
