"""Teaching sessions, from the first cue to the recording; a scripted hand does what it is told."""

import shutil
import textwrap
from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.bundles import vocabulary
from controller.recordings import reader
from controller.simulator.hand import gesture_file
from tests.support import ROOT

FAST = ("teach", "--sensor", "virtual")


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A folder with the example: the paper's gestures and a knock."""
    return Path(shutil.copytree(ROOT / "examples" / "knock", tmp_path / "mine"))


def spans(column: np.ndarray, number: int) -> int:
    """How often a label is said."""
    return int((np.diff((column == number).astype(int), prepend=0) == 1).sum())


def test_a_scripted_hand_is_taught_gestures(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    who = ("--out", str(mine), "--user", "ada", "--session", "1", "--repetitions", "2")
    assert main([*FAST, *who]) == 0
    printed = capsys.readouterr()
    path = mine / "sub-ada_ses-1_run-01.npz"
    assert printed.out.splitlines() == [str(path)]
    assert "  knock: 2 examples\n" in printed.err
    assert f"models train {mine} --out mine.orb" in printed.err
    taught = reader.load(path)
    labels = taught.origin.labels
    assert labels == ("null", "press", "pinch", "twist_cw", "twist_ccw", "knock")
    about = taught.origin
    assert (about.user, about.session, about.protocol) == ("ada", "1", "gestures")
    assert (about.rate_hz, about.bundle, taught.commands) == (40.0, "", ())
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
    once = ("--session", "1", "--repetitions", "1")  # the session draws the hand
    assert main([*FAST, "--out", str(out), "--places", *once]) == 0
    (path,) = out.glob("*.npz")
    taught = reader.load(path)
    asked = [m for m in taught.marks if m.text.startswith("go press at ")]
    assert len(asked) == 25 + 16
    away = []
    for mark in asked:
        x, y = (float(part) for part in mark.text.rpartition(" ")[2].split(","))
        inside = (taught.t > mark.t_s) & (taught.t < mark.t_s + 2.0) & (taught.label == 1)
        image = taught.frames[inside].mean(axis=0) / taught.rest
        row, column = np.unravel_index(int(image.argmin()), image.shape)
        away.append(np.hypot(column - x, 4 - row - y))
    assert np.median(away) < 0.8  # of presses between four taxels one of the four is lowest


def test_any_rate_and_quality_is_taught(mine: Path) -> None:
    spec = "virtual:preset=paper-snr,seed=4"
    who = ("--user", "ada", "--session", "1", "--repetitions", "1")
    assert main(["teach", "--sensor", spec, "--out", str(mine), *who]) == 0
    about = reader.load(mine / "sub-ada_ses-1_run-01.npz").origin
    assert (about.device_id, about.preset, about.user) == ("virtual-4", "paper-snr", "ada")


@pytest.mark.parametrize(
    ("argv", "complaint"),
    [
        (["--sensor", "knob"], "there is no sensor 'knob'"),
        (["--sensor", "virtual:preset=best"], "'best'"),
        (["--sensor", "virtual:fault=rust"], "rust"),
        (["--user", "a/b"], "must be 1 to 64 letters"),
        (["--add", "wave", "--bundle", "absent.orb"], "absent.orb"),
        (["--command", "hold"], "--command and --bundle are for the gesture that --add names"),
    ],
)
def test_a_mistake_is_one_sentence(
    tmp_path: Path, argv: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["teach", "--out", str(tmp_path / "out"), *argv]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("controller: ")
    assert complaint in line


def test_the_hand_must_know_cues(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wave = tmp_path / "gestures.toml"
    wave.write_text('[[gesture]]\nlabel = "wave"\n')
    assert main([*FAST, "--out", str(tmp_path)]) == 2
    assert "hand cannot do 'wave'; write file = \"wave.toml\"" in capsys.readouterr().err
    wave.write_text('[[gesture]]\nlabel = "brush"\n')  # which ships, but is no gesture
    assert main([*FAST, "--out", str(tmp_path)]) == 2


def test_a_folder_that_cannot_be_made_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main([*FAST, "--out", str(tmp_path / "file" / "data")]) in (1, 2)
    assert "cannot write into" in capsys.readouterr().err


def test_the_example_is_a_vocabulary_whose_new_gesture_the_hand_can_do() -> None:
    words = vocabulary.read(ROOT / "examples" / "knock" / "gestures.toml")
    assert words.labels == (*vocabulary.shipped().labels, "knock")
    assert words.mapping.command("knock", None) == "hold"
    assert "knock" in gesture_file.load(words.files)
    knock = (ROOT / "examples" / "knock" / "knock.toml").read_text(encoding="utf-8")
    body = knock.partition("\n\n")[2]
    whole = (ROOT / "docs" / "gestures.md").read_text(encoding="utf-8")
    assert textwrap.indent(f"```toml\n{body}```", "    ") in whole


def test_the_vocabulary_in_the_documentation_is_one() -> None:
    whole = (ROOT / "docs" / "teach-terminal.md").read_text(encoding="utf-8")
    text = whole.partition("```toml\n")[2].partition("```")[0]
    words = vocabulary.parse(text, "docs/teach-terminal.md", Path())
    assert (words.labels, words.located) == (("null", "press", "knock"), ("press",))
    assert words.mapping.command("knock", None) == "hold"
