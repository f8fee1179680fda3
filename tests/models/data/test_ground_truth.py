"""Ground truth of a recording: gestures out of truth and labels, contacts, what does not count."""

from dataclasses import replace

import numpy as np
import pytest

from models.data.ground_truth import GroundTruth, events_of
from tests.support.recordings import LABELS, of, origin, played


def test_the_gestures_of_a_simulation_are_its_own_without_brushes() -> None:
    recording = played()
    assert recording.truth is not None
    events = events_of(recording)
    assert events == recording.truth.events
    assert {event.kind for event in events} <= set(LABELS[1:])
    brushed = replace(
        recording,
        truth=replace(recording.truth, events=(*events, replace(events[-1], kind="brush"))),
    )
    assert events_of(brushed) == events


def test_gestures_out_of_labelled_frames_begin_and_end_within_a_frame_of_the_truth() -> None:
    recording = played()
    told = events_of(replace(recording, truth=None))
    true = events_of(recording)
    assert [event.kind for event in told] == [event.kind for event in true]
    for ours, theirs in zip(told, true, strict=True):
        assert abs(ours.onset_s - theirs.onset_s) <= 0.05 + 1e-9
        assert abs(ours.release_s - theirs.release_s) <= 0.05 + 1e-9


def test_an_unclear_frame_does_not_part_a_gesture_and_two_gestures_may_touch() -> None:
    label = [0, 1, 1, -1, 1, 0, 2, 2, -1, 1, 0]
    recording = of(np.full((len(label), 2, 2), 40.0), label=label)
    found = [(e.kind, round(e.onset_s, 2), round(e.release_s, 2)) for e in events_of(recording)]
    assert found == [("press", 0.15, 0.55), ("pinch", 0.65, 0.85), ("press", 0.95, 1.05)]


def test_a_gesture_that_is_partly_excluded_does_not_count() -> None:
    label = [0, 1, 1, 0, 2, 2, 0]
    excluded = np.array([False, False, True, False, False, False, False])
    recording = of(np.full((7, 2, 2), 40.0), label=label, excluded=excluded)
    assert [event.kind for event in GroundTruth.of(recording, LABELS, "it").events] == ["pinch"]


def test_first_contact_comes_shortly_before_the_onset() -> None:
    recording = played()
    known = GroundTruth.of(recording, LABELS, "it")
    early = np.array([e.onset_s for e in known.events]) - np.array(known.contact_s)
    assert np.isfinite(early).all()
    assert early.min() >= 0.0
    assert early.max() < 0.5  # a finger is down within a few frames
    assert np.median(early) < 0.2


def test_labels_are_counted_as_the_bundle_counts_them() -> None:
    about = origin(2, 2, labels=("null", "pinch"))
    known = GroundTruth.of(of(np.full((3, 2, 2), 40.0), about, label=[0, 1, -1]), LABELS, "it")
    assert known.label.tolist() == [0, 2, -1]
    assert np.isnan(known.contact_s).all()  # nobody said when it was


def test_a_gesture_that_the_bundle_does_not_know_is_one_sentence() -> None:
    about = origin(2, 2, labels=("null", "press", "wave"))
    wave = of(np.full((3, 2, 2), 40.0), about, label=[0, 2, 0])
    with pytest.raises(ValueError, match="it has the gesture 'wave', the bundle press, pinch"):
        GroundTruth.of(wave, LABELS, "it")
    unused = of(np.full((3, 2, 2), 40.0), about, label=[0, 1, 0])
    assert len(GroundTruth.of(unused, LABELS, "it").events) == 1


def test_nobody_said_anything_is_one_sentence() -> None:
    silent = of(np.full((3, 2, 2), 40.0))
    with pytest.raises(ValueError, match="has no labels"):
        GroundTruth.of(silent, LABELS, "it")
    idle = of(np.full((3, 2, 2), 40.0), key=[0, 0, 0])
    with pytest.raises(ValueError, match="has no button labels"):
        GroundTruth.of(idle, LABELS, "it", "button")
