"""Tables of other sensors: CSV becomes recordings, without code."""

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controller.recordings import importer
from controller.recordings.description import Description
from controller.recordings.recording import RecordingError

TOLD = Description(
    frames="c*", unit="counts", pitch_mm=5.0, rows=2, columns=2, time="t", label="task",
    label_names="tasks", null="at_rest", subject="who",
)  # fmt: skip
FRAMES = np.arange(24).reshape(6, 4) / 4.0
TASKS = ["at rest", "at rest", "tap", "tap", "long hold", "at rest"]


def table(delimiter: str = ",", decimal: str = ".") -> str:
    """A line for each frame."""
    text = io.StringIO()
    lines = csv.writer(text, delimiter=delimiter)
    lines.writerow(["t", "c0", "c1", "c2", "c3", "task", "who"])
    for i, (frame, task) in enumerate(zip(FRAMES.tolist(), TASKS, strict=True)):
        numbers = [str(number).replace(".", decimal) for number in (i / 10, *frame)]
        lines.writerow([*numbers, task, "ada"])
    return text.getvalue()


def written(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [table(), table(";", ","), table("\t"), "\ufeff" + table()],
    ids=["commas", "decimal commas", "tabs", "byte order mark"],
)
def test_a_table_becomes_a_recording(tmp_path: Path, text: str) -> None:
    path = written(tmp_path, text)
    [made] = importer.recordings(importer.read(path, TOLD), TOLD)
    assert np.array_equal(made.frames, FRAMES.reshape(6, 2, 2))
    assert made.t.tolist() == pytest.approx(np.arange(6) / 10)
    assert made.origin.labels == ("null", "long_hold", "tap")
    assert made.label.tolist() == [0, 0, 2, 2, 1, 0]
    assert made.origin.user == "ada"


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("c1,", "c0,", "has the column 'c0' twice; rename one"),
        ("0.2,2.0,", "0.2,", "line 4: 6 cells, the header has 7; fill or remove the line"),
        ("0.2,2.0,", "0.2,nan,", "line 4, column 'c0': 'nan' is no number; fill it, or remove"),
        ("0.2,2.0,", "0.2,,", "line 4, column 'c0': '' is no number"),
        ("0.2,2.0,", '0.2,"2,0",', "line 4, column 'c0': '2,0' is no number"),
        ("who", "person", "has no column 'who', which the description names; it has t, c0"),
        ("c", "x", "has 0 columns like frames = 'c\\*'; expected is a pattern"),
    ],
)
def test_an_unfit_table_is_refused_with_its_place(
    tmp_path: Path, old: str, new: str, complaint: str
) -> None:
    path = written(tmp_path, table().replace(old, new))
    with pytest.raises(RecordingError, match=complaint):
        importer.read(path, TOLD)


@pytest.mark.parametrize("text", ["", "t,c0\n"])
def test_a_table_without_frames_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(RecordingError, match="no line under its header"):
        importer.read(written(tmp_path, text), TOLD)


def test_taxels_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    lines = ["t,r1c0,r0c10,r0c9,r1c1", *(f"{i / 10},{30 + i},20,{10},40" for i in range(3))]
    told = replace(TOLD, frames="r*c*", label="", label_names=(), null="", subject="")
    path = written(tmp_path, "\n".join(lines))
    assert importer.read(path, told)["r*c*"][0].tolist() == [10.0, 20.0, 30.0, 40.0]


def test_an_empty_label_is_unknown(tmp_path: Path) -> None:
    path = written(tmp_path, table().replace("long hold", ""))
    [made] = importer.recordings(importer.read(path, TOLD), TOLD)
    assert made.origin.labels == ("null", "tap")
    assert made.label.tolist() == [0, 0, 1, 1, -1, 0]


def test_one_frame_has_no_rate(tmp_path: Path) -> None:
    path = written(tmp_path, "".join(table().splitlines(keepends=True)[:2]))
    with pytest.raises(RecordingError, match="the rate is unknown; give rate_hz"):
        list(importer.recordings(importer.read(path, TOLD), TOLD))


def test_negative_capacitances_are_refused(tmp_path: Path) -> None:
    arrays = importer.read(written(tmp_path, table()), TOLD)
    arrays["c*"] = arrays["c*"] - 3.0
    with pytest.raises(RecordingError, match=r"54% are 0 or below, .* give another unit, such"):
        list(importer.recordings(arrays, replace(TOLD, unit="pF")))
