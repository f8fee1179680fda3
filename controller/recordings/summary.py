"""Summary and quality verdict of a recording as text."""

import textwrap
from collections import Counter
from typing import Final

from controller.recordings.quality.check import Level, Report
from controller.recordings.quality.labels import SourceLabels
from controller.recordings.recording import Recording
from controller.shared.errors import count

_WIDTH: Final = 80  # columns of a terminal


def lines(report: Report, recording: Recording | None = None) -> list[str]:
    """Return a verdict as lines for a terminal; with the recording also what is in it."""
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
    return text


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
