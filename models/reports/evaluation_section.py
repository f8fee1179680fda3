"""The sections of a report about an evaluation and a tuning."""

import math
from collections.abc import Callable, Collection, Sequence
from html import escape
from typing import Final

from models import text
from models.reports import charts, maps
from models.results.evaluation import Broken, Evaluation, Result, Row, Tuning

DEAD: Final = "dead:"  # a fault of one taxel: "dead:ROW,COLUMN"
_Cells = tuple[str, Callable[[Result], str]]


def cards(found: Evaluation) -> list[str]:
    """Return the headline figures of the first set of sessions."""
    if not found.results:
        return []
    first = found.results[0]
    on = f"{escape(first.name)}, {text.several(first.events, 'event')}"
    shown = [
        text.answered(first.labels, first.answered, f"in {first.name}"),
        text.card(text.number(first.f1.value, 4), "F1 of events in play", on),
        text.card(
            text.number(first.false_alarms_per_min.value),
            "false alarms per idle minute",
            f"{text.duration(60 * first.idle_minutes)} idle",
        ),
        text.card(
            text.seconds(first.latency_s.value),
            "from onset to answer",
            f"95 % within {text.seconds(first.latency_p95_s)}",
        ),
    ]
    if first.location is not None:
        shown.append(
            text.card(text.number(first.location.error.value), "grid units off", "per press")
        )
    return shown


def tuned_cards(found: Tuning) -> list[str]:
    """Return the headline figures of the thresholds that were chosen."""
    point, on = found.chosen, "on the streams it was chosen on"
    return [
        text.card(text.percent(point.recall), "of events answered rightly", on),
        text.card(text.number(point.false_alarms_per_min), "false alarms per idle minute", on),
        text.card(text.seconds(point.latency_s), "from onset to answer", "median"),
    ]


_ROWS: Final[tuple[_Cells, ...]] = (
    ("sessions, users", lambda r: f"{r.sessions}, {r.users}"),
    ("events", lambda r: text.count(r.events)),
    ("idle time", lambda r: text.duration(60 * r.idle_minutes)),
    ("F1", lambda r: text.sure(r.f1, 4)),
    ("precision", lambda r: text.sure_share(r.precision)),
    ("recall", lambda r: text.sure_share(r.recall)),
    ("missed", lambda r: text.sure_share(r.missed)),
    ("answered with another name", lambda r: text.sure_share(r.wrong)),
    ("answered twice", lambda r: text.sure_share(r.duplicates)),
    ("false alarms per idle minute", lambda r: text.sure(r.false_alarms_per_min)),
    ("latency from onset, median", lambda r: f"{text.sure(r.latency_s, 2)} s"),
    ("– 95 % within", lambda r: text.seconds(r.latency_p95_s)),
    ("latency from first contact, median", lambda r: text.seconds(r.contact_latency_s.value)),
    ("– 95 % within", lambda r: text.seconds(r.contact_latency_p95_s)),
    ("whole gestures named rightly", lambda r: text.sure_share(r.event_accuracy)),
    ("– interval over users", lambda r: text.sure_share(r.new_user_accuracy)),
    ("frames named rightly", lambda r: text.sure_share(r.frame_accuracy)),
    ("frames inside twists", lambda r: text.sure_share(r.turn_accuracy)),
    ("calibration error", lambda r: text.percent(r.calibration.error)),
)
_PLACES: Final[tuple[_Cells, ...]] = (
    ("error of a press, grid units", lambda r: text.sure(r.location.error) if r.location else ""),
    ("– on the taxels", lambda r: text.sure(r.location.on_site) if r.location else ""),
    ("– between them", lambda r: text.sure(r.location.off_site) if r.location else ""),
    (
        "– half, and 95 % of them within",
        lambda r: (
            f"{text.number(r.location.half_within)}, {text.number(r.location.most_within)}"
            if r.location
            else ""
        ),
    ),
    (
        "– deviation given, median",
        lambda r: text.number(r.location.sigma) if r.location else "",
    ),
    (
        "– errors within one of them (68 % is right), and two (95 %)",
        lambda r: (
            f"{text.percent(r.location.within_one)}, {text.percent(r.location.within_two)}"
            if r.location
            else ""
        ),
    ),
)


