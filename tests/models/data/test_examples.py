"""Examples for training: which windows are cut, and how a data set stays out of memory."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.recognition.images.frames import PreprocessSettings
from controller.recordings import reader, writer
from controller.recordings.recording import Recording, RecordingError, unlabelled
from models.data.examples import Source, prepare, read_training, recording_sets
from models.data.simulate import DataSet
from tests.support.pytest_types import Patch

SETTINGS = PreprocessSettings()
START = 10  # frames of a quiet second; the last of them is the first with an image
COUNT = 60
SESSION = DataSet(minutes=0.5).session(0, 0)


def session(count: int = COUNT, **columns: Any) -> Source:
    """An untouched sensor; every frame is null unless its columns say otherwise."""
    frames = np.random.default_rng(0).normal(40.0, 0.01, (count, 5, 5)).astype(np.float32)
    plain = Source(
        frames, np.zeros(count, dtype=np.int16), np.full((count, 2), 2.0, dtype=np.float32)
    )
    return replace(plain, **columns)


def test_excluded_frames_still_go_through_the_device_s_preprocessing() -> None:
    # The sensor drifts while the recording is paused: the rest image follows, as on the device.
    drift = np.linspace(1.0, 1.02, COUNT)[:, None, None]
    source = session()
    source = replace(source, frames=(source.frames * drift).astype(np.float32))
    excluded = np.arange(COUNT) < 40
    all_of_it = prepare([source], SETTINGS).images
    rest_of_it = prepare([replace(source, excluded=excluded)], SETTINGS).images
    np.testing.assert_array_equal(rest_of_it, all_of_it[-20:])


def test_a_frame_of_which_nobody_said_anything_has_no_place() -> None:
    label = np.zeros(COUNT, dtype=np.int16)
    label[30:35] = -1
    examples = prepare([session(label=label)], SETTINGS)
    unknown = np.flatnonzero(np.isnan(examples.touch[:, 0]))
    assert unknown.tolist() == list(range(30 - START + 1, 35 - START + 1))


def test_no_window_spans_two_sessions() -> None:
    examples = prepare([session(), session(30), session()], SETTINGS)
    first = examples.session[examples.ends - 9]
    assert (first == examples.session[examples.ends]).all()
    assert set(first.tolist()) == {0, 1, 2}


def test_a_session_without_a_window_is_left_out_and_none_at_all_is_told() -> None:
    assert set(prepare([session(12), session()], SETTINGS).session.tolist()) == {1}
    for short in ([], [session(12)], [session(label=np.full(COUNT, -1, dtype=np.int16))]):
        with pytest.raises(ValueError, match="no session has a quiet second and a whole labelled"):
            prepare(short, SETTINGS)


def test_sessions_of_two_sensors_are_refused() -> None:
    other = session()
    other = replace(other, frames=other.frames[:, :4].copy())
    with pytest.raises(ValueError, match=r"sessions of \(5, 5\) and of \(4, 5\) taxels"):
        prepare([session(), other], SETTINGS)


@given(
    excluded=st.lists(st.booleans(), min_size=COUNT, max_size=COUNT),
    label=st.lists(st.integers(-1, 2), min_size=COUNT, max_size=COUNT),
    steps=st.lists(st.sampled_from([1, 1, 1, 1, 1, 1, 1, 2, 50]), min_size=COUNT, max_size=COUNT),
)
def test_windows_are_ten_in_a_row(excluded: list[bool], label: list[int], steps: list[int]) -> None:
    n = np.cumsum(steps)
    source = session(label=np.array(label, dtype=np.int16), sequence=n, excluded=np.array(excluded))
    expected = [
        end
        for end in range(START - 1 + 9, COUNT)
        if not any(excluded[end - 9 : end + 1]) and n[end] - n[end - 9] == 9 and label[end] != -1
    ]
    try:
        examples = prepare([source], SETTINGS)
    except ValueError:
        assert not expected
        return
    kept = [k for k in range(START - 1, COUNT) if not excluded[k]]
    assert [kept[end] for end in examples.ends] == expected
    assert examples.label[examples.ends].tolist() == [label[end] for end in expected]


# --- data sets that are larger than memory ----------------------------------------------------


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """Three recordings of one kind."""
    for number in range(3):
        made = replace(SESSION, origin=replace(SESSION.origin, user=f"0{number}"))
        (tmp_path / f"sub-0{number}_ses-01_run-01.npz").write_bytes(writer.pack(made))
    return tmp_path


def test_a_data_set_is_read_one_recording_at_a_time(data: Path, monkeypatch: Patch) -> None:
    loaded: list[str] = []
    real = reader.load

    def load(path: Path) -> Recording:
        loaded.append(path.name)
        return real(path)

    monkeypatch.setattr(reader, "load", load)
    recordings = read_training([data])
    assert (len(recordings), loaded) == (3, [])
    assert sum(survey.frames for survey in recordings.surveys) == 900

    def sources() -> Iterator[Source]:
        for number, recorded in enumerate(recordings):
            assert len(loaded) == number + 1
            yield Source.of(recorded)

    prepare(sources(), SETTINGS)
    path, other = (recordings.surveys[number].path for number in (0, 1))
    path.write_bytes(other.read_bytes())
    with pytest.raises(RecordingError, match=r"sub-00_ses-01_run-01\.npz has changed meanwhile"):
        recordings[0]


def test_a_file_named_twice_counts_once(data: Path) -> None:
    first, second, _ = sorted(data.iterdir())
    assert recording_sets([first, second, first]) == {"recordings": [first, second]}


def test_a_recording_of_fewer_labels_fits_and_of_another_kind_does_not(data: Path) -> None:
    path = data / "sub-09_ses-01_run-01.npz"
    path.write_bytes(writer.pack(replace(SESSION, origin=replace(SESSION.origin, unit="counts"))))
    damaged = data / "sub-10_ses-01_run-01.npz"
    damaged.write_bytes(b"PK")
    recordings = read_training([data])
    assert len(recordings) == 3
    notes = recordings.notes
    assert notes[0].startswith(f"{damaged} is left out: ")
    assert notes[1] == (f"{path} is left out: it has 5×5 taxels in counts, others 5×5 taxels in pF")
    few = replace(SESSION, origin=replace(SESSION.origin, labels=("null", "twist_cw")))
    twisted = np.where(np.arange(300) < 200, 0, 1).astype(np.int16)
    few = replace(few, label=twisted, button=unlabelled(300)["button"])
    path.write_bytes(writer.pack(few))
    recordings = read_training([data])
    assert recordings.labels == SESSION.origin.labels
    assert set(Source.of(recordings[3], "true", recordings.labels).label.tolist()) == {0, 3}
    other = replace(few, origin=replace(few.origin, labels=("null", "wave")))
    path.write_bytes(writer.pack(other))
    # A file knows the gestures that were made in it; together they know all.
    assert read_training([data]).labels == (*SESSION.origin.labels, "wave")
    with pytest.raises(ValueError, match=r"no recording can be read; .* is left out"):
        read_training([damaged])


def test_recordings_of_two_pitches_are_refused_by_name(data: Path) -> None:
    path = data / "sub-09_ses-01_run-01.npz"
    wide = replace(SESSION, origin=replace(SESSION.origin, pitch_mm=12.0))
    path.write_bytes(writer.pack(wide))
    words = rf"10 mm apart in .*sub-00_ses-01_run-01\.npz and 12 mm in {path}; learn from one pitch"
    with pytest.raises(ValueError, match=words):
        read_training([data])


# --- labels -----------------------------------------------------------------------------------


def test_examples_learn_from_whoever_said_it() -> None:
    nobody, null, press, pinch = (np.full(300, k, dtype=np.int16) for k in (-1, 0, 1, 2))
    recorded = replace(SESSION, label=null, button=press, key=pinch, cue=nobody)
    for labels, said in (("true", 0), ("button", 1), ("key", 2)):
        assert set(Source.of(recorded, labels).label.tolist()) == {said}  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="lacks cue labels; learn from true or button or key"):
        Source.of(recorded, "cue")
    silent = replace(SESSION, label=nobody, button=nobody)
    with pytest.raises(ValueError, match="lacks cue labels; label it first, or leave it out"):
        Source.of(silent, "cue")
    key = nobody.copy()
    key[100:200] = 1  # labels for some frames are enough
    examples = prepare([Source.of(replace(SESSION, key=key), "key")], SETTINGS)
    assert examples.label[examples.ends].tolist() == [1] * 100
    assert np.isnan(Source.of(replace(SESSION, truth=None)).touch).all()
