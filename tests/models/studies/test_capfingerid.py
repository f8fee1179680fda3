"""CapFingerId's text files into arrays: what a line tells, and which lines are taken."""

from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks import people_gather as gather

COUNTS = ",".join(str(i % 7 - 2) for i in range(405))
LINE = f"5;right;index;SCROLL;-1;1509375977,65966329,{COUNTS},\n"


def test_nanoseconds_are_a_number_not_digits_behind_a_point() -> None:
    one = gather.parse(LINE)
    assert one is not None
    *what, t_s, counts = one
    assert what == [5, 1, 0, 2]  # person, hand, finger, task
    assert t_s == pytest.approx(1509375977.065966329, abs=1e-6)
    assert counts.shape == (27, 15)
    assert counts[0, :4].tolist() == [-2, -1, 0, 1]


@pytest.mark.parametrize("line", [LINE[:-30], "", LINE.replace("SCROLL", "WAVE"), "5;right\n"])
def test_a_line_that_is_cut_off_or_says_something_else_is_left_out(line: str) -> None:
    assert gather.parse(line) is None


def test_the_first_frames_of_each_task_are_taken_and_pauses_are_not(tmp_path: Path) -> None:
    lines = [LINE] * 3 + [LINE.replace("SCROLL", "PAUSE")] + [LINE.replace("SCROLL", "TAP")] * 3
    (tmp_path / "CapMatrix_P5_index_right.txt").write_text("".join(lines))
    out = tmp_path / "frames.npz"
    assert gather.main([str(tmp_path), str(out), "--frames", "2"]) == 0
    with np.load(out) as found:
        assert found["task"].tolist() == [2, 2, 3, 3]
        assert found["frames"].shape == (4, 27, 15)
        assert found["hand_names"][found["hand"][0]] == "right"
    assert gather.main([str(tmp_path / "nowhere"), str(out)]) == 2
