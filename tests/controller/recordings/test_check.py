"""Is a recording any good? What is broken is named, what is sound is left in peace."""

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controller.recordings import reader, writer
from controller.recordings.quality import check, labels, taxels
from controller.recordings.quality.check import Level, Report
from controller.recordings.recording import Recording
from controller.shared import blocks
from tests.support.recordings import broken, of, origin, played


def report(recording: Recording) -> Report:
    return check.examine(Path("one.npz"), recording)


def complaints(recording: Recording) -> list[str]:
    """What is said against a recording."""
    return [f.text for f in report(recording).findings if f.level is not Level.GOOD]


@pytest.mark.parametrize("preset", ["nominal", "paper-snr"])
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 10))]
)
def test_a_sound_orb_gives_a_good_recording(preset: str, seed: int) -> None:
    assert complaints(played(preset, seed)) == []
    assert report(played(preset, seed)).level is Level.GOOD


def test_seconds_and_events_are_counted_per_class_and_labeller() -> None:
    recording = played()
    assert recording.truth is not None
    true, button = report(recording).said
    assert (true.labeller, button.labeller) == ("label", "button")
    for label in recording.origin.labels[1:]:
        assert true.events[label] == sum(event.kind == label for event in recording.truth.events)
    assert sum(true.seconds.values()) == pytest.approx(120.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        ("dead:2,3", "taxel row 2, column 3: dead"),
        ("dead:0,0", "taxel row 0, column 0: dead"),
        ("leaky:1,1", "taxel row 1, column 1: noisy"),
        ("open_row:1", "row 1: 1 pF where the others read 37; a lead is off"),
        ("open_column:4", "column 4: 1 pF where the others read 37"),
        ("short_row:1", "rows 1 and 2: equal readings"),
        ("short_column:3", "columns 3 and 4: equal readings"),
        ("saturation", "saturated, at 28.83 pF"),
    ],
)
def test_what_is_broken_is_said(fault: str, sentence: str) -> None:
    assert any(sentence in line for line in complaints(broken(fault)))


def test_a_sensor_of_which_a_fifth_is_useless_has_failed() -> None:
    assert report(broken("open_row:1", "open_row:3")).level is Level.FAILED


def test_a_taxel_that_never_changes_is_stuck() -> None:
    frames = played().frames.copy()
    frames[:, 4, 4] = 40.0
    changed = replace(played(), frames=frames)
    assert complaints(changed) == ["taxel row 4, column 4: stuck, always the same reading"]


def test_nobody_can_tell_dead_taxels_where_nothing_touches() -> None:
    quiet = of(np.random.default_rng(1).normal(40, 0.05, (100, 5, 5)), label=np.zeros(100))
    [note] = report(quiet).findings
    assert note.level is Level.GOOD
    assert "touched too little" in note.text


