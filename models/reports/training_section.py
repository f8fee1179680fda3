"""The sections of a report about a training: what it was, and what it is worth."""

import math
from collections.abc import Sequence
from html import escape
from typing import Final

from models import text as words
from models.reports import charts
from models.results.training import ENOUGH, GestureResult, Honesty, SessionRow, Training

MANY: Final = 12  # sessions; more are folded away


def cards(found: Training) -> list[str]:
    """Return the headline figures."""
    shown = []
    if (gesture := found.gesture) is not None:
        shown += [
            words.answered(found.labels, gesture.answered, "in sessions it never saw")
            if any(map(any, gesture.answered[1:]))
            else words.card(words.percent(gesture.event_accuracy), "of gestures named rightly",
                            "in sessions it never saw"),
            words.card(words.percent(gesture.honesty.unseen), "of single windows named rightly",
                       "in the same sessions"),
        ]  # fmt: skip
    if (location := found.location) is not None:
        error, mm = location.honesty.unseen, location.honesty.unseen * found.pitch_mm
        below = f"{words.number(mm, 1)} mm, per axis, unseen"
        shown.append(words.card(words.number(error), "grid units off its place", below))
    return shown


def next_steps(found: Training, judged: Sequence[str] = ()) -> str:
    """Return the advice.

    Args:
        found: What was trained.
        judged: What an evaluation advises; it comes first.
    """
    own = () if judged and found.advice == (ENOUGH,) else found.advice
    lines = [*judged, *own]
    if not lines:
        return ""
    return words.section("What to do next", f'<div class="next">{words.listed(lines)}</div>')


def honesty(found: Training) -> str:
    """Return what the networks are worth beside what the paper's protocol would say."""
    parts = []
    if found.gesture is not None:
        parts.append(_honest_gestures(found.gesture))
    if found.location is not None:
        parts.append(_honest_places(found.location.honesty))
    intro = words.paragraph(
        "The paper states no split. The most it can have done is to test on windows drawn at "
        "random from the sessions that it learned from. Windows slide by one image, so each of "
        "those shares nearly all of its images with windows that were learned: the score says how "
        "well a network remembers. Both are shown here, always.",
    )
    held = [found.split, *([found.location.unseen] if found.location else [])]
    about = words.paragraph(*(f"What is unseen: {escape(what)}." for what in held if what))
    return words.section("The honest figure, and the paper’s", intro, words.beside(*parts), about)


def _honest_gestures(gesture: GestureResult) -> str:
    honest = gesture.honesty
    said = (
        f"On sessions that it never saw, CNN-3D names <b>{words.percent(honest.unseen)}</b> of the "
        f"windows rightly. By the paper’s protocol it would be {words.percent(honest.random)}: "
        f"{_too_good(100 * honest.gap, 'points')}"
    )
    binary = (
        f"Counted output by output (“binary accuracy”), as the paper may have, these are "
        f"{words.percent(honest.unseen_binary)} and {words.percent(honest.random_binary)}."
    )
    drawn = charts.gap(honest, share=True)
    below = (
        f"{words.count(honest.unseen_windows)} unseen windows, "
        f"{words.count(honest.random_windows)} at random; the bar is the 95 % interval over whole "
        "sessions."
    )
    return words.paragraph(said, binary) + words.figure(drawn, below)


def _honest_places(honest: Honesty) -> str:
    said = (
        f"On what it never saw, CNN-2D is <b>{words.number(honest.unseen)}</b> grid units "
        f"off, mean over the axes. By the paper’s protocol it would be "
        f"{words.number(honest.random)}: {_too_good(-honest.gap, 'grid units')}"
    )
    return words.paragraph(said) + words.figure(
        charts.gap(honest, share=False), "Error of each image; less is better."
    )


