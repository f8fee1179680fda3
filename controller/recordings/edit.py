"""Trim and relabel recordings: into a new recording, which names its source."""

import secrets
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings import reader, writer
from controller.recordings.recording import (
    UNKNOWN,
    Mark,
    Recording,
    RecordingError,
    software,
)
from controller.shared import npz
from controller.shared.errors import count

NO_LABEL: Final = "unknown"  # the name of a missing label


def trim(recording: Recording, begin_s: float, end_s: float, source: str) -> Recording:
    """Return the frames in [begin_s, end_s), seconds; RecordingError if there are none."""
    kept = _within(recording, begin_s, end_s)
    first, end = int(kept.argmax()), int(len(kept) - kept[::-1].argmax())
    span = slice(first, end)
    columns = {name: getattr(recording, name)[span] for name in reader.COLUMNS}
    truth = recording.truth
    if truth is not None:
        events = tuple(e for e in truth.events if e.release_s >= begin_s and e.onset_s < end_s)
        truth = replace(truth, touch=truth.touch[span], contact=truth.contact[span], events=events)
    cut = replace(
        recording,
        frames=recording.frames[span],
        touch=recording.touch[span],
        marks=tuple(mark for mark in recording.marks if begin_s <= mark.t_s < end_s),
        commands=tuple(c for c in recording.commands if begin_s <= c.t_s < end_s),
        state=recording.state if first == 0 else {},
        truth=truth,
        **columns,
    )
    t = cut.t
    return _marked(cut, float(t[0]), "trim", f"to {t[0]:g} to {t[-1]:g} s", source)


def relabel(
    recording: Recording,
    begin_s: float,
    end_s: float,
    source: str,
    *,
    label: str | None = None,
    column: str = "label",
    excluded: bool | None = None,
) -> Recording:
    """Return a recording with the frames in [begin_s, end_s), seconds, relabelled.

    `label` is one of its labels or "unknown", `excluded` whether the frames are left out of
    training; None leaves either unchanged.

    Raises:
        RecordingError: There is no such label, or no such frame, or nothing is to be changed.
    """
    if label is None and excluded is None:
        raise RecordingError("nothing is to be changed; name a label, or exclude or include frames")
    within = _within(recording, begin_s, end_s)
    done: list[str] = []
    arrays: dict[str, Any] = {}
    if label is not None:
        labels = (*recording.origin.labels, NO_LABEL)
        if label not in labels:
            raise RecordingError(f"there is no label {label!r} in it, only {', '.join(labels)}")
        index = labels.index(label)
        index = index if index < len(labels) - 1 else UNKNOWN
        arrays[column] = np.where(within, index, getattr(recording, column)).astype(np.int16)
        done.append(f"{column} set to {label}")
    if excluded is not None:
        arrays["excluded"] = np.where(within, excluded, recording.excluded)
        done.append("excluded" if excluded else "included")
    t = recording.t[within]
    text = f"{count(int(within.sum()), 'frame')} of {t[0]:g} to {t[-1]:g} s {' and '.join(done)}"
    return _marked(replace(recording, **arrays), float(t[0]), "relabel", text, source)


def sealed(recording: Recording) -> bytes:
    """Return a recording as the bytes of its file; RecordingError if they cannot be read."""
    data = writer.pack(recording)
    try:
        reader.parse(npz.unpack(data, reader.MAX_BYTES))
    except ValueError as error:
        raise RecordingError(f"the result would be no recording: it {error}") from None
    return data


def _within(recording: Recording, begin_s: float, end_s: float) -> NDArray[np.bool_]:
    """Return whether each frame is in [begin_s, end_s), (n,); RecordingError if none is."""
    t = recording.t
    within = (t >= begin_s) & (t < end_s)
    if not within.any():
        raise RecordingError(
            f"there is no frame from {begin_s:g} to {end_s:g} s; it has frames from {t[0]:g} to "
            f"{t[-1]:g} s"
        )
    return np.asarray(within)


def _marked(recording: Recording, t_s: float, kind: str, text: str, source: str) -> Recording:
    """Return a recording with a new id and a mark that describes the change."""
    whole = f"{source} ({recording.origin.id})" if recording.origin.id else source
    when = datetime.now(UTC).isoformat(timespec="seconds")
    mark = Mark(t_s, kind, f"{text}; from {whole}, {when}, by orbtouch {software()}")
    marks = sorted((*recording.marks, mark), key=lambda each: each.t_s)
    origin = replace(recording.origin, id=secrets.token_hex(16))
    return replace(recording, origin=origin, marks=tuple(marks))
