"""Export of a recording: tables that any program reads."""

import csv
import json
from dataclasses import replace

import numpy as np

from controller.recognition.event_metric import Event
from controller.recognition.pipeline import CommandRecord
from controller.recordings import csv_export
from controller.recordings.recording import Mark, SimulatedTruth
from tests.support.recordings import of


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


def test_a_number_is_short_and_still_the_same() -> None:
    rng = np.random.default_rng(5)
    frames = rng.integers(0, 2**32, (200, 2, 2), dtype=np.uint32).view(np.float32)
    frames = np.where(np.abs(frames) < 1e5, frames, np.float32(0.1))
    _, *rows = csv.reader(csv_export.tables(of(frames))[".csv"].splitlines())
    taxels = np.array([row[9:] for row in rows], dtype=np.float32)
    assert taxels.tobytes() == frames.tobytes()
    assert ",0.1," in csv_export.tables(of(np.full((1, 1, 2), 0.1)))[".csv"]
