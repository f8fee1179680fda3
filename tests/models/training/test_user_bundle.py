"""People: what tells them apart, how it is judged, and what one command makes of recordings."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.pytest_types import Capture

pytest.importorskip("torch", reason="needs the [train] extra")

import torch

from controller.adapt import process
from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.user_id import Users
from models.__main__ import main
from models.data.augment import vary_user_windows
from models.data.recipe import UNVARIED_USER, VARIED_USER
from models.evaluation import user_metrics
from models.training.user_task import AFTER, UserGestures
from tests.support.model_commands import examples, refused

pytestmark = pytest.mark.train

TWO = Users(("ann", "bob"), ("press",), temperature=1.0, accept=0.9, stay=0.98, forget_s=9.0)


# --- gestures and their windows -------------------------------------------------------------------


def test_a_gesture_has_the_windows_of_its_frames_and_of_the_rest_behind_it() -> None:
    touched = UserGestures.of(
        examples([0] * 5 + [1] * 3 + [0] * 9 + [2] * 2 + [0] * 2, window=3), [1, 2]
    )
    assert touched.label.tolist() == [1, 2]
    assert touched.ends[touched.event == 0].tolist() == list(range(5, 8 + AFTER))
    assert touched.ends[touched.event == 1].tolist() == [17, 18, 19, 20]  # the recording's end


def test_gestures_in_a_row_share_no_window_and_sessions_part_them() -> None:
    label = [0, 0, 0, 1, 1, 0, 2, 2, 2, 2, 0]
    touched = UserGestures.of(examples(label, [0] * 8 + [1] * 3, window=3), [1, 2])
    assert touched.label.tolist() == [1, 2, 2]
    assert touched.session.tolist() == [0, 0, 1]
    assert touched.ends.tolist() == [3, 4, 5, 6, 7, 8, 9, 10]
    assert touched.event.tolist() == [0, 0, 0, 1, 1, 2, 2, 2]
    assert touched.some(np.zeros(3, dtype=np.bool_)).ends.tolist() == []


def test_longer_windows_never_reach_into_another_recording() -> None:
    touched = UserGestures.of(
        examples([0] * 3 + [1] * 3 + [0, 1, 1, 1], [0] * 6 + [1] * 4, window=3), [1]
    )
    longer = touched.longer(np.array([8]), 2)
    assert longer[0, :, 0, 0].tolist() == [6.0, 6.0, 6.0, 7.0, 8.0]


# --- augmentation ---------------------------------------------------------------------------------


def test_no_variation_changes_nothing_and_another_keeps_what_is_there() -> None:
    windows = torch.rand(4, 13, 5, 5, generator=torch.Generator().manual_seed(1)) + 0.5
    generator = torch.Generator().manual_seed(0)
    assert torch.allclose(
        vary_user_windows(UNVARIED_USER, windows, 10, generator), windows[:, 3:], atol=1e-6
    )
    varied = vary_user_windows(VARIED_USER, windows, 10, generator)
    assert varied.shape == (4, 10, 5, 5)
    rest = torch.ones(64, 13, 5, 5)
    varied = vary_user_windows(VARIED_USER, rest, 10, generator)
    assert float((varied - 1.0).abs().max()) < 0.05  # offset and noise


# --- judgement ------------------------------------------------------------------------------------


def test_rows_of_gestures_stay_within_a_session_and_add_up() -> None:
    said = np.log(np.array([[0.2, 0.6, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6]]))
    session = np.array([0, 0, 1])
    assert user_metrics.beliefs(said, session, TWO, 2)[1].tolist() == [0]
    who = np.array([1, 1, 2])
    assert user_metrics.share(said, who, session, TWO).value == 1.0
    assert (
        user_metrics.beliefs(said, session, TWO, 2)[0][0, 1]
        > user_metrics.beliefs(said, session, TWO, 1)[0][0, 1]
    )


def test_acceptance_lets_no_more_strangers_in_than_was_asked() -> None:
    strange = np.array([[0.05, 0.85, 0.1]] * 10 + [[0.9, 0.05, 0.05]] * 90)
    assert user_metrics.acceptance(strange, 0.2) == 0.7
    assert user_metrics.acceptance(strange, 0.05) == 0.9
    assert user_metrics.acceptance(strange[:0], 0.05) == 0.9


# --- one command ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two short sessions of two people, and one of two strangers."""
    out = tmp_path_factory.mktemp("people")
    for name, seed, sessions in (("us", "4", "2"), ("others", "5", "1")):
        small = ["--users", "2", "--sessions", sessions, "--minutes", "1", "--seed", seed]
        small += ["--gestures", "twist_cw", "--workers", "1"]
        assert main(["simulate", "--out", str(out / name), *small]) == 0
    return out


