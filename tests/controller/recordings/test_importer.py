"""Other sensors: arrays and a description become recordings."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.recordings import edit, importer
from controller.recordings.description import Description, described
from controller.recordings.recording import Recording, RecordingError
from controller.shared import config
from controller.shared.errors import UserError

# The description of docs/recording.md.
CAPFINGERID = """
frames = "frames"
unit = "counts"
pitch_mm = 4.1
device = "capfingerid"
time = "t"
gap_s = 0.2
drop_repeated = true
label = "task"
label_names = "task_names"
null = "PAUSE"
labeller = "cue"
subject = "subject"
"""


def screen(n: int = 12) -> dict[str, np.ndarray[Any, Any]]:
    """Two people's frames on a small screen, as CapFingerId has them."""
    return {
        "frames": np.arange(n * 6, dtype=np.int16).reshape(n, 3, 2),
        "t": 1.5e9 + np.tile(np.array([0.0, 0.07, 0.07, 0.14, 1.0, 0.5]), n // 6),
        "task": np.tile(np.array([0, 0, 0, 3, 3, 2], dtype=np.int8), n // 6),
        "task_names": np.array(["DRAG", "PAUSE", "SCROLL", "TAP"]),
        "subject": np.repeat(np.array([12, 3], dtype=np.int8), n // 2),
    }


def imported(text: str, **arrays: Any) -> list[Recording]:
    told = config.settings(Description, tomllib.loads(text))
    return list(importer.recordings({**screen(), **arrays}, told))


def test_each_person_gets_a_recording() -> None:
    first, second = imported(CAPFINGERID)
    assert (first.origin.user, second.origin.user) == ("03", "12")
    assert first.origin.session == "01"
    assert first.frames.dtype == np.float32
    assert first.frames.shape == (5, 3, 2)
    assert (first.origin.unit, first.origin.pitch_mm) == ("counts", 4.1)
    assert first.origin.rate_hz == 14.3  # the median of the times


def test_a_person_with_a_single_frame_gets_a_recording_of_it() -> None:
    one = {name: array[:1] for name, array in screen().items() if name != "task_names"}
    (only,) = imported(CAPFINGERID + "rate_hz = 14.0\n", **one)
    assert only.frames.shape == (1, 3, 2)


def test_repeated_times_are_dropped_and_stretches_begin_where_time_jumps() -> None:
    first, _ = imported(CAPFINGERID)
    # 0, 0.07, (again), 0.14, a pause until 1.0, and back to 0.5
    assert first.t.tolist() == pytest.approx([0.0, 0.07, 0.14, 1.0, 1.2])
    assert first.sequence.tolist() == [1, 2, 3, 5, 7]


def test_labels_begin_with_null_and_leave_out_what_nobody_did() -> None:
    first, _ = imported(CAPFINGERID)
    assert first.origin.labels == ("null", "DRAG", "SCROLL", "TAP")
    assert first.cue.tolist() == [1, 1, 3, 3, 2]
    assert (first.label == -1).all()  # they were asked to, and nobody knows what they did


def test_a_class_can_be_null_and_minus_one_is_unknown() -> None:
    task = np.array([0, 1, -1, 3, 2, 1] * 2)
    first, _ = imported(CAPFINGERID.replace("time =", "#").replace("gap_s =", "rate_hz = 10 #")
                        .replace("drop_repeated", "#"), task=task)  # fmt: skip
    assert first.cue.tolist() == [1, 0, -1, 3, 2, 0]
    assert first.t.tolist() == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    assert first.sequence.tolist() == [1, 2, 3, 4, 5, 6]


def test_a_class_called_null_is_null_without_a_word() -> None:
    text = CAPFINGERID.replace("null =", "#")
    first, _ = imported(text, task_names=np.array(["null", "PAUSE", "SCROLL", "TAP"]))
    assert first.origin.labels == ("null", "SCROLL", "TAP")
    assert first.cue.tolist() == [0, 0, 2, 2, 1]


def test_sessions_of_a_person_are_told_apart_by_arrays() -> None:
    text = CAPFINGERID + 'session = ["hand", "finger"]\n'
    hand, finger = np.array([0, 1] * 6), np.zeros(12, dtype=np.int64)
    made = imported(
        text, hand=hand, hand_names=np.array(["left", "right"]), finger=finger, t=np.arange(12) / 9
    )
    assert [(r.origin.user, r.origin.session, len(r.t)) for r in made] == [
        ("03", "left00", 3), ("03", "right00", 3), ("12", "left00", 3), ("12", "right00", 3),
    ]  # fmt: skip


def test_flat_frames_get_the_shape_that_is_told() -> None:
    text = 'frames = "x"\npitch_mm = 8\nrate_hz = 50\nrows = 2\ncolumns = 4\n'
    [made] = importer.recordings(
        {"x": np.ones((5, 8))}, config.settings(Description, tomllib.loads(text))
    )
    assert made.frames.shape == (5, 2, 4)
    assert made.origin.labels == ("null",)
    assert (made.origin.user, made.origin.unit, made.origin.rate_hz) == ("01", "pF", 50.0)


def test_the_same_arrays_have_the_same_ids_and_others_have_others() -> None:
    ids = [recording.origin.id for recording in imported(CAPFINGERID)]
    assert ids == [recording.origin.id for recording in imported(CAPFINGERID)]
    assert len(set(ids)) == 2
    louder = [r.origin.id for r in imported(CAPFINGERID, frames=screen()["frames"] + 1)]
    assert not set(ids) & set(louder)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("pitch_mm = 1\nrate_hz = 1", "has frames = None; expected is a text"),
        ('frames = "x"\npitch_mm = 1', "neither 'time' nor 'rate_hz'"),
        ('frames = "x"\npitch_mm = 0\nrate_hz = 1', "expected is a number from"),
        ('frames = "x"\npitch_mm = 1\nrate_hz = 1\nlabel = "y"', "no 'label_names'"),
        ('frames = "x"\nrows = = 2', "wrong.toml, line 2: invalid value"),
    ],
)
def test_a_wrong_description_is_told_with_place(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(UserError, match=complaint):
        described(path)


@pytest.mark.parametrize(
    ("arrays", "complaint"),
    [
        ({"frames": np.zeros((12, 6))}, r"'frames' is float64 \(12, 6\), not numbers of"),
        ({"frames": np.zeros((12, 3, 2), dtype="U1")}, "'frames' is <U1"),
        ({"frames": np.zeros((0, 3, 2))}, "'frames' is float64"),
        ({"t": np.zeros(11)}, r"'t' is float64 \(11,\), not one number for each of the 12 frames"),
        ({"t": np.full(12, np.nan)}, "times that are no numbers"),
        ({"t": np.zeros(12)}, "times do not rise"),
        ({"task": np.full(12, 4)}, "'task' holds 4, and there are 4 labels, counted from 0"),
        ({"task": np.full(12, 0.5)}, "not one whole number for each"),
        ({"task_names": np.zeros(3)}, "'task_names' is no list of names"),
        ({"task_names": np.array(["a", "PAUSE", "b", "a"])}, "not all different"),
        ({"task_names": np.array(["a", "b", "c", "d"])}, "null = 'PAUSE' is none of the labels"),
    ],
)
def test_arrays_unlike_the_description_are_refused(arrays: dict[str, Any], complaint: str) -> None:
    with pytest.raises(RecordingError, match=complaint):
        imported(CAPFINGERID, **arrays)


def test_repeated_times_are_told_unless_they_shall_be_dropped() -> None:
    with pytest.raises(RecordingError, match="twice in a row; say drop_repeated = true"):
        imported(CAPFINGERID.replace("drop_repeated = true", ""))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("reading", [np.inf, 1e300])
def test_what_is_no_number_is_refused_without_a_warning_of_numpy(reading: float) -> None:
    told = Description(frames="frames", pitch_mm=10.0, rate_hz=10.0, unit="counts")
    arrays = {"frames": np.full((50, 5, 5), reading)}
    with pytest.raises(RecordingError, match="frames that are not all numbers"):
        edit.sealed(next(importer.recordings(arrays, told)))


def test_a_name_that_looks_like_a_path_is_no_label() -> None:
    names = np.array(["DRAG", "PAUSE", "../x", "TAP"])
    with pytest.raises(RecordingError, match=r"the label '\.\./x' is no name of a gesture"):
        imported(CAPFINGERID, task_names=names)


def test_files_of_arrays_are_read_without_trusting_them(tmp_path: Path) -> None:
    told = config.settings(Description, tomllib.loads(CAPFINGERID))
    np.savez_compressed(tmp_path / "good.npz", **screen())  # type: ignore[arg-type]
    assert importer.read(tmp_path / "good.npz", told).keys() == screen().keys()
    objects = {**screen(), "frames": np.array([{}], dtype=object)}
    np.savez(tmp_path / "pickled.npz", **objects)  # type: ignore[arg-type]
    with pytest.raises(RecordingError, match="pickled"):
        importer.read(tmp_path / "pickled.npz", told)
    np.savez(tmp_path / "less.npz", frames=np.zeros(3))
    with pytest.raises(RecordingError, match="has no array 'subject', which the description names"):
        importer.read(tmp_path / "less.npz", told)
    with pytest.raises(RecordingError, match="cannot read"):
        importer.read(tmp_path / "none.npz", told)
    alone = config.settings(Description, {"frames": "frames", "pitch_mm": 1, "rate_hz": 10})
    np.save(tmp_path / "one.npy", screen()["frames"])
    [made] = importer.recordings(importer.read(tmp_path / "one.npy", alone), alone)
    assert len(made.t) == 12
    np.save(tmp_path / "pickled.npy", np.array([{}], dtype=object))
    with pytest.raises(RecordingError, match=r"name an \.npz or \.npy of plain numbers"):
        importer.read(tmp_path / "pickled.npy", alone)
