"""Trim and relabel: new recordings that name their source; the old one stays as it is."""

import re
from dataclasses import replace

import numpy as np
import pytest

from controller.recognition.pipeline import CommandRecord
from controller.recordings import edit, reader, writer
from controller.recordings.recording import Mark, Recording, RecordingError, SimulatedTruth
from controller.shared import npz
from controller.shared.event_metric import Event
from tests.support.recordings import of

SOURCE = "one.npz"


def session() -> Recording:
    """Four seconds at 10 Hz with something of everything."""
    n = 40
    return of(
        np.arange(n)[:, None, None] * np.ones((2, 3)),
        label=np.arange(n) // 10 % 3,
        marks=(Mark(0.5, "note", "early"), Mark(2.5, "note", "late")),
        commands=(CommandRecord(1.5, 15, "press", 0.9, None, "left"),),
        state={"mean": np.ones(3)},
        truth=SimulatedTruth(
            np.zeros((n, 2), dtype=np.float32),
            np.zeros((n, 1, 3), dtype=np.float32),
            (Event(0.2, 0.9, "press"), Event(1.8, 2.3, "pinch")),
        ),
    )


def test_a_piece_keeps_its_times_and_what_belongs_to_them() -> None:
    piece = edit.trim(session(), 1.0, 2.0, SOURCE)
    assert piece.t.tolist() == pytest.approx([1.0 + k / 10 for k in range(10)])
    assert piece.sequence.tolist() == list(range(10, 20))
    assert piece.frames[0, 0, 0] == 9.0
    assert [command.t_s for command in piece.commands] == [1.5]
    assert piece.truth is not None
    assert [event.kind for event in piece.truth.events] == ["pinch"]  # reaches into it
    assert [mark.kind for mark in piece.marks] == ["trim"]
    assert reader.parse(npz.unpack(edit.sealed(piece), reader.MAX_BYTES)).truth is not None


def test_a_piece_remembers_the_pipeline_only_from_the_first_frame_on() -> None:
    assert edit.trim(session(), 1.0, 2.0, SOURCE).state == {}
    assert edit.trim(session(), 0.0, 2.0, SOURCE).state.keys() == {"mean"}


def test_a_new_recording_has_its_own_id_and_names_its_source() -> None:
    whole = replace(session(), origin=replace(session().origin, id="cd" * 16))
    piece = edit.trim(whole, -np.inf, np.inf, SOURCE)
    assert len(piece.origin.id) == 32
    assert piece.origin.id != whole.origin.id
    [mark] = [mark for mark in piece.marks if mark.kind == "trim"]
    assert mark.t_s == piece.t[0]
    assert re.search(rf"from one.npz \({'cd' * 16}\), 20\S+\+00:00, by orbtouch", mark.text)


def test_a_range_gets_another_label_and_nothing_else_changes() -> None:
    whole = session()
    changed = edit.relabel(whole, 1.0, 1.5, SOURCE, label="twist_cw", column="key")
    assert np.flatnonzero(changed.key == 3).tolist() == [9, 10, 11, 12, 13]
    assert (whole.key == -1).all()  # the original is kept
    [mark] = [mark for mark in changed.marks if mark.kind == "relabel"]
    assert mark.text.startswith("5 frames of 1 to 1.4 s key set to twist_cw; from one.npz")
    back = replace(changed, key=whole.key, marks=whole.marks, origin=whole.origin)
    assert writer.pack(back) == writer.pack(whole)


def test_frames_are_excluded_and_included_again() -> None:
    without = edit.relabel(session(), 1.0, 2.0, SOURCE, excluded=True)
    assert without.excluded.sum() == 10
    partly = edit.relabel(without, 1.5, 2.0, SOURCE, excluded=False, label="unknown")
    assert partly.excluded.sum() == 5
    assert (partly.label[14:19] == -1).all()
    assert [mark.t_s for mark in partly.marks] == sorted(mark.t_s for mark in partly.marks)


@pytest.mark.parametrize(
    ("what", "complaint"),
    [
        ({"label": "wave"}, "no label 'wave' in it, only null, press, .* twist_ccw, unknown"),
        ({}, "nothing is to be changed"),
    ],
)
def test_what_cannot_be_said_is_refused(what: dict[str, str], complaint: str) -> None:
    with pytest.raises(RecordingError, match=complaint):
        edit.relabel(session(), 1.0, 2.0, SOURCE, **what)  # type: ignore[arg-type]


def test_a_range_without_frames_is_refused() -> None:
    with pytest.raises(RecordingError, match=r"no frame from 5 to 6 s; .* from 0\.1 to 4 s"):
        edit.trim(session(), 5.0, 6.0, SOURCE)