def asked(data: Path, out: Path, *words: str) -> list[str]:
    return ["train", f"{data}/us", "--task", "user", "--epochs", "1", "--out", str(out), *words]


def train(data: Path, out: Path, *words: str) -> int:
    return main(asked(data, out, *words))


def test_recordings_of_people_become_a_bundle_that_knows_them(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "family.orb"
    assert train(data, out, "--others", str(data / "others")) == 0
    known = bundle.read(out)
    assert known.users.names == ("01", "02")
    assert known.users.gestures == ("twist_cw",)
    who = Recognizer(known).people(known.golden.windows[0])  # the golden answers are replayed
    assert who is not None
    assert who.shape == (3,)
    shipped = bundle.read(bundle.default_path())
    assert known.embedding_onnx == shipped.embedding_onnx
    assert known.labels == shipped.labels
    told = json.loads(out.with_suffix(".json").read_text())
    assert told["strangers"] == 1
    assert set(told["seen"]) == {"1", "2", "3", "5"}
    assert "locks nothing" in out.with_suffix(".md").read_text()
    light = process.set_strength(out.read_bytes(), 0.4, "01")
    bundle.write(out, manifest=light.manifest, parts=light.parts)
    again = tmp_path / "again.orb"
    assert train(data, again, "--others", str(data / "others"), "--with", str(out)) == 0
    assert bundle.read(again).users.names == ("01", "02")
    assert bundle.read(again).users.strengths == {"01": 0.4}


def test_what_leaks_is_refused(data: Path, tmp_path: Path, capsys: Capture) -> None:
    out = tmp_path / "x.orb"
    us, others = str(data / "us"), str(data / "others")
    assert "--split is not for people" in refused(capsys, *asked(data, out, "--split", "time"))
    plain = ("--task", "user", "--out", out)
    assert "learn that day, not 01" in refused(capsys, "train", others, *plain)
    known = f"{us}/sub-01_ses-01_run-01.npz"
    assert "among the others as well" in refused(capsys, *asked(data, out, "--others", known))
    assert "there is no gesture 'wave'" in refused(capsys, *asked(data, out, "--gestures", "wave"))
    assert "add --task user" in refused(capsys, "train", us, "--others", others, "--out", out)
    assert not out.exists()


def test_what_cannot_be_learned_is_told_first(data: Path, tmp_path: Path, capsys: Capture) -> None:
    out, empty = tmp_path / "x.orb", tmp_path / "empty"
    empty.mkdir()
    assert "empty holds nothing" in refused(capsys, *asked(data, out, "--others", str(empty)))
    told = refused(capsys, *asked(data, out, "--others", str(data / "us")))
    assert "all recordings are of --others" in told
    small = ["--users", "2", "--minutes", "1", "--gestures", "twist_cw,swipe", "--workers", "1"]
    assert main(["simulate", "--out", str(tmp_path / "new"), *small]) == 0
    assert main(["train", str(tmp_path / "new"), "--task", "user", "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert "the bundle does not know swipe; train its gestures on such recordings first" in said


def test_one_person_can_be_told_from_strangers(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "me.orb"
    mine = [str(path) for path in sorted((data / "us").glob("sub-01*.npz"))]
    words = ["--task", "user", "--epochs", "1", "--out", str(out)]
    assert main(["train", *mine, *words]) == 2  # from whom?
    assert main(["train", *mine, *words, "--others", str(data / "others")]) == 0
    assert bundle.read(out).users.names == ("01",)
    card = out.with_suffix(".md").read_text()
    assert card.startswith("# me.orb: 1 person\n")
    assert "how strangers fare" in card
