"""Recordings: what goes in comes out, and nothing else is taken for one."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.bundles import bundle
from controller.recognition.pipeline import CommandRecord
from controller.recordings import reader, writer
from controller.recordings.recorder import Recorder
from controller.recordings.recording import Mark, RecordingError, SimulatedTruth, refuse_misfit
from controller.shared import npz
from controller.shared.event_metric import Event
from tests.support import small_journal

ORIGIN = replace(small_journal.ORIGIN, rows=5, columns=5)
COMMAND = CommandRecord(0.7, 7, "press", 0.98, (0.5, 3.0), "left")


def record(path: Path, frames: int = 30, rate_hz: float = 10.0) -> Path:
    """A recording of noise with one command."""
    recorder = Recorder(path, ORIGIN, {"debounce.mean": np.array([1.0, 0.0, 0.0])})
    rng = np.random.default_rng(3)
    for k in range(1, frames + 1):
        frame = rng.normal(41.2, 2.9, (5, 5)).astype(np.float32)
        recorder.journal.add_frame(frame, k / rate_hz, k, (k % 2, -1, -1, -1))
        if k == 7:
            recorder.journal.add_command(COMMAND)
    assert recorder.close() == path
    return path


def changed(path: Path, **arrays: Any) -> Path:
    """The recording with some arrays put in place of its own; None takes one away."""
    whole = {**npz.unpack(path, reader.MAX_BYTES), **arrays}
    path.write_bytes(npz.pack({name: array for name, array in whole.items() if array is not None}))
    return path


def meta(**fields: Any) -> Any:
    origin = {**asdict(ORIGIN), **fields}
    return np.array(json.dumps(origin))


FRAMES = np.full((30, 5, 5), 40.0, dtype=np.float32)
TIMES = np.arange(1, 31) / 10
BROKEN = FRAMES.copy()
BROKEN[3, 2, 2] = np.nan


TRUTH = SimulatedTruth(
    touch=np.full((30, 2), 2.0, dtype=np.float32),
    contact=np.full((30, 3, 3), np.nan, dtype=np.float32),
    events=(Event(0.3, 0.9, "press"), Event(1.2, 1.6, "brush")),
)


def simulated(path: Path) -> Path:
    """A simulated recording, which knows the truth."""
    origin = replace(ORIGIN, user="03", session="01", seed=7, preset="nominal", protocol="free")
    whole = reader.load(record(path))
    path.write_bytes(writer.pack(replace(whole, origin=origin, truth=TRUTH)))
    return path


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"frames": None}, "has no 'frames'"),
    ({"frames": FRAMES.astype(np.float64)}, "'frames' as float64"),
    ({"frames": FRAMES[:, :4]}, r"not float32 \(n, 5, 5\)"),
    ({"frames": FRAMES[0]}, r"not float32 \(n, 5, 5\)"),
    ({"frames": FRAMES[:0]}, "holds no frames"),
    ({"frames": BROKEN}, "not all numbers below 1e.06"),
    ({"t": TIMES[:-1]}, r"not float64 \(30\)"),
    ({"t": TIMES[::-1].copy()}, "does not rise"),
    ({"label": np.full(30, 3, dtype=np.int16)}, "a label that it does not name"),
    ({"touch": np.zeros((30, 3))}, r"not float64 \(30, 2\)"),
    ({"command_name": np.zeros(1)}, "without its"),
    ({"command_touch": np.zeros((2, 2))}, r"not float64 \(1, 2\)"),
    ({"state.debounce.mean": np.full(3, np.inf)}, "state that is not all finite"),
    ({"meta": None}, "no recording of OrbTouch"),
    ({"meta": np.array("{")}, "nothing legible"),
    ({"meta": meta(schema=4)}, "has form 4, this program reads 3"),
    ({"meta": meta(rows=-1)}, "impossible things"),
    ({"meta": meta(mood="good")}, "nothing legible"),
    ({"meta": meta(seed=-1)}, "impossible things"),
    # The truth of a simulation.
    ({"true_touch": TRUTH.touch[1:]}, r"not float32 \(30, 2\)"),
    ({"true_contact": TRUTH.contact[:, :, :2]}, r"not float32 \(30, n, 3\)"),
    ({"true_contact": None}, "has no 'true_contact'"),
    ({"event_release": np.zeros(3)}, r"not float64 \(2\)"),
    ({"event_release": np.array([0.1, 1.6])}, "end before they begin"),
    # What form 3 brought.
    ({"key": np.full(30, 3, dtype=np.int16)}, "a key that it does not name"),
    ({"cue": np.full(30, -2, dtype=np.int16)}, "a cue that it does not name"),
    ({"excluded": np.zeros(30, dtype=np.int8)}, r"not bool \(30\)"),
    ({"rest": np.full((5, 4), 40.0, dtype=np.float32)}, r"not float32 \(5, 5\)"),
    ({"rest": np.full((5, 5), np.nan, dtype=np.float32)}, "rest image that is not all numbers"),
    ({"mark_t": np.array([1.0])}, "a table without its 1 names, 'mark_kind'"),
    ({"command_t": np.array([np.nan])}, "commands whose times or probabilities"),
]


@pytest.mark.parametrize(("arrays", "complaint"), WRONG)
def test_wrong_files_are_refused(tmp_path: Path, arrays: dict[str, Any], complaint: str) -> None:
    path = changed(simulated(tmp_path / "one.npz"), **arrays)
    with pytest.raises(RecordingError, match=complaint):
        reader.load(path)


def test_a_simulated_recording_keeps_the_truth_and_who_played(tmp_path: Path) -> None:
    loaded = reader.load(simulated(tmp_path / "one.npz"))
    assert (loaded.origin.user, loaded.origin.seed) == ("03", 7)
    assert loaded.truth is not None
    assert loaded.truth.events == TRUTH.events
    np.testing.assert_array_equal(loaded.truth.contact, TRUTH.contact)
    assert reader.load(record(tmp_path / "two.npz")).truth is None


def test_a_rate_two_percent_from_the_bundle_s_is_refused(tmp_path: Path) -> None:
    shipped = bundle.read(bundle.default_path(10.0))
    for rate_hz in (9.9, 10.15):
        near = reader.load(record(tmp_path / f"near-{rate_hz}.npz", rate_hz=rate_hz))
        refuse_misfit(near, shipped.settings)
    for rate_hz in (9.7, 10.3, 25.0):
        far = reader.load(record(tmp_path / f"far-{rate_hz}.npz", rate_hz=rate_hz))
        with pytest.raises(RecordingError, match=f"runs at {rate_hz:.2f} Hz, the bundle at 10.00"):
            refuse_misfit(far, shipped.settings)


def test_a_missed_frame_does_not_change_the_rate(tmp_path: Path) -> None:
    path = record(tmp_path / "one.npz")
    times = TIMES.copy()
    times[20:] += 0.4
    assert reader.load(changed(path, t=times)).rate_hz == pytest.approx(10.0)


def test_another_sensor_s_recording_is_refused(tmp_path: Path) -> None:
    shipped = bundle.read(bundle.default_path(10.0))
    path = record(tmp_path / "one.npz")
    other = changed(path, frames=FRAMES[:, :4].copy(), meta=meta(rows=4))
    with pytest.raises(RecordingError, match="4×5 sensor, the bundle for 5×5"):
        refuse_misfit(reader.load(other), shipped.settings)


def test_marks_stand_in_order_of_time_and_say_anything(tmp_path: Path) -> None:
    marks = {"mark_kind": np.array(["cue", "note"]), "mark_text": np.array(["go", "a, b\n\x07ü"])}
    path = changed(record(tmp_path / "one.npz"), mark_t=np.array([0.5, 0.5]), **marks)
    assert reader.load(path).marks == (Mark(0.5, "cue", "go"), Mark(0.5, "note", "a, b\n\x07ü"))
    with pytest.raises(RecordingError, match="marks that are not in order of time"):
        reader.load(changed(path, mark_t=np.array([0.5, 0.4])))


def test_a_survey_finds_what_a_glance_can(tmp_path: Path) -> None:
    path = record(tmp_path / "one.npz")
    found = reader.survey(path)
    assert (found.path, found.frames, found.origin) == (path, 30, reader.load(path).origin)
    assert found.seconds == pytest.approx(2.9)
    for arrays in ({"t": TIMES[::-1].copy()}, {"frames": FRAMES[:, :4]}, {"meta": None}):
        with pytest.raises(RecordingError):
            reader.survey(changed(record(tmp_path / "bad.npz"), **arrays))
        (tmp_path / "bad.npz").unlink()