def play(found: Evaluation, learned: Collection[str]) -> str:
    """Return how the bundle does in play, by the event metric.

    Args:
        found: What was found out.
        learned: Names of the sessions that it learned from.
    """
    if not found.results:
        return ""
    which = f"{escape(found.bundle)} ({found.hash[:12]}…)" if found.hash else escape(found.bundle)
    said = text.paragraph(
        f"Judged: {which}, on streams as in play, brushes and resting hands among the gestures, "
        "answered as the device answers. An event is answered rightly, wrongly, twice, or not at "
        "all; an answer to nothing is a false alarm. The small figures are 95 % intervals over "
        "whole sessions."
    )
    rows = _ROWS + (_PLACES if any(result.location for result in found.results) else ())
    head = ("", *(escape(result.name) for result in found.results))
    table = text.table(
        head, [(name, *(cell(result) for result in found.results)) for name, cell in rows]
    )
    parts = [part for result in found.results for part in _details(result)]
    return text.section("In play", said, _flattered(found, learned), table, *parts)


def _flattered(found: Evaluation, learned: Collection[str]) -> str:
    """Return a warning where a bundle was judged on what it learned from."""
    judged = [row.name for result in found.results for row in result.by_session]
    known = sum(name in learned for name in judged)
    if not known:
        return ""
    return text.warning(
        f"{known} of the {text.several(len(judged), 'session')} judged here "
        f"{'is' if known == 1 else 'are'} called like those that it learned from. If they are the "
        "same, these figures flatter: judge it on others."
    )


def _details(result: Result) -> list[str]:
    """Return what is known of one set of sessions beside its figures."""
    names = ("nothing", *result.labels[1:])
    classes = text.table(
        ("gesture", "events", "recall", "precision", "named by its mean probability"),
        [
            (
                text.label(row.label),
                text.count(row.events),
                text.sure_share(row.recall),
                text.sure_share(row.precision),
                text.sure_share(row.named),
            )
            for row in result.classes
        ],
    )
    parts = [
        f"<h3>{escape(result.name)}: what was answered</h3>",
        text.matrix(names, result.answered, ("nothing happened", "no answer")),
        f"<h3>{escape(result.name)}: gesture by gesture</h3>",
        classes,
    ]
    people = (_rows("user", result.by_user), _rows("session", result.by_session))
    parts += [
        text.folded(f"{result.name}: {title}", table)
        for title, table in zip(("user by user", "session by session"), people, strict=True)
        if table
    ]
    if result.calibration.bins:
        drawn = charts.reliability(result.calibration.bins)
        parts.append(text.folded(f"{result.name}: how much a probability means", drawn))
    return parts


def _rows(what: str, rows: Sequence[Row]) -> str:
    """Return a table of sessions or users, the worst first."""
    if not rows:
        return ""
    head = (what, "events", "F1", "named", "frames", "false alarms", "latency", "place error")
    return text.table(
        head,
        [
            (
                escape(row.name),
                text.count(row.events),
                text.number(row.f1, 4),
                text.percent(row.event_accuracy),
                text.percent(row.frame_accuracy),
                text.number(row.false_alarms_per_min),
                text.seconds(row.latency_s),
                text.number(row.location_error),
            )
            for row in sorted(rows, key=lambda row: row.f1 if math.isfinite(row.f1) else 2.0)
        ],
    )