def _too_good(gap: float, unit: str) -> str:
    """Return in words how much too good the paper's protocol is; `gap` in a unit."""
    digits = 1 if unit == "points" else 3
    if not math.isfinite(gap):
        return "unknown here."
    if abs(gap) < (0.5 if unit == "points" else 0.01):
        return "no difference worth speaking of."
    if gap < 0:
        return (
            f"{-gap:.{digits}f} {unit} worse, so nothing was remembered that does not hold "
            "elsewhere; the sessions held out happen to be easier."
        )
    return f"{gap:.{digits}f} {unit} too good to be true."


def data(found: Training) -> str:
    """Return what was learned from."""
    minutes = sum(row.seconds for row in found.sessions)
    users = {row.user for row in found.sessions if row.user}
    held = sum(row.held_out for row in found.sessions)
    labellers = sorted({row.labeller for row in found.sessions})
    said = (
        f"{words.several(len(found.sessions), 'recording')}, {words.duration(minutes)}"
        + (f", {words.several(len(users), 'user')}" if users else "")
        + f": {found.rows}×{found.columns} taxels at {found.rate_hz:g} Hz in "
        f"{escape(found.unit)}, {escape(words.joined(labellers))} labels. "
        f"{words.several(held, 'was', 'were')} held out: nothing was learned from "
        f"{'it' if held == 1 else 'them'}."
    )
    bad = [row for row in found.sessions if row.verdict != "good"]
    verdict = (
        f"{words.several(len(bad), 'is', 'are')} not as {'it' if len(bad) == 1 else 'they'} "
        "should be; the table says why."
        if bad
        else "All passed the check."
    )
    head = ("session", "", "length", "check", "labels", *map(words.label, found.labels[1:]))
    listing = words.table(head, [_session(row, found) for row in found.sessions], text=2)
    if len(found.sessions) > MANY:
        summary = f"all {len(found.sessions)} recordings"
        shown = words.table(head, [_session(row, found) for row in bad], text=2) if bad else ""
        listing = shown + words.folded(summary, listing)
    return words.section("What it learned from", words.paragraph(said, verdict), listing)


def _session(row: SessionRow, found: Training) -> tuple[str, ...]:
    name = escape(row.path.rpartition("/")[2])
    chip = f'<span class="chip {row.verdict}">{escape(row.verdict)}</span>'
    why = "".join(f"<br><small>{escape(text)}</small>" for text in row.findings)
    counts = (words.count(row.examples.get(label, 0)) for label in found.labels[1:])
    return (
        name + (why if row.verdict != "good" else ""),
        "held out" if row.held_out else "",
        words.duration(row.seconds),
        chip,
        escape(row.labeller),
        *counts,
    )


def progress(found: Training) -> str:
    """Return how the trainings went."""
    parts = []
    for name, result, share in (
        ("CNN-3D: what the hand does", found.gesture, True),
        ("CNN-2D: where a touch is", found.location, False),
    ):
        if result is None or not result.epochs:
            continue
        parts.append(f"<h3>{name}</h3>")
        stopped = escape(result.stopped) + ". " if result.stopped else ""
        kept = f"Kept is epoch {result.best} of {len(result.epochs)}. "
        parts.append(
            words.paragraph(
                kept + stopped.capitalize() + f"It has {words.count(result.weights)} weights."
            )
        )
        drawn = charts.curves(result.epochs, result.best, share=share)
        loss = charts.losses(result.epochs, result.best)
        parts.append(words.beside(words.figure(drawn), words.figure(loss)))
    said = words.paragraph(
        '<span class="key train">Learned</span>: the examples themselves, varied as they are '
        'shown. <span class="key unseen">Unseen</span>: sessions held out. '
        '<span class="key random">At random</span>: the paper’s protocol. Where the blue line '
        "falls away from the dashed one, a network begins to remember instead of to learn."
    )
    return words.section("How training went", said, *parts) if parts else ""


def made(found: Training) -> str:
    """Return how it was made."""
    lines = [
        f"recipe {found.recipe}",
        *found.how,
        *found.symmetries,
        *(f"{name}: {value:g}" for name, value in found.debounce.items()),
        *found.notes,
    ]
    return words.section(
        "How it was made",
        words.paragraph(f"<code>{escape(found.command)}</code>") if found.command else "",
        words.listed(lines),
    )
