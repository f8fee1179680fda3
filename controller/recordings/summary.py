"""Summary and quality verdict of a recording as text, with small images of the sensor."""

import textwrap
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.errors import count
from controller.recordings.quality import labels
from controller.recordings.quality.check import Level, Report
from controller.recordings.quality.labels import SourceLabels
from controller.recordings.quality.taxels import Map, Response, respond
from controller.recordings.recording import PICOFARAD, Recording

_SHADES: Final = " ░▒▓█"  # from nothing to the greatest value
_WIDTH: Final = 80  # columns of a terminal
_APART: Final = "   "  # between two images
_LONGEST: Final = 24  # letters of a name


def facts(path: Path, recording: Recording) -> dict[str, Any]:
    """Return the summary as plain data."""
    response = respond(recording)
    truth = recording.truth
    return {
        "path": str(path),
        **asdict(recording.origin),
        "frames": len(recording.t),
        "seconds": float(recording.t[-1] - recording.t[0]),
        "cadence": asdict(labels.measure(recording)),
        "said": [asdict(source) for source in labels.summarise(recording, response)],
        "excluded": int(recording.excluded.sum()),
        "commands": dict(Counter(command.command for command in recording.commands)),
        "marks": dict(Counter(mark.kind for mark in recording.marks)),
        "touches": None if truth is None else dict(Counter(event.kind for event in truth.events)),
    }


def lines(path: Path, recording: Recording) -> list[str]:
    """Return the summary as lines for a terminal."""
    origin, response = recording.origin, respond(recording)
    rhythm, sources = labels.measure(recording), labels.summarise(recording, response)
    excluded = int(recording.excluded.sum())
    rows = {
        "who": [*_named(user=origin.user, session=origin.session, protocol=origin.protocol),
                origin.started],
        "sensor": [origin.hardware, origin.device_id,
                   f"{origin.preset} preset" * bool(origin.preset)],
        "": [f"{origin.rows} x {origin.columns} taxels, {origin.pitch_mm:g} mm apart, "
             f"in {origin.unit}"],
        "length": [f"{duration(float(recording.t[-1] - recording.t[0]))}, "
                   f"{count(len(recording.t), 'frame')} at {rhythm.measured_hz:.2f} Hz "
                   f"({origin.rate_hz:g} intended), {rhythm.missing} missing"],
        "excluded": [count(excluded, "frame") * bool(excluded)],
    }  # fmt: skip
    counts = {
        "commands": Counter(command.command for command in recording.commands),
        "marks": Counter(mark.kind for mark in recording.marks),
    }
    end = {"software": [origin.software, *_named(bundle=origin.bundle[:8])], "id": [origin.id]}
    return [
        str(path),
        *_lines(rows),
        *(line for source in sources for line in _labels(source)),
        *(line for name, counted in counts.items()
          for line in _wrapped(name, [f"{key} {number}" for key, number in counted.items()])),
        *_lines(end),
        *_pictures(recording, response, sources),
    ]  # fmt: skip


def verdict(report: Report) -> list[str]:
    """Return a quality report as lines."""
    text = [f"{report.level.name.lower():8}  {report.path}"]
    if (rhythm := report.cadence) is not None:
        stretches = f", in {rhythm.stretches} stretches" * (rhythm.stretches > 1)
        text += [
            f"  cadence   {duration(report.seconds)} at {rhythm.measured_hz:.2f} Hz "
            f"({rhythm.intended_hz:g} intended), {rhythm.missing} of "
            f"{rhythm.missing + rhythm.frames} frames missing{stretches}"
        ]
    for source in report.said:
        text += _labels(source)
    for finding in sorted(report.findings, key=lambda each: -each.level):
        word = "note" if finding.level is Level.GOOD else finding.level.name.lower()
        text.append(f"  {word + ':':9} {finding.text}")
    return text


def duration(seconds: float) -> str:
    """Return seconds in the usual notation: 12.3 s, 5:02 min, 1:05:02 h."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d} h" if hours else f"{minutes}:{rest:02d} min"


def _named(**values: str) -> list[str]:
    """Return each value that is not empty, after its name."""
    return [f"{name} {value}" for name, value in values.items() if value]


def _lines(rows: dict[str, list[str]]) -> list[str]:
    """Return a line for each row that is not empty."""
    texts = {name: ", ".join(part for part in parts if part) for name, parts in rows.items()}
    return [f"  {name:9} {text}" for name, text in texts.items() if text]


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


def _pictures(
    recording: Recording, response: Response, sources: tuple[SourceLabels, ...]
) -> list[str]:
    """Return the mean image of each class, by the first source that names any."""
    shown = response.touched & ~recording.excluded
    source = next((one.labeller for one in sources if any(one.events.values())), "")
    classes = {"touched": shown}
    if source:
        column = getattr(recording, source)
        names = recording.origin.labels[1:]
        classes = {name: shown & (column == index) for index, name in enumerate(names, 1)}
    blocks = [
        _block(name, np.abs(response.change[frames].mean(axis=0)), recording.origin.unit)
        for name, frames in classes.items()
        if frames.any()
    ]
    width = max((len(line) for block in blocks for line in block), default=_WIDTH)
    abreast = (_WIDTH - 2 + len(_APART)) // (width + len(_APART))
    if not abreast:  # no image, or too wide
        return []
    by = f" by {source}" if source else ""
    text = ["", f"  mean change of each taxel under touch{by}, and the greatest:"]
    for first in range(0, len(blocks), abreast):
        rows = zip(*blocks[first : first + abreast], strict=True)
        text += ["  " + _APART.join(f"{cell:{width}}" for cell in row).rstrip() for row in rows]
    return text


def _block(name: str, change: Map, unit: str) -> list[str]:
    """Return one image: its name, a line for each row, two characters a taxel, and a caption."""
    top = float(change.max())
    below = f"{100 * top:.0f} %" if unit == PICOFARAD else f"{top:.3g} {unit}"
    steps = np.rint(change / (top or 1.0) * (len(_SHADES) - 1)).astype(int)
    picture = ["|" + "".join(2 * _SHADES[step] for step in row) + "|" for row in steps.tolist()]
    return [name[:_LONGEST], *picture, below]
