"""`controller teach --add`: a gesture from a few examples, from the cue to the bundle."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import orbtouch as ot
from controller.__main__ import main
from controller.adapt import few_shot
from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recordings import reader
from controller.teach.add_gesture import Session
from tests.support import ROOT

SHIPPED = str(bundle.default_path(10.0))


@pytest.fixture(autouse=True)
def _short_lessons(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(few_shot, "COPIES", 60)


def add(out: Path, *words: str) -> int:
    fast = ("teach", "--bundle", SHIPPED, "--out", str(out), "--session", "1")
    return main([*fast, "--add", *words])


def test_a_squeeze_is_asked_and_learned(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert add(tmp_path, "squeeze", "--command", "hold", "--repetitions", "3") == 0
    told = capsys.readouterr()
    made = tmp_path / "squeeze.orb"
    assert told.out.splitlines() == [str(made)]
    assert "squeeze is learned from 3 examples" in told.err
    assert f"controller install {made}" in told.err
    learned = bundle.read(made)
    assert learned.labels[-1] == "squeeze"
    assert learned.mapping.command("squeeze", None) == "hold"
    assert learned.card["added"] == ["squeeze from 3 examples"]
    Recognizer(learned)
    recorded = reader.load(tmp_path / "squeeze" / "sub-unknown_ses-1_run-01.npz")
    assert recorded.origin.labels == ("null", "squeeze")
    assert [m.text for m in recorded.marks if m.text.startswith("go ")] == ["go squeeze"] * 3


@pytest.mark.slow
def test_a_vocabulary_says_how_a_gesture_is_done_and_what_it_asks_for(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples" / "knock", tmp_path, dirs_exist_ok=True)
    words = ("knock", "--repetitions", "1")
    assert add(tmp_path, *words) == 0
    learned = bundle.read(tmp_path / "knock.orb")
    assert learned.mapping.command("knock", None) == "hold"
    assert add(tmp_path, *words) == 0  # and again, beside it
    assert bundle.read(tmp_path / "knock-2.orb").labels == learned.labels


def test_a_users_own_pinch_is_learned(tmp_path: Path) -> None:
    assert add(tmp_path, "pinch", "--user", "ada", "--repetitions", "1") == 0
    learned = bundle.read(tmp_path / "pinch-ada.orb")
    assert list(learned.taught) == ["ada"]
    assert learned.labels == bundle.read(bundle.default_path(10.0)).labels


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("press",), "'press' is known already; --user NAME"),
        (("wave", "--user", "ada"), "a new gesture is everybody's; leave out --user"),
        (("pinch", "--user", "ada", "--command", "hold"), "--command is for new gestures"),
        (("Wave",), "small letters"),
        (("wave",), "the virtual orb's hand cannot do 'wave'"),
        (("squeeze", "--repetitions", "21"), "more than 20"),
    ],
)
def test_what_cannot_be_added_is_refused_in_a_sentence(
    tmp_path: Path, words: tuple[str, ...], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert add(tmp_path, *words) == 2
    told = capsys.readouterr().err
    assert complaint in told
    assert len(told.strip().splitlines()) == 1


def test_what_else_a_recording_shows_of_a_person_is_known_by_its_labels() -> None:
    """Frames of other gestures and of rest, but no window that spans a lost frame."""
    loaded = bundle.read(Path(SHIPPED))
    made = ot.simulate(minutes=0.5, rate_hz=10.0, gestures=("press", "swipe"), seed=4)
    session, swipe = Session.of(loaded, made._source), made.labels == "swipe"
    found = session.stretches("swipe", swipe, made.labels)
    assert {label for label, _ in found} == {"null", "press"}
    assert all(windows.shape[1:] == (10, 5, 5) for _, windows in found)
    lost = replace(session, part=np.arange(len(made)))
    assert lost.stretches("swipe", swipe, made.labels) == []


def test_a_frame_of_another_gesture_is_no_rest_before_an_example() -> None:
    made = ot.simulate(minutes=0.3, rate_hz=10.0, gestures=("swipe",), seed=4)
    session, asked = Session.of(bundle.read(Path(SHIPPED)), made._source), made.labels == "swipe"
    plain = session.examples("swipe", asked, made.labels)
    names = np.where(asked, made.labels, "press")
    bare = session.examples("swipe", asked, names)
    assert all(len(one.images) < len(other.images) for one, other in zip(bare, plain, strict=True))
    assert all(one.span and one.span[0] < 1.0 for one in bare)
