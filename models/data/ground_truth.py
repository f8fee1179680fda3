"""Ground truth of a recording's frames: gestures, places and users, independent of any network."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from controller.bundles import vocabulary
from controller.recognition.event_metric import Event
from controller.recordings.recording import UNKNOWN, Recording
from models.data import label_repair
from models.data.examples import COLUMNS, Labels
from models.data.true_positions import places

Choice = Literal["auto", "true", "button", "key", "cue"]


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What is known of a recording's n frames, whatever a network says.

    Attributes:
        name: Of the recording.
        user: Who; "" unknown.
        t: End of each scan, seconds, (n,).
        label: Class of each frame, -1 unknown, (n,).
        events: True gestures, in order.
        contact_s: When something first touched for each of them, to a frame; NaN: nobody knows.
        place: Where a touch is, grid units, NaN elsewhere, (n, 2).
        excluded: Frames that do not count, (n,).
    """

    name: str
    user: str
    t: NDArray[np.float64]
    label: NDArray[np.int64]
    events: tuple[Event, ...]
    contact_s: tuple[float, ...]
    place: NDArray[np.float32]
    excluded: NDArray[np.bool_]


def know(recording: Recording, labels: Sequence[str], name: str, choice: Choice = "auto") -> Known:
    """Return what is known of a recording.

    Args:
        recording: With truth, or with what people said; their labels are moved to the touches.
        labels: The bundle's, "null" first.
        name: Of the recording.
        choice: Whose labels count; "auto": the truth, else button, keys, cues.

    Raises:
        ValueError: There are no labels, or one is of a gesture that the bundle does not know.
    """
    own = recording.origin.labels
    column = labels_of(recording, choice)
    used = set(np.unique(column[column != UNKNOWN]).tolist())
    odd = [own[i] for i in sorted(used) if own[i] not in labels]
    if odd:
        raise ValueError(
            f"{name} has the gesture {odd[0]!r}, the bundle {', '.join(labels[1:])}; "
            "choose another bundle"
        )
    number = np.array([labels.index(one) if one in labels else UNKNOWN for one in own])
    label = np.where(column == UNKNOWN, UNKNOWN, number[column])
    events = events_of(recording, choice)
    events = tuple(event for event in events if not _excluded(recording, event))
    user = f"{recording.origin.seed} {recording.origin.user}" if recording.origin.user else ""
    return Known(
        name,
        user,
        recording.t,
        label.astype(np.int64),
        events,
        _contacts(recording, events),
        places(recording, column, vocabulary.of(own)),
        recording.excluded,
    )


def labels_of(recording: Recording, choice: Choice = "auto") -> NDArray[np.int16]:
    """Return what happened in each frame, -1 unknown; people's labels are moved to the touches.

    Raises:
        ValueError: There are no labels.
    """
    listed: tuple[Labels, ...] = tuple(COLUMNS) if choice == "auto" else (choice,)
    for least in (1, 0):  # who named a gesture, else who said that there was none
        named = [n for n in listed if (getattr(recording, COLUMNS[n]) >= least).any()]
        if named:
            break
    else:
        whose = "" if choice == "auto" else f"{choice} "
        raise ValueError(f"a recording has no {whose}labels; label it first, or leave it out")
    return recording.label if named[0] == "true" else label_repair.repair(recording, named[0])[0]


def events_of(recording: Recording, choice: Choice = "auto") -> tuple[Event, ...]:
    """Return the gestures of a recording: the simulator's truth, else runs of labelled frames.

    A run goes on over frames that are unclear; it begins half a frame before its first frame.
    """
    own = recording.origin.labels
    if recording.truth is not None and choice in ("auto", "true"):
        return tuple(event for event in recording.truth.events if event.kind in own[1:])
    label = labels_of(recording, choice)
    clear = np.flatnonzero(label != UNKNOWN)
    edges = np.flatnonzero(np.diff(label[clear].astype(np.int64), prepend=0, append=0))
    half_s = 0.5 / recording.rate_hz
    events = []
    for first, end in itertools.pairwise(edges):
        if (kind := int(label[clear[first]])) > 0:
            begin_s, end_s = recording.t[clear[first]], recording.t[clear[end - 1]]
            events.append(Event(float(begin_s) - half_s, float(end_s) + half_s, own[kind]))
    return tuple(events)


def _contacts(recording: Recording, events: Sequence[Event]) -> tuple[float, ...]:
    """Return when the contact of each event began: in the middle of the frame before."""
    if recording.truth is None or not recording.truth.contact.shape[1]:
        return (np.nan,) * len(events)
    touched = np.asarray(np.isfinite(recording.truth.contact[:, :, 2]).any(axis=1))
    t, half_s = recording.t, 0.5 / recording.rate_hz
    begins = np.flatnonzero(touched & ~np.concatenate([[False], touched[:-1]]))
    found = []
    for event in events:
        frame = int(np.searchsorted(t, event.onset_s))
        before = begins[begins <= frame]
        known = len(before) > 0 and touched[min(frame, len(t) - 1)]
        found.append(min(float(t[before[-1]]) - half_s, event.onset_s) if known else np.nan)
    return tuple(found)


def _excluded(recording: Recording, event: Event) -> bool:
    inside = (recording.t >= event.onset_s) & (recording.t <= event.release_s)
    return bool(recording.excluded[inside].any())
