"""Export and import: tables that any program reads, and nothing lost on the way."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from controller import npz
from controller.recognition.event_metric import Event
from controller.recognition.pipeline import CommandRecord
from controller.recordings import csv_export, edit, reader, writer
from controller.recordings.recording import Mark, Recording, RecordingError, SimulatedTruth
from tests.support.recordings import of, origin, recordings, same


def back(recording: Recording) -> Recording:
    """The recording after a way through its tables, as bytes."""
    files = {end: csv_export.encode(text) for end, text in csv_export.tables(recording).items()}

    def content(end: str) -> str:
        return files[f"{end}.csv"].decode("utf-8", "surrogatepass")

    return csv_export.parse(files[".json"].decode(), content, Path("one.json"))


@given(recordings())
def test_what_is_exported_and_imported_is_the_same_recording(recording: Recording) -> None:
    stored = reader.parse(npz.unpack(writer.pack(recording), reader.MAX_BYTES))
    assert same(back(stored), stored)


def test_a_row_says_when_what_and_every_taxel() -> None:
    recording = of(
        [[[41.2, 40.0]], [[0.1, -1.5]]],
        label=[1, -1],
        button=[0, 2],
        excluded=np.array([False, True]),
        touch=np.array([[0.5, 3.0], [np.nan, np.nan]]),
    )
    assert csv_export.tables(recording)[".csv"].splitlines() == [
        "t,sequence,label,button,key,cue,excluded,touch_x,touch_y,c_0_0,c_0_1",
        "0.1,1,press,null,,,0,0.5,3.0,41.2,40.0",
        "0.2,2,,pinch,,,1,,,0.1,-1.5",
    ]


def test_what_is_no_row_of_frames_has_tables_of_its_own() -> None:
    recording = replace(
        of(np.ones((2, 1, 1))),
        marks=(Mark(0.1, "note", 'a comma, a "quote"\nand a line'),),
        commands=(CommandRecord(0.2, 2, "press", 0.98, None, "left"),),
        truth=SimulatedTruth(
            np.zeros((2, 2), dtype=np.float32),
            np.zeros((2, 0, 3), dtype=np.float32),
            (Event(0.1, 0.2, "press"),),
        ),
    )
    files = csv_export.tables(recording)
    assert files["_marks.csv"] == (
        't_s,kind,text\r\n0.1,note,"a comma, a ""quote""\nand a line"\r\n'
    )
    assert files["_commands.csv"].splitlines()[1] == "0.2,2,press,0.98,,,left"
    assert files["_events.csv"].splitlines()[1] == "0.1,0.2,press"
    assert json.loads(files[".json"])["meta"]["rate_hz"] == 10.0


def test_a_label_without_letters_is_not_taken_for_an_unknown_one() -> None:
    recording = of(np.ones((3, 1, 1)), origin(1, 1, labels=("null", "", "?")), label=[-1, 1, 2])
    lines = csv_export.tables(recording)[".csv"].splitlines()
    assert [line.split(",")[2] for line in lines[1:]] == ["??", "", "?"]
    assert back(recording).label.tolist() == [-1, 1, 2]


def test_a_number_is_as_short_as_can_be_and_still_the_same() -> None:
    rng = np.random.default_rng(5)
    frames = rng.integers(0, 2**32, (200, 2, 2), dtype=np.uint32).view(np.float32)
    frames = np.where(np.abs(frames) < 1e5, frames, np.float32(0.1))
    assert back(of(frames)).frames.tobytes() == frames.tobytes()
    assert ",0.1," in csv_export.tables(of(np.full((1, 1, 2), 0.1)))[".csv"]


@pytest.mark.parametrize(
    ("end", "was", "becomes", "complaint"),
    [
        (".json", '"form": 1', '"form": 2', "tables of form 2, this program reads 1"),
        (".json", '"rows": 1', '"rows": 7', "not those of its sensor"),
        (".json", '"rows": 1', '"rows": 1000000000', "impossible things about its origin"),
        (".json", "{", "", "none that this program exported"),
        (".csv", "0.1,1,press", "0.1,1,wave", "none that this program exported"),
        (".csv", "0.1,1,press", "soon,1,press", "none that this program exported"),
        ("_marks.csv", "t_s", "time", "the columns time, kind, text, not t_s, kind, text"),
    ],
)
def test_tables_that_were_changed_beyond_reading_are_refused_with_what(
    tmp_path: Path, end: str, was: str, becomes: str, complaint: str
) -> None:
    files = csv_export.tables(of(np.ones((2, 1, 1)), label=[1, 1]))
    files[end] = files[end].replace(was, becomes, 1)
    for ending, text in files.items():
        (tmp_path / f"one{ending}").write_bytes(csv_export.encode(text))
    with pytest.raises(RecordingError, match=complaint):
        csv_export.read(tmp_path / "one.json")


def test_a_table_that_is_missing_is_named(tmp_path: Path) -> None:
    (tmp_path / "one.json").write_text(csv_export.tables(of(np.ones((2, 1, 1))))[".json"])
    with pytest.raises(RecordingError, match=r"cannot read .*one\.csv: no such file"):
        csv_export.read(tmp_path / "one.json")


def test_numbers_that_no_recording_may_hold_are_refused_before_a_file_is_written() -> None:
    files = csv_export.tables(of(np.ones((2, 1, 1))))
    text = files[".csv"].replace(",1.0", ",1e30")
    tables = {"": text, "_marks": files["_marks.csv"], "_commands": files["_commands.csv"]}
    changed = csv_export.parse(files[".json"], tables.__getitem__, Path("one.json"))
    with pytest.raises(RecordingError, match="the result would be no recording: it holds frames"):
        edit.sealed(changed)