def test_other_sensors_are_judged_in_their_own_unit() -> None:
    # A screen that counts: nothing where nothing touches, a finger is felt in one place only.
    rng = np.random.default_rng(2)
    frames = np.zeros((300, 8, 6))
    touched = (np.arange(300) // 10) % 3 == 1
    for k in np.flatnonzero(touched):
        frames[k, rng.integers(1, 7), rng.integers(1, 5)] = rng.integers(200, 300)
    recording = of(frames, origin(8, 6, unit="counts", sign=1), label=touched)
    assert taxels.respond(recording).touched.tolist() == touched.tolist()
    found = report(recording)
    assert any("so dead ones cannot be detected" in f.text for f in found.findings)
    assert complaints(recording) == []  # the rim is not stuck: nobody has touched it


def test_missing_frames_are_counted_where_their_numbers_are_missing() -> None:
    keep = np.arange(1200) % 12 != 7
    whole = played()
    less = of(whole.frames[keep], t=whole.t[keep], sequence=whole.sequence[keep],
              label=whole.label[keep])  # fmt: skip
    rhythm = labels.measure(less)
    assert (rhythm.missing, rhythm.stretches) == (100, 1)
    assert rhythm.worst_ms == pytest.approx(100.0)
    assert "100 of 1200 frames are missing" in complaints(less)


def test_a_gesture_with_a_missing_frame_in_it_is_one_gesture() -> None:
    keep = np.arange(100) != 55
    whole = of(np.ones((100, 1, 1)), label=(np.arange(100) // 10) == 5)
    less = of(whole.frames[keep], t=whole.t[keep], sequence=whole.sequence[keep],
              label=whole.label[keep])  # fmt: skip
    assert report(less).said[0].events["press"] == 1


def test_a_pause_between_two_stretches_is_no_missing_frame() -> None:
    t = np.concatenate([np.arange(50), 500 + np.arange(50)]) / 10
    sequence = np.concatenate([np.arange(50), 51 + np.arange(50)])
    rhythm = labels.measure(of(np.ones((100, 1, 1)), t=t, sequence=sequence))
    assert (rhythm.missing, rhythm.stretches, rhythm.complaints()) == (0, 2, [])


@pytest.mark.parametrize(
    ("times", "sentence"),
    [
        (np.arange(600) / 9.0, "frames came at 9.00 Hz, 10 % slower than the 10 Hz intended"),
        (np.arange(600) / 10 + 2.0 * (np.arange(600) > 300), "a frame came 2.1 s late"),
    ],
)
def test_a_cadence_that_is_off_is_told(times: np.ndarray, sentence: str) -> None:
    lines = labels.measure(of(np.ones((600, 1, 1)), t=times)).complaints()
    assert any(sentence in line for line in lines), lines


def test_a_cue_may_begin_before_the_touch_and_end_after_it() -> None:
    whole = played()
    wide = np.zeros_like(whole.label)
    for shift in range(-8, 9):
        wide = np.maximum(wide, np.roll(whole.label, shift))
    assert complaints(replace(whole, cue=wide)) == []


def test_labels_in_which_nothing_is_felt_are_told() -> None:
    whole = played()
    rest = whole.frames[:10].mean(axis=0)
    quiet = rest + np.random.default_rng(1).normal(0.0, 0.05, (1200, 5, 5))
    silent = (np.arange(1200) // 300 % 2 == 1)[:, None, None]
    half = replace(whole, frames=np.where(silent, quiet, whole.frames).astype(np.float32))
    assert any("nothing is felt in" in line for line in complaints(half))


def test_frames_that_nobody_labelled_are_told() -> None:
    whole = played()
    nobody = of(whole.frames)
    [text] = complaints(nobody)
    assert text.startswith("100 % of the frames are not labelled; label them with:")


def test_excluded_frames_count_for_nothing() -> None:
    whole = played()
    first = replace(whole, excluded=whole.t <= 90.0)
    assert complaints(first) == ["75 % of the frames are excluded"]
    assert sum(report(first).said[0].seconds.values()) == pytest.approx(30.0)
    nothing = replace(whole, excluded=np.ones(1200, dtype=np.bool_))
    assert report(nothing).level is Level.FAILED


def test_frames_that_a_driver_gave_twice_are_told() -> None:
    frames = np.repeat(played().frames[::2], 2, axis=0)
    assert any("repeat the one before them" in line for line in complaints(of(frames)))


def test_frames_that_stand_in_two_recordings_are_found_wherever_they_stand() -> None:
    whole, other = played(), played(seed=1)
    piece = of(whole.frames[300:500])
    register = check.FrameIndex()
    for recording in (whole, other, piece):
        register.add(recording)
    assert register.shared() == {0: {2: 200}, 2: {0: 200}}


def test_an_untouched_counter_is_no_duplicate_of_another() -> None:
    register = check.FrameIndex()
    for _ in range(2):
        register.add(of(np.zeros((100, 3, 3))))
    assert register.shared() == {}


@pytest.mark.parametrize(
    "frames",
    [
        np.zeros((50, 5, 5)),
        np.full((1, 5, 5), 40.0),
        np.full((2, 1, 1), -3.0),
        np.where(np.arange(50)[:, None, None] % 2, 1e5, -1e5) * np.ones((5, 5)),
        np.random.default_rng(3).normal(0.0, 1.0, (400, 1, 7)),
    ],
)
@pytest.mark.parametrize("unit", ["pF", "counts"])
def test_whatever_a_sensor_reads_it_gets_a_verdict(frames: np.ndarray, unit: str) -> None:
    said = np.arange(len(frames)) % 3
    rows, columns = frames.shape[1:]
    found = report(of(frames, origin(rows, columns, unit=unit), label=said))
    assert found.level in Level


@pytest.mark.parametrize("unit", ["pF", "counts"])
def test_a_recording_is_judged_alike_in_memory_and_block_by_block(
    unit: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames = played().frames.copy()
    frames[:, 1, 2] = frames[:, 4, 4]  # dead, but not stuck
    frames[400:600:2] = frames[401:601:2]  # repeated
    one = replace(played(), frames=frames, origin=replace(played().origin, unit=unit))
    path = tmp_path / "one.npz"
    path.write_bytes(writer.pack(one))
    whole = check.examine(path, one)
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 100 * 70)  # 70 frames
    assert check.examine(path, reader.load(path, mapped=True)) == whole
    assert whole.findings


def test_memory_does_not_grow_with_the_frames_of_a_mapped_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    noise = np.random.default_rng(4).normal(40.0, 0.05, (8000, 8, 8))
    touched = (np.arange(8000) // 20 % 3 == 2)[:, None, None]
    path = tmp_path / "long.npz"
    path.write_bytes(writer.pack(of(noise - 4.0 * touched)))
    size = noise.size * np.dtype(np.float32).itemsize
    monkeypatch.setattr(blocks, "BLOCK_BYTES", size // 50)
    tracemalloc.start()
    try:
        check.examine(path, reader.load(path, mapped=True))
        assert tracemalloc.get_traced_memory()[1] < size / 2
    finally:
        tracemalloc.stop()