def places(found: Evaluation, rows: int, columns: int) -> str:
    """Return where presses were thought to be, for each set of sessions."""
    parts = [
        f"<h3>{escape(result.name)}</h3>"
        + text.place_maps(
            maps.errors(result.location.touches, rows, columns),
            maps.error_map(result.location.touches, rows, columns),
        )
        for result in found.results
        if result.location is not None and result.location.touches
    ]
    return text.section("Where a touch is", *parts)


def broken(found: Evaluation, rows: int, columns: int) -> str:
    """Return what each fault costs."""
    if not found.broken:
        return ""
    whole = {result.name: result.event_accuracy.value for result in found.results}
    parts = []
    for name in dict.fromkeys(one.on for one in found.broken):
        here = [one for one in found.broken if one.on == name]
        parts.append(f"<h3>{escape(name)}</h3>")
        dead = {place: one.event_accuracy.value for one in here if (place := taxel(one))}
        if dead:
            worst = min(dead, key=lambda place: dead[place])
            usual = whole.get(name, math.nan)
            cost = (
                f"The worst is row {worst[0]}, column {worst[1]}: {text.percent(dead[worst])}; "
                f"unbroken, {text.percent(usual)}."
                if not dead[worst] >= usual
                else "None of them costs a gesture."
            )
            caption = f"Gestures named rightly, per cent, while this taxel is dead. {cost}"
            parts.append(text.figure(maps.taxels(dead, usual, rows, columns), caption))
        others = sorted(
            (one for one in here if not taxel(one)), key=lambda one: one.event_accuracy.value
        )
        if others:
            head = ("fault", "", "named rightly", "F1", "false alarms", "place error")
            listed = [
                (
                    f"<code>{escape(one.fault)}</code>",
                    escape(one.meaning),
                    text.sure_share(one.event_accuracy),
                    text.number(one.f1.value, 4),
                    text.number(one.false_alarms_per_min.value),
                    text.number(one.location_error),
                )
                for one in others
            ]
            parts.append(text.table(head, listed, text=2))
    said = text.paragraph("The same bundle, untouched, while something is broken; worst first.")
    return text.section("When something breaks", said, *parts)


def taxel(one: Broken) -> tuple[int, int] | None:
    """Return the row and column of a dead taxel; None: something else is broken."""
    if not one.fault.startswith(DEAD):
        return None
    row, _, column = one.fault.removeprefix(DEAD).partition("=")[0].partition(",")
    return int(row), int(column)


def thresholds(found: Tuning) -> str:
    """Return the front of thresholds, and the choice."""
    said = text.paragraph(
        f"{text.count(found.tried)} choices of the debouncer’s thresholds were replayed on "
        f"{text.several(found.sessions, 'stream')} with {text.several(found.events, 'event')} "
        f"and {found.idle_minutes:.0f} idle minutes. {text.count(len(found.front))} of them are "
        "on the front: no other is better in all of recall, false alarms, and latency.",
        f"Chosen: {escape(found.goal)}." if found.goal else "",
    )
    rows = [
        (
            name,
            *(f"{value:g}" for value in (point.smoothing, point.on, point.off)),
            text.percent(point.recall),
            text.number(point.f1, 4),
            text.number(point.false_alarms_per_min),
            text.seconds(point.latency_s),
        )
        for name, point in (("before", found.before), ("chosen", found.chosen))
    ]
    head = ("", "smoothing", "on", "off", "recall", "F1", "false alarms / min", "latency")
    drawn = text.beside(text.figure(maps.missed(found)), text.figure(maps.alarms(found)))
    caution = text.paragraph(
        "<small>A choice flatters the streams that it was made on: judge it on others.</small>"
    )
    return text.section("When a gesture counts", said, text.table(head, rows), drawn, caution)


def made(found: Evaluation) -> str:
    """Return how it was judged."""
    lines = [*(f"{name}: {value}" for name, value in found.card.items()), *found.notes]
    return text.section(
        "How it was judged",
        text.paragraph(f"<code>{escape(found.command)}</code>") if found.command else "",
        text.listed(lines) if lines else "",
    )
