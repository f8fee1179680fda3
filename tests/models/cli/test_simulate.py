"""`models simulate`: whole data sets, the same bytes however they are made, and kept apart."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from controller.recordings import reader, recording, writer
from controller.simulator.session import TEST_SEEDS
from models.__main__ import main
from models.data import simulate
from models.data.examples import read_training
from models.data.simulate import DataSet
from tests.support.model_commands import refused
from tests.support.pytest_types import Capture, Patch

ONE = ["--users", "1", "--sessions", "1", "--minutes", "0.5"]
SMALL = ["--users", "2", "--sessions", "2", "--minutes", "0.5"]


def make(out: Path, *options: str) -> int:
    """The status of the command with these options."""
    return main(["simulate", "--out", str(out), *options])


def sums(folder: Path) -> dict[str, str]:
    """SHA-256 of every file in a folder, by name."""
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.iterdir())}


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small data set."""
    out = tmp_path_factory.mktemp("data") / "set"
    assert make(out, *SMALL, "--workers", "1") == 0
    return out


def test_a_data_set_has_a_recording_for_each_user_and_session(data: Path) -> None:
    names = [f"sub-{u:02d}_ses-{s:02d}_run-01.npz" for u in (1, 2) for s in (1, 2)]
    assert [path.name for path in sorted(data.iterdir())] == ["dataset.json", *names]
    settings = json.loads((data / "dataset.json").read_text())
    assert (settings["seed"], settings["preset"], settings["pitch_mm"]) == (0, "nominal", 10.0)


def test_people_who_share_an_orb_meet_the_same_taxels_on_other_days(tmp_path: Path) -> None:
    out = tmp_path / "home"
    assert make(out, *SMALL, "--workers", "1", "--one-orb") == 0
    origins = [reader.load(path).origin for path in sorted(out.glob("*.npz"))]
    assert {origin.device_id for origin in origins} == {"simulated-0"}
    shared, apart = (
        [DataSet(minutes=0.5, one_orb=one).session(user, 0).frames[0] for user in (0, 1)]
        for one in (True, False)
    )
    assert not np.array_equal(*shared)  # another day, other drift and noise
    assert np.abs(shared[0] - shared[1]).mean() < 0.5 * np.abs(apart[0] - apart[1]).mean()
    assert make(out, *SMALL, "--workers", "1") == 2  # a data set of other settings


def test_a_recording_says_who_played_and_holds_the_truth(data: Path) -> None:
    loaded = reader.load(data / "sub-02_ses-01_run-01.npz")
    origin = loaded.origin
    assert (origin.user, origin.session, origin.seed) == ("02", "01", 0)
    assert (origin.protocol, origin.preset) == ("free", "nominal")
    assert loaded.frames.shape == (1200, 5, 5)
    assert loaded.rate_hz == pytest.approx(40.0)
    assert set(loaded.button.tolist()) > {0}
    truth = loaded.truth
    assert truth is not None
    assert truth.contact.shape[::2] == (1200, 3)
    for event in truth.events:
        if event.kind in origin.labels:
            inside = (loaded.t >= event.onset_s) & (loaded.t < event.release_s)
            assert set(loaded.label[inside].tolist()) == {origin.labels.index(event.kind)}


def test_any_number_of_processes_writes_the_same_bytes(data: Path, tmp_path: Path) -> None:
    assert make(tmp_path / "two", *SMALL, "--workers", "2") == 0
    assert sums(tmp_path / "two") == sums(data)


def test_data_set_goes_on(data: Path, tmp_path: Path, monkeypatch: Patch, capsys: Capture) -> None:
    out = tmp_path / "set"
    real = writer.pack
    written: list[recording.Recording] = []

    def interrupted(made: recording.Recording) -> bytes:
        if len(written) == 2:
            raise KeyboardInterrupt
        written.append(made)
        return real(made)

    with monkeypatch.context() as patch:
        patch.setattr(writer, "pack", interrupted)
        assert make(out, *SMALL, "--workers", "1") == 130
    assert "the same command goes on from here" in capsys.readouterr().err
    assert len(list(out.iterdir())) == 3
    before = {path.name: path.stat().st_mtime_ns for path in out.iterdir()}
    assert make(out, *SMALL, "--workers", "1") == 0
    assert "2 of 4 recordings are there already" in capsys.readouterr().err
    assert sums(out) == sums(data)
    after = {path.name: path.stat().st_mtime_ns for path in out.iterdir()}
    assert {name: after[name] for name in before} == before  # what was there is kept


def test_users_can_be_added_later_and_do_not_change_the_others(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "set"
    assert make(out, *ONE) == 0
    assert make(out, *SMALL) == 0
    assert sums(out) == sums(data)


def test_grid_rate_protocol_preset_and_gestures_are_options(tmp_path: Path) -> None:
    own = tmp_path / "tap.toml"
    own.write_text(
        'label = "tap"\nphases = [0.1, 0.2, 0.1]\n[path]\ndepth = [0, 6, 6, 0]\n', encoding="utf-8"
    )
    status = make(
        tmp_path / "set",
        *("--users", "1", "--sessions", "1", "--minutes", "2", "--protocol", "blocks"),
        *("--preset", "paper-snr", "--rate", "20", "--grid", "4x6"),
        *("--gestures", f"press,swipe,{own}"),
    )
    assert status == 0
    made = reader.load(tmp_path / "set" / simulate.name(0, 0))
    assert made.frames.shape == (2400, 4, 6)
    assert made.origin.pitch_mm == 8.0  # 40 mm long
    assert made.origin.labels == ("null", "press", "swipe", "tap")
    assert (made.origin.protocol, made.origin.preset) == ("blocks", "paper-snr")
    assert set(made.label.tolist()) == {0, 1, 2, 3}


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--seed", "1"], "holds a data set with other settings"),
        (["--preset", "noisy"], "there is no preset 'noisy'"),
        (["--gestures", "press,wave"], "there is no gesture 'wave'; there are"),
        (["--gestures", "brush"], "there is no gesture 'brush'"),
        (["--gestures", "press,press"], "named twice"),
        (["--gestures", "absent.toml"], "cannot read absent.toml"),
    ],
)
def test_nonsense_is_told(data: Path, options: list[str], sentence: str, capsys: Capture) -> None:
    before = sums(data)
    assert sentence in refused(capsys, "simulate", "--out", data, *SMALL, *options)
    assert sums(data) == before


def test_other_files_are_never_mixed_in(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "mine.npz").write_bytes(b"precious")
    assert "of another origin" in refused(capsys, "simulate", "--out", tmp_path, *SMALL)
    (tmp_path / "file").touch()
    assert "cannot write into" in refused(capsys, "simulate", "--out", tmp_path / "file", *SMALL)


def test_a_damaged_recording_is_told_and_not_replaced(tmp_path: Path, capsys: Capture) -> None:
    assert make(tmp_path / "set", *ONE) == 0
    path = tmp_path / "set" / simulate.name(0, 0)
    path.write_bytes(path.read_bytes()[:-100])
    assert "is damaged; remove it" in refused(capsys, "simulate", "--out", tmp_path / "set", *ONE)


def test_no_training_accepts_a_recording_with_a_test_seed(tmp_path: Path) -> None:
    assert make(tmp_path / "set", *ONE, "--seed", str(TEST_SEEDS.stop - 1)) == 0
    with pytest.raises(ValueError, match=r"run-01\.npz has seed 999999, and seeds 900000"):
        read_training([tmp_path])
