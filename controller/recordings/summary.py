"""Summary and quality verdict of a recording as text, with small images of the sensor."""

import textwrap
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from controller.recordings.quality.check import Level, Report
from controller.recordings.quality.labels import SourceLabels
from controller.recordings.quality.taxels import Map, Response
from controller.recordings.recording import PICOFARAD, Recording
from controller.shared.aliases import Frames, Mask
from controller.shared.blocks import blocks
from controller.shared.errors import count

_SHADES: Final = " ░▒▓█"  # from nothing to the greatest value
_WIDTH: Final = 80  # columns of a terminal
_APART: Final = "   "  # between two images
_LONGEST: Final = 24  # letters of a name


def facts(recording: Recording) -> dict[str, Any]:
    """Return what a recording says of itself, as plain data."""
    truth = recording.truth
    return {
        **asdict(recording.origin),
        "frames": len(recording.t),
        "excluded": int(recording.excluded.sum()),
        "commands": dict(Counter(command.command for command in recording.commands)),
        "marks": dict(Counter(mark.kind for mark in recording.marks)),
        "touches": None if truth is None else dict(Counter(event.kind for event in truth.events)),
    }


def lines(
    report: Report, recording: Recording | None = None, images: Sequence[str] = ()
) -> list[str]:
    """Return a verdict as lines for a terminal; with the recording also what is in it.

    `images` are the lines of `pictures`.
    """
    text = [f"{report.level.name.lower():8}  {report.path}"]
    text += [] if recording is None else _provenance(recording)
    if (rhythm := report.cadence) is not None:
        stretches = f", in {rhythm.stretches} stretches" * (rhythm.stretches > 1)
        text += [
            f"  cadence   {duration(report.seconds)} at {rhythm.measured_hz:.2f} Hz "
            f"({rhythm.intended_hz:g} intended), {rhythm.missing} of "
            f"{rhythm.missing + rhythm.frames} frames missing{stretches}"
        ]
    for source in report.said:
        text += _labels(source)
    text += [] if recording is None else _counts(recording)
    for finding in sorted(report.findings, key=lambda each: -each.level):
        word = "note" if finding.level is Level.GOOD else finding.level.name.lower()
        text.append(f"  {word + ':':9} {finding.text}")
    return [*text, *images]


def _provenance(recording: Recording) -> list[str]:
    """Return the lines on user, sensor and software."""
    origin = recording.origin
    named = {"user": origin.user, "session": origin.session, "protocol": origin.protocol}
    grid = f"{origin.rows} x {origin.columns} taxels, {origin.pitch_mm:g} mm apart"
    preset = f"{origin.preset} preset" if origin.preset else ""
    bundle = f"bundle {origin.bundle[:8]}" if origin.bundle else ""
    return [
        *_line("who", *(f"{word} {name}" for word, name in named.items() if name), origin.started),
        *_line("sensor", origin.hardware, origin.device_id, preset),
        *_line("", f"{grid}, in {origin.unit}"),
        *_line("software", origin.software, bundle),
        *_line("id", origin.id),
    ]


def _counts(recording: Recording) -> list[str]:
    """Return the lines on excluded frames, commands and marks."""
    excluded = int(recording.excluded.sum())
    counts = {
        "commands": Counter(command.command for command in recording.commands),
        "marks": Counter(mark.kind for mark in recording.marks),
    }
    return [
        *_line("excluded", count(excluded, "frame") if excluded else ""),
        *(
            line
            for name, counted in counts.items()
            for line in _wrapped(name, [f"{key} {number}" for key, number in counted.items()])
        ),
    ]


def duration(seconds: float) -> str:
    """Return seconds in the usual notation: 12.3 s, 5:02 min, 1:05:02 h."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d} h" if hours else f"{minutes}:{rest:02d} min"


def _line(name: str, *parts: str) -> list[str]:
    """Return a line of the parts that are not empty; none without any."""
    text = ", ".join(part for part in parts if part)
    return [f"  {name:9} {text}"] if text else []


def _labels(source: SourceLabels) -> list[str]:
    """Return the number and duration of each label, as lines."""
    times = [
        f"{label} {count(source.events[label], 'time')} ({seconds:.1f} s)"
        if label in source.events
        else f"{label} {seconds:.1f} s"
        for label, seconds in source.seconds.items()
        if seconds
    ]
    if source.unknown:
        times.append(f"nothing for {100 * source.unknown:.0f} % of the frames")
    return _wrapped(source.labeller, times)


def _wrapped(name: str, parts: list[str]) -> list[str]:
    """Return the parts as wrapped lines, with the name before the first."""
    text = ", ".join(part.replace(" ", "\xa0") for part in parts)  # no break within a part
    rows = textwrap.wrap(text, _WIDTH - 12, break_long_words=False, break_on_hyphens=False)
    return [f"  {name * (i == 0):9} {row}".replace("\xa0", " ") for i, row in enumerate(rows)]


# --- pictures -------------------------------------------------------------------------------------


def pictures(
    recording: Recording, sources: tuple[SourceLabels, ...], response: Response
) -> list[str]:
    """Return the mean image of each class, by the first source that names any, as lines."""
    shown = response.touched & ~recording.excluded
    source = next((one.labeller for one in sources if any(one.events.values())), "")
    classes = {"touched": shown}
    if source:
        column = getattr(recording, source)
        names = recording.origin.labels[1:]
        classes = {name: shown & (column == index) for index, name in enumerate(names, 1)}
    shades = [
        _block(name, np.abs(_mean(response.change, frames)), recording.origin.unit)
        for name, frames in classes.items()
        if frames.any()
    ]
    width = max((len(line) for block in shades for line in block), default=_WIDTH)
    abreast = (_WIDTH - 2 + len(_APART)) // (width + len(_APART))
    if not abreast:  # no image, or too wide
        return []
    by = f" by {source}" if source else ""
    text = ["", f"  mean change of each taxel under touch{by}, and the greatest:"]
    for first in range(0, len(shades), abreast):
        rows = zip(*shades[first : first + abreast], strict=True)
        text += ["  " + _APART.join(f"{cell:{width}}" for cell in row).rstrip() for row in rows]
    return text


def _mean(change: Frames, used: Mask) -> Map:
    """Return the mean of some changes, (rows, columns); `used` is (n,)."""
    total = sum(change[part][used[part]].sum(axis=0, dtype=np.float64) for part in blocks(change))
    return np.asarray(total / used.sum())


def _block(name: str, change: Map, unit: str) -> list[str]:
    """Return one image: its name, a line for each row, two characters a taxel, and a caption."""
    top = float(change.max())
    below = f"{100 * top:.0f} %" if unit == PICOFARAD else f"{top:.3g} {unit}"
    steps = np.rint(change / (top or 1.0) * (len(_SHADES) - 1)).astype(int)
    picture = ["|" + "".join(2 * _SHADES[step] for step in row) + "|" for row in steps.tolist()]
    return [name[:_LONGEST], *picture, below]
