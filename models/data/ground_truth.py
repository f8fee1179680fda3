"""Ground truth of a recording's frames: gestures, places and users, independent of any network."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import vocabulary as vocabularies
from controller.bundles.vocabulary import Vocabulary
from controller.recordings.recording import UNKNOWN, Recording, mean_rate
from controller.shared.event_metric import Event
from models.data import label_repair
from models.data.examples import SOURCES, Choice, Labels, labellers, renumbered

_PLACE: Final = re.compile(r"go (\S+) at (-?[0-9.]+),(-?[0-9.]+)")  # a cue's mark


@dataclass(frozen=True, slots=True, eq=False)
class GroundTruth:
    """Ground truth of a recording's n frames."""

    name: str  # of the recording
    user: str  # identity of the user; "" unknown
    t: NDArray[np.float64]  # end of each scan, seconds, (n,)
    label: NDArray[np.int64]  # class of each frame, -1 unknown, (n,)
    events: tuple[Event, ...]  # true gestures, in order
    # when something first touched for each of them, to a frame; NaN: unknown
    contact_s: tuple[float, ...]
    place: NDArray[np.float32]  # position of the touch, grid units, NaN elsewhere, (n, 2)
    excluded: NDArray[np.bool_]  # frames that do not count, (n,)

    @property
    def rate_hz(self) -> float:
        """Frames per second, as they came."""
        return mean_rate(np.diff(self.t)) or 10.0

    @classmethod
    def of(
        cls, recording: Recording, labels: Sequence[str], name: str, choice: Choice = "auto"
    ) -> "GroundTruth":
        """Return a recording's ground truth by a bundle's labels; ValueError if it has others."""
        label = classes_of(recording, labels, name, choice)
        events = events_of(recording, choice)
        events = tuple(event for event in events if not _excluded(recording, event))
        origin = recording.origin
        return cls(
            name,
            f"{origin.seed} {origin.user}" if origin.user else "",
            recording.t,
            label,
            events,
            _contacts(recording, events),
            true_places(recording, label, vocabularies.of(labels)),
            recording.excluded,
        )


def classes_of(
    recording: Recording, labels: Sequence[str], name: str, choice: Choice = "auto"
) -> NDArray[np.int64]:
    """Return the class of each frame by a bundle's labels, -1 unknown, (n,); or ValueError."""
    own, column = recording.origin.labels, labels_of(recording, choice)
    odd = [i for i in np.unique(column[column != UNKNOWN]).tolist() if own[i] not in labels]
    if odd:
        raise ValueError(
            f"{name} has the gesture {own[odd[0]]!r}, the bundle {', '.join(labels[1:])}; "
            "choose another bundle"
        )
    return renumbered(column, own, labels).astype(np.int64)


def labels_of(recording: Recording, choice: Choice = "auto") -> NDArray[np.int16]:
    """Return the label of each frame, -1 unknown, (n,), people's moved to the touches."""
    listed: tuple[Labels, ...] = SOURCES if choice == "auto" else (choice,)
    for least in (1, 0):  # labels with a gesture, else labels of null alone
        if named := labellers(recording, listed, least):
            break
    else:
        kind = "" if choice == "auto" else f"{choice} "
        raise ValueError(f"a recording has no {kind}labels; label it first, or leave it out")
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


def true_places(
    recording: Recording, label: NDArray[np.integer], vocabulary: Vocabulary
) -> NDArray[np.float32]:
    """Return the places of located gestures, grid units, NaN elsewhere, (n, 2).

    They are the simulation's, else those that cues asked for; classes (n,) by the vocabulary.
    """
    located = [vocabulary.labels.index(name) for name in vocabulary.located]
    if recording.truth is not None:
        where = recording.truth.touch.astype(np.float32)
        return np.where(np.isin(label, located)[:, None], where, np.float32(np.nan))
    place = np.full((len(label), 2), np.nan, dtype=np.float32)
    cued = [
        (mark.t_s, match)
        for mark in recording.marks
        if mark.kind == "cue" and (match := _PLACE.fullmatch(mark.text))
    ]
    for number, (begin_s, match) in enumerate(cued):
        if match[1] not in vocabulary.located:
            continue
        # The touch may last into the rest that follows, but not into the next cue.
        end_s = cued[number + 1][0] if number + 1 < len(cued) else np.inf
        inside = (recording.t >= begin_s) & (recording.t < end_s)
        own = inside & (label == vocabulary.labels.index(match[1]))
        place[own] = (float(match[2]), float(match[3]))
    return place


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
