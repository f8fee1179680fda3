"""Summary of a recording: a few lines and a small picture."""

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.console import count
from controller.recordings import text_image
from controller.recordings.quality import labels, timing
from controller.recordings.quality.labels import SourceLabels
from controller.recordings.quality.response import Response, respond
from controller.recordings.recording import PICOFARAD, Recording


def facts(path: Path, recording: Recording) -> dict[str, Any]:
    """Return what a recording is, as plain data."""
    response = respond(recording)
    truth = recording.truth
    return {
        "path": str(path),
        **asdict(recording.origin),
        "frames": len(recording.t),
        "seconds": float(recording.t[-1] - recording.t[0]),
        "cadence": asdict(timing.measure(recording)),
        "said": [asdict(one) for one in labels.said(recording, response)],
        "excluded": int(recording.excluded.sum()),
        "commands": dict(Counter(command.command for command in recording.commands)),
        "marks": dict(Counter(mark.kind for mark in recording.marks)),
        "touches": None if truth is None else dict(Counter(event.kind for event in truth.events)),
    }


def lines(path: Path, recording: Recording, shades: str = text_image.BLOCKS) -> list[str]:
    """Return what a recording is, for people: not wider than a terminal if its names are short."""
    origin, response = recording.origin, respond(recording)
    rhythm = timing.measure(recording)
    seconds = float(recording.t[-1] - recording.t[0])
    who = [f"user {origin.user}" * bool(origin.user),
           f"session {origin.session}" * bool(origin.session),
           f"protocol {origin.protocol}" * bool(origin.protocol),
           origin.started]  # fmt: skip
    sensor = [origin.hardware, origin.device_id, f"{origin.preset} preset" * bool(origin.preset)]
    excluded = int(recording.excluded.sum())
    counts = [
        ("commands", Counter(command.command for command in recording.commands)),
        ("marks", Counter(mark.kind for mark in recording.marks)),
    ]
    return [
        str(path),
        *_line("who", who),
        *_line("sensor", sensor),
        *_line("", [f"{origin.rows} x {origin.columns} taxels, {origin.pitch_mm:g} mm apart, "
                    f"in {origin.unit}"]),
        *_line("length", [f"{duration(seconds)}, {count(len(recording.t), 'frame')} at "
                          f"{rhythm.measured_hz:.2f} Hz ({origin.rate_hz:g} intended), "
                          f"{rhythm.missing} missing"]),
        *_line("excluded", [count(excluded, "frame") * bool(excluded)]),
        *(line for one in labels.said(recording, response) for line in said(one)),
        *(line for name, counted in counts for line in _wrapped(name, _counted(counted))),
        *_line("software", [origin.software,
                            f"bundle {origin.bundle[:8]}" * bool(origin.bundle)]),
        *_line("id", [origin.id]),
        *_pictures(recording, response, shades),
    ]  # fmt: skip


def said(one: SourceLabels) -> list[str]:
    """Return what one labeller said, in words."""
    times = [
        f"{label} {count(one.events[label], 'time')} ({seconds:.1f} s)" if label in one.events
        else f"{label} {seconds:.1f} s"
        for label, seconds in one.seconds.items()
        if seconds
    ]  # fmt: skip
    if one.unknown:
        times.append(f"nothing for {100 * one.unknown:.0f} % of the frames")
    return _wrapped(one.labeller, times)


def duration(seconds: float) -> str:
    """Return seconds as somebody would say them: 12.3 s, 5:02 min, 1:05:02 h."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d} h" if hours else f"{minutes}:{rest:02d} min"


def _line(name: str, parts: list[str]) -> list[str]:
    """Return one line, or none if there is nothing to say."""
    text = ", ".join(part for part in parts if part)
    return [f"  {name:9} {text}"] if text else []


def _wrapped(name: str, parts: list[str]) -> list[str]:
    """Return as many lines as the parts need; the name stands before the first."""
    rows: list[str] = []
    for part in parts:
        if rows and len(rows[-1]) + len(part) + 16 <= text_image.WIDTH:
            rows[-1] += f", {part}"
        else:
            rows.append(part)
    ends = ["," * (i < len(rows) - 1) for i in range(len(rows))]
    return [
        f"  {name * (i == 0):9} {row}{end}"
        for i, (row, end) in enumerate(zip(rows, ends, strict=True))
    ]


def _counted(counter: Counter[str]) -> list[str]:
    return [f"{name} {number}" for name, number in counter.items()]


def _pictures(recording: Recording, response: Response, shades: str) -> list[str]:
    """Return the mean image of each class, by the first labeller that names any."""
    shown = response.touched & ~recording.excluded
    drawn, unit = [], recording.origin.unit
    heard = next(
        (one for one in labels.said(recording, response) if any(one.events.values())), None
    )
    if heard is not None:
        column = getattr(recording, heard.labeller)
        for index, label in enumerate(recording.origin.labels):
            frames = shown & (column == index)
            if index and frames.any():
                drawn.append(_captioned(label, response.change[frames].mean(axis=0), unit))
    elif shown.any():
        drawn.append(_captioned("touched", response.change[shown].mean(axis=0), unit))
    if not drawn:
        return []
    by = f" by {heard.labeller}" if heard else ""
    head = f"  mean change of each taxel under touch{by}, and the greatest:"
    return ["", head, *text_image.gallery(drawn, shades)]


def _captioned(name: str, change: NDArray[np.floating], unit: str) -> text_image.Picture:
    """Return the picture of a mean change, (rows, columns), with its greatest value below."""
    size = np.abs(change)
    top = float(size.max())
    return name, size, f"{100 * top:.0f} %" if unit == PICOFARAD else f"{top:.3g} {unit}"
