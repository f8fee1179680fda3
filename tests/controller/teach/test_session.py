"""Teaching sessions, from the first cue to the recording; a scripted hand does what it is told."""

from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.bundles import bundle, vocabulary
from controller.recordings import reader
from controller.teach import dataset_folder

FAST = ("teach", "--sensor", "virtual", "--speed", "0")


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A folder with the example: the paper's gestures and a knock."""
    dataset_folder.example(tmp_path / "mine")
    return tmp_path / "mine"


def spans(column: np.ndarray, number: int) -> int:
    """How often a label is said."""
    return int((np.diff((column == number).astype(int), prepend=0) == 1).sum())


def test_a_scripted_hand_is_taught_gestures(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    who = ("--out", str(mine), "--user", "ada", "--session", "1", "--repetitions", "2")
    assert main([*FAST, *who]) == 0
    printed = capsys.readouterr()
    path = mine / "sub-ada_ses-1_run-01.npz"
    assert printed.out.splitlines() == [str(path)]
    for line in ("knock: enough (2)", "  knock: 2 examples", "models train"):
        assert line in printed.err
    taught = reader.load(path)
    labels = taught.origin.labels
    assert labels == ("null", "press", "pinch", "twist_cw", "twist_ccw", "knock")
    about = taught.origin
    assert (about.user, about.session, about.protocol) == ("ada", "1", "gestures")
    assert about.bundle == bundle.read(bundle.default_path()).hash
    assert [spans(taught.label, number) for number in range(1, 6)] == [2] * 5
    for number in range(1, 6):
        done = taught.label == number
        assert (taught.cue[done] == number).mean() > 0.8  # the hand does it while it is asked for
    asked = [mark.text for mark in taught.marks if mark.text.startswith("go ")]
    assert sorted(asked) == sorted(f"go {label}" for label in labels for _ in range(2))
    assert not taught.excluded.any()
    assert taught.rest is not None
    z = np.abs(taught.frames / taught.rest - 1.0).mean(axis=(1, 2))
    strays = [m.t_s for m in taught.marks if m.text == "go null"]
    felt = [z[(taught.t >= t) & (taught.t < t + 2)].max() for t in strays]
    assert min(felt) > 0.02  # "nothing" is not silence: it touches, but makes no gesture


def test_no_session_repeats_another_and_no_file_is_replaced(mine: Path) -> None:
    again = [*FAST, "--out", str(mine), "--session", "1", "--repetitions", "1"]
    assert main(again) == main(again) == 0
    first, second = (reader.load(mine / f"sub-unknown_ses-1_run-0{n}.npz") for n in (1, 2))
    size = min(len(first.frames), len(second.frames))
    assert (first.frames[:size] != second.frames[:size]).mean() > 0.9
    assert first.origin.device_id == second.origin.device_id  # it is the same orb on another day
    assert first.rest is not None
    assert second.rest is not None
    assert np.abs(first.rest / second.rest - 1.0).max() < 0.1
    orders = [[m.text for m in one.marks if m.text.startswith("go ")] for one in (first, second)]
    assert orders[0] != orders[1]


@pytest.mark.slow
def test_places_are_pressed_where_they_were_asked_for(tmp_path: Path) -> None:
    out = tmp_path / "places"
    assert main([*FAST, "--out", str(out), "--protocol", "locations", "--repetitions", "1"]) == 0
    (path,) = out.glob("*.npz")
    taught = reader.load(path)
    asked = [m for m in taught.marks if m.text.startswith("go press at ")]
    assert len(asked) == 25 + 16
    away = []
    for mark in asked:
        x, y = (float(part) for part in mark.text.rpartition(" ")[2].split(","))
        inside = (taught.t > mark.t_s) & (taught.t < mark.t_s + 2.0) & (taught.label == 1)
        away.append(np.hypot(*(np.nanmedian(taught.touch[inside], axis=0) - (x, y))))
    assert np.median(away) < 0.35  # the hand aims within 1 to 2 mm of 10
    assert vocabulary.read(out / "gestures.toml").entries == vocabulary.shipped().entries


def test_users_take_turns_with_own_hand(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "all"
    who = ("--protocol", "users", "--user", "ada,ben", "--session", "1", "--repetitions", "1")
    assert main([*FAST, "--out", str(out), *who]) == 0
    names = ["sub-ada_ses-1_run-01.npz", "sub-ben_ses-1_run-01.npz"]
    printed = capsys.readouterr()
    assert [Path(line).name for line in printed.out.splitlines()] == names
    assert "ben: take a seat" in printed.err
    one, other = (reader.load(out / name) for name in names)
    assert (one.origin.user, other.origin.user) == ("ada", "ben")
    assert one.origin.device_id == other.origin.device_id


def test_teaching_needs_no_model_of_sensor(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    who = ("--out", str(mine), "--session", "1", "--repetitions", "1", "--rate", "20")
    assert main([*FAST, *who]) == 0
    assert "there is no model for this sensor yet" in capsys.readouterr().err
    taught = reader.load(mine / "sub-unknown_ses-1_run-01.npz")
    assert (taught.origin.rate_hz, taught.origin.bundle) == (20.0, "")
    assert not taught.commands
    assert spans(taught.label, 5) == 1


@pytest.mark.parametrize(
    ("argv", "complaint"),
    [
        (["--sensor", "knob"], "there is no sensor 'knob'"),
        (["--labels", "absent.toml"], "cannot read absent.toml"),
        (["--preset", "best"], "'best'"),
        (["--user", "a/b"], "must be 1 to 64 letters"),
        (["--user", "ada,ben"], "--protocol users"),
        (["--protocol", "users"], "say who takes turns: --user ada,ben"),
        (["--sensor", "replay", "--speed", "0"], "--speed is for --sensor virtual"),
        (["--bundle", "absent.orb"], "absent.orb"),
        (["--fault", "rust"], "rust"),
    ],
)
def test_a_mistake_is_one_sentence(
    tmp_path: Path, argv: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["teach", "--out", str(tmp_path / "out"), *argv]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("controller: ")
    assert complaint in line


def test_a_named_model_must_fit_sensor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    argv = [*FAST, "--out", str(tmp_path), "--rate", "20", "--bundle", str(bundle.default_path())]
    assert main(argv) == 2
    assert "is for 40 Hz, the sensor has 20 Hz; leave out --bundle" in capsys.readouterr().err


def test_the_hand_must_know_cues(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wave = tmp_path / "wave.toml"
    wave.write_text('[[gesture]]\nlabel = "wave"\n')
    assert main([*FAST, "--out", str(tmp_path / "out"), "--labels", str(wave)]) == 2
    assert "hand cannot do 'wave'; write file = \"wave.toml\"" in capsys.readouterr().err
    wave.write_text('[[gesture]]\nlabel = "brush"\n')  # which ships, but is no gesture
    assert main([*FAST, "--out", str(tmp_path / "out"), "--labels", str(wave)]) == 2
