"""Labels as people give them, against a simulation that knows when the hand truly touched."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import vocabulary
from controller.recordings.recording import Mark, Recording, unlabelled
from models.data import label_repair
from models.data.ground_truth import true_places
from models.data.simulate import DataSet

PLAYED = DataSet(minutes=3.0).session(0, 0)
NOISY = DataSet(minutes=3.0, preset="paper-snr", seed=1).session(0, 0)


def late(record: Recording, begin_s: float, end_s: float) -> Recording:
    """The same recording under a button whose every edge is so late."""
    assert record.truth is not None
    button = np.zeros(len(record.t), dtype=np.int16)
    for event in record.truth.events:
        if event.kind in record.origin.labels:
            inside = (record.t >= event.onset_s + begin_s) & (record.t < event.release_s + end_s)
            button[inside] = record.origin.labels.index(event.kind)
    return replace(record, button=button)


@given(begin_s=st.floats(-0.2, 0.4), end_s=st.floats(-0.1, 0.4))
@settings(max_examples=10, deadline=None)
def test_the_lateness_of_a_button_is_found_from_the_sensor(begin_s: float, end_s: float) -> None:
    _, found = label_repair.repair(late(PLAYED, begin_s, end_s), "button")
    # A frame is the nearest that a label's edge can be told.
    assert found.begin_s == pytest.approx(begin_s + 0.05, abs=0.06)
    assert found.end_s == pytest.approx(end_s + 0.05, abs=0.06)


@pytest.mark.parametrize("recording", [PLAYED, NOISY], ids=["nominal", "paper-snr"])
def test_repaired_labels_are_far_nearer_to_the_truth_than_the_button(recording: Recording) -> None:
    repaired, _ = label_repair.repair(recording, "button")
    clear = repaired != -1
    wrong = np.mean(recording.button != recording.label)
    assert np.mean((repaired != recording.label)[clear]) < wrong / 2
    assert np.mean(clear) > 0.9


def test_nobody_learns_from_frames_that_could_be_either() -> None:
    repaired, _ = label_repair.repair(PLAYED, "button")
    edges = np.flatnonzero(np.diff(PLAYED.label) != 0) + 1
    near = np.abs(np.flatnonzero(repaired == -1)[:, None] - edges).min(axis=1)
    assert np.mean(near <= 1) > 0.9


def spanning(record: Recording, touches: int) -> tuple[Recording, np.ndarray[Any, Any]]:
    """The same recording with labels of several touches each, and which frames lie inside them."""
    assert record.truth is not None
    events = [event for event in record.truth.events if event.kind in record.origin.labels]
    button = np.zeros(len(record.t), dtype=np.int16)
    inside = np.zeros(len(record.t), dtype=np.bool_)
    for i in range(0, len(events) - touches, touches + 1):
        begin_s, end_s = events[i].onset_s, events[i + touches - 1].release_s
        late = (record.t >= begin_s + 0.15) & (record.t < end_s + 0.2)
        button[late] = 1 + i % 2
        inside |= (record.t >= begin_s + 0.15) & (record.t < end_s - 0.15)
    return replace(record, button=button), inside


@pytest.mark.parametrize("preset", ["nominal", "paper-snr"])
@pytest.mark.parametrize("rate_hz", [10.0, 40.0])
@pytest.mark.parametrize("touches", [2, 3, 5])
def test_a_label_keeps_its_inside_however_many_touches_it_has(
    preset: str, rate_hz: float, touches: int
) -> None:
    played = DataSet(minutes=3.0, preset=preset, rate_hz=rate_hz).session(0, 0)
    recording, inside = spanning(played, touches)
    repaired, found = label_repair.repair(recording, "button")
    assert np.mean(repaired[inside] == recording.button[inside]) >= 0.98
    assert found.named == np.sum(recording.button > 0)
    assert found.changed < 0.05 * found.named  # late edges


def test_a_light_touch_in_a_label_belongs_to_it() -> None:
    """A touch of a fifth of the strength, then a firm one, under one label."""
    frames = np.full((200, 5, 5), 40.0)
    frames[60:80, 1:4, 1:4] -= 2.0
    frames[100:120, 1:4, 1:4] -= 10.0
    frames += np.random.default_rng(1).normal(0.0, 0.02, frames.shape)
    button = np.zeros(200, dtype=np.int16)
    button[64:122] = 1  # late
    made = replace(
        PLAYED, frames=frames.astype(np.float32), t=np.arange(200) / 10.0,
        sequence=np.arange(200), excluded=np.zeros(200, dtype=np.bool_), truth=None, button=button,
    )  # fmt: skip
    repaired, found = label_repair.repair(made, "button")
    assert (repaired[62:119] == 1).all()
    assert (repaired[:59] == 0).all()
    assert found.unfelt == 0


def test_a_label_under_which_nothing_is_felt_is_not_learned_from_unless_none_is() -> None:
    button = np.zeros(len(PLAYED.t), dtype=np.int16)
    idle = _longest_idle(PLAYED)
    middle = idle[len(idle) // 2 - 2 : len(idle) // 2 + 3]
    button[middle] = 1
    repaired, found = label_repair.repair(replace(PLAYED, button=button), "button")
    assert repaired is button
    assert (found.unfelt, found.edges) == (1, 0)
    felt = np.where(button > 0, button, PLAYED.button)
    repaired, found = label_repair.repair(replace(PLAYED, button=felt), "button")
    assert (repaired[middle] == -1).all()
    assert found.unfelt == 1
    assert found.changed >= len(middle)


def test_nothing_is_made_of_labels_that_nobody_gave() -> None:
    silent = replace(PLAYED, button=unlabelled(len(PLAYED.t))["button"])
    repaired, found = label_repair.repair(silent, "button")
    assert (repaired == -1).all()
    assert np.isnan(found.begin_s)
    assert found.edges == 0


def test_examples_are_counted_once_each_however_unclear_their_edges() -> None:
    said = np.array([0, -1, 1, 1, -1, 0, 0, 2, 2, -1, 1, 0])
    assert label_repair.examples(said, ("null", "press", "pinch")) == {"press": 2, "pinch": 1}


def test_a_cue_says_where_a_press_is() -> None:
    label = np.zeros(len(PLAYED.t), dtype=np.int16)
    label[20:26] = 1
    label[60:66] = 1
    label[80:86] = 2
    marks = (
        Mark(1.5, "cue", "go press at 1,2.5"),
        Mark(2.5, "cue", "rest"),
        Mark(5.5, "cue", "go press at -0.5,0"),
        Mark(7.5, "cue", "go pinch at 3,3"),
    )
    world = replace(PLAYED, truth=None, marks=marks)
    place = true_places(world, label, vocabulary.shipped())
    assert np.unique(place[20:26], axis=0).tolist() == [[1.0, 2.5]]
    assert np.unique(place[60:66], axis=0).tolist() == [[-0.5, 0.0]]
    assert np.isnan(place[80:86]).all()  # pinches have no place
    assert np.isfinite(place[:, 0]).sum() == 12


def _longest_idle(recording: Recording) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """The frames of the longest time in which the truth knows of no touch at all."""
    assert recording.truth is not None
    touched = np.array(np.isfinite(recording.truth.contact[:, :, 2]).sum(axis=1) > 0)
    touched[:30] = True  # before rest is known
    return max(np.split(np.arange(len(touched)), np.flatnonzero(touched)), key=len)
