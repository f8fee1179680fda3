"""The card of an evaluation: how well a bundle does on sessions that it never saw, as Markdown."""

import math
from collections.abc import Sequence

from models.results import missed_gestures
from models.results.evaluation import Broken, Evaluation, Result, Row
from models.results.figure import Figure


def text(found: Evaluation) -> str:
    """Return the card."""
    debounce = ", ".join(f"{name} {value:g}" for name, value in found.debounce.items())
    lines = [
        f"# {found.bundle}",
        "",
        f"Labels {', '.join(found.labels)}. Debouncer: {debounce}. SHA-256 `{found.hash[:16]}…`",
        "",
        "| made | |",
        "|---|---|",
        *(f"| {key.replace('_', ' ')} | {value} |" for key, value in found.card.items()),
        *(f"\n{note}" for note in found.notes),
        "",
        "| figure | " + " | ".join(result.name for result in found.results) + " |",
        "|---" * (1 + len(found.results)) + "|",
        *figures(found.results),
        *(f"\n{line}" for line in missed_gestures.of_all(found.results)),
    ]
    for result in found.results:
        lines += ["", f"## {result.name}", "", *_confusion(result)]
        if result.users > 1:
            lines += ["", *_rows("user", result.by_user)]
        if result.sessions > 1:
            lines += ["", *_rows("session", result.by_session)]
    if found.broken:
        lines += ["", "## While something is broken", "", *_broken(found.broken)]
    return "\n".join(lines)


def figures(results: Sequence[Result]) -> list[str]:
    """Return a table's rows: a figure each, a column for each set of sessions."""
    columns = [_column(result) for result in results]
    return [
        f"| {name} | " + " | ".join(column[name] for column in columns) + " |"
        for name in columns[0]
    ]


def _column(r: Result) -> dict[str, str]:
    """Return every figure of a set, for people, by its name."""
    nowhere = Figure(math.nan, math.nan, math.nan)
    where = r.location
    return {
        "sessions, users": f"{r.sessions}, {r.users}",
        "events": str(r.events),
        "idle minutes": f"{r.idle_minutes:.0f}",
        "stream F1": _share(r.f1),
        "answered rightly": _share(r.recall),
        "right among all answers": _share(r.precision),
        "without an answer": _share(r.missed),
        "answered wrongly": _share(r.wrong),
        "answered twice": _share(r.duplicates),
        "false alarms per idle minute": _number(r.false_alarms_per_min),
        "latency from onset, p50 / p95": f"{r.latency_s.value:.2f} / {r.latency_p95_s:.2f} s",
        "latency from first contact, p50 / p95": (
            f"{r.contact_latency_s.value:.2f} / {r.contact_latency_p95_s:.2f} s"
        ),
        "event accuracy": _share(r.event_accuracy),
        "event accuracy, by user": _share(r.new_user_accuracy),
        "frame accuracy": _share(r.frame_accuracy),
        "frames inside twists": _share(r.turn_accuracy),
        "calibration error": f"{r.calibration.error:.4f}",
        "location error per press, grid units": _number(where.error if where else nowhere),
        "… on the sites": _number(where.on_site if where else nowhere),
        "… off the sites": _number(where.off_site if where else nowhere),
        "half, and 95 % of presses within": (
            f"{where.half_within:.3f}, {where.most_within:.3f}" if where else "–"
        ),
        "deviation given, median": _plain(where.sigma if where else math.nan, 3),
        "errors within one, and two deviations (68, 95 %)": (
            f"{where.within_one:.1%}, {where.within_two:.1%}"
            if where and math.isfinite(where.sigma)
            else "–"
        ),
    }


def _confusion(result: Result) -> list[str]:
    """Return what was answered to each gesture, with what is missed and what is false."""
    names = result.labels[1:]
    head = "| true \\ answered | " + " | ".join(names)
    lines = [head + " | nothing | right | recall | precision |", "|---" * (len(names) + 5) + "|"]
    for number, one in enumerate(result.classes, 1):
        counts = result.answered[number]
        cells = " | ".join(str(n) for n in (*counts[1:], counts[0]))
        lines.append(
            f"| **{one.label}** | {cells} | {_share(one.named)} | {_share(one.recall)} | "
            f"{_share(one.precision)} |"
        )
    false = " | ".join(str(n) for n in result.answered[0][1:])
    lines.append(f"| **nothing** | {false} | | | | |")
    return [*lines, "", "“Right” is the share of events that the mean probability names rightly."]


def _rows(what: str, rows: Sequence[Row]) -> list[str]:
    lines = [
        f"| {what} | events | F1 | event accuracy | frame accuracy | false alarms/min | "
        "latency s | location |",
        "|---" * 8 + "|",
    ]
    lines += [
        f"| {r.name} | {r.events} | {_plain(r.f1)} | {_plain(r.event_accuracy)} | "
        f"{_plain(r.frame_accuracy)} | {_plain(r.false_alarms_per_min)} | "
        f"{_plain(r.latency_s, 2)} | {_plain(r.location_error)} |"
        for r in rows
    ]
    return lines


def _broken(rows: Sequence[Broken]) -> list[str]:
    lines = [
        "| on | fault | meaning | events | event accuracy | F1 | false alarms/min | location |",
        "|---" * 8 + "|",
    ]
    lines += [
        f"| {r.on} | {r.fault} | {r.meaning} | {r.events} | {_share(r.event_accuracy)} | "
        f"{_share(r.f1)} | {_number(r.false_alarms_per_min)} | {_plain(r.location_error)} |"
        for r in rows
    ]
    return lines


def _share(figure: Figure) -> str:
    if math.isnan(figure.value):
        return "–"
    if math.isnan(figure.low):
        return f"{figure.value:.2%}"
    return f"{figure.value:.2%} ({100 * figure.low:.2f}–{100 * figure.high:.2f})"


def _number(figure: Figure) -> str:
    if math.isnan(figure.value):
        return "–"
    if math.isnan(figure.low):
        return f"{figure.value:.3f}"
    return f"{figure.value:.3f} ({figure.low:.3f}–{figure.high:.3f})"


def _plain(value: float, digits: int = 3) -> str:
    return "–" if math.isnan(value) else f"{value:.{digits}f}"
