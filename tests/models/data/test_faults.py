"""Faults put into a recording afterwards are as if they had been there from the first frame."""

from pathlib import Path

import numpy as np
import pytest

from controller.bundles import bundle
from controller.recordings import writer
from controller.recordings.quality.taxels import respond
from controller.simulator.dome.faults import KINDS, Fault
from models.__main__ import main
from models.data import test_sessions as faults
from tests.support.pytest_types import Capture
from tests.support.recordings import broken, of, played


def test_a_dead_taxel_reads_as_if_nothing_touched_and_no_other_taxel_changes() -> None:
    recording = played()
    touched = respond(recording).touched
    dead = faults.broken(recording, Fault.parse("dead:2,2"))
    others = np.ones((5, 5), dtype=np.bool_)
    others[2, 2] = False
    assert (dead.frames[:, others] == recording.frames[:, others]).all()
    assert (dead.frames[~touched] == recording.frames[~touched]).all()
    calm = recording.frames[~touched][:, 2, 2]
    assert np.isin(dead.frames[touched][:, 2, 2], calm).all()
    felt = np.abs(respond(recording).change[touched][:, 2, 2]).max()
    left = np.abs(respond(dead).change[touched][:, 2, 2]).max()
    assert left < 0.15 * felt


def test_it_reads_as_the_simulated_fault_does() -> None:
    simulated = broken("dead:1,3")
    edited = faults.broken(broken(), Fault.parse("dead:1,3"))
    spread = [np.abs(respond(r).change[:, 1, 3]).mean() for r in (simulated, edited, broken())]
    assert abs(spread[1] - spread[0]) < 0.1 * (spread[2] - spread[0])


def test_a_dead_electrode_takes_its_whole_line_with_it() -> None:
    recording = played()
    touched = respond(recording).touched
    row = faults.broken(recording, Fault.parse("open_row:1"))
    assert (row.frames[:, [0, 2, 3, 4]] == recording.frames[:, [0, 2, 3, 4]]).all()
    assert (row.frames[touched][:, 1] != recording.frames[touched][:, 1]).mean() > 0.9
    column = faults.broken(recording, Fault.parse("open_column:4"))
    assert (column.frames[:, :, :4] == recording.frames[:, :, :4]).all()


def test_what_frames_cannot_tell_is_refused_or_changes_nothing() -> None:
    still = of(np.full((40, 2, 2), 40.0))
    assert (faults.broken(still, Fault.parse("dead:0,0", 2, 2)).frames == still.frames).all()
    with pytest.raises(ValueError, match="mains"):
        faults.broken(played(), Fault.parse("mains"))


@pytest.mark.parametrize("grid", [(5, 5), (2, 3), (8, 4)])
def test_every_fault_is_tried_once_and_is_on_the_grid(grid: tuple[int, int]) -> None:
    rows, columns = grid
    every = [*faults.taxels(*grid), *faults.electrodes(*grid), *faults.others(*grid)]
    assert len(faults.taxels(*grid)) == rows * columns
    assert len(faults.electrodes(*grid)) == rows + columns
    parsed = [Fault.parse(fault, *grid) for fault in every]
    assert {fault.kind for fault in parsed} == set(KINDS)
    assert len(set(every)) == len(every)
    assert all(faults.meaning(fault) for fault in every)


def test_a_bundle_is_judged_with_each_taxel_or_line_dead(tmp_path: Path, capsys: Capture) -> None:
    writer.write_beside(tmp_path / "one.npz", writer.pack(played("nominal", minutes=0.5)))
    command = ["evaluate", str(bundle.default_path(10.0)), str(tmp_path), "--broken"]
    assert main([*command, "--json", str(tmp_path / "x.json")]) == 0
    card = capsys.readouterr().out
    assert "| dead:4,4 | a taxel does not react |" in card
    assert "| open_column:4 |" in card


def test_without_recordings_new_people_are_simulated(capsys: Capture) -> None:
    assert main(["evaluate", "--sessions", "2", "--minutes", "0.5"]) == 0
    card = capsys.readouterr().out
    assert "| figure | nominal | paper-snr |" in card
    assert "| sessions, users | 2, 2 | 2, 2 |" in card
