"""Training: the recipes, and what one command makes of recordings."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support import ROOT
from tests.support.model_commands import refused
from tests.support.pytest_types import Capture, Patch

pytest.importorskip("torch", reason="needs the [train] extra")

from controller.bundles import bundle, vocabulary
from controller.bundles.inference import onnx_reader
from controller.bundles.inference.networks import Recognizer
from controller.recognition.touch_input import TouchInput
from controller.recordings import reader, writer
from controller.simulator.hand import gesture_file
from models.__main__ import main
from models.data import recipe
from models.data.recipe import RECIPES, UNTOUCHED
from models.results import training
from models.training import loop

pytestmark = pytest.mark.train

SHIPPED = vocabulary.shipped()


# --- recipes ----------------------------------------------------------------------------------


def test_the_paper_s_recipe_is_section_4_2_to_the_letter() -> None:
    gesture, location = recipe.PAPER.gesture, recipe.PAPER.location
    assert (gesture.batch, gesture.l2, gesture.epochs) == (150, (5e-4, 1e-5), 500)
    assert (location.batch, location.l2, location.epochs) == (128, (1e-5, 5e-6), 2000)
    assert (location.nesterov, location.clip, location.label_noise) == (True, 10.0, 0.05)
    assert not location.robust  # mean squared error
    assert gesture.augmentation == location.augmentation == UNTOUCHED
    assert location.touch == TouchInput()  # the whole image, as strong as it is
    assert not recipe.PAPER.repair
    settings = recipe.PAPER.settings(10.0, 10)
    assert settings.start_s == 10.0  # C0: the mean of the first ten seconds
    assert min(settings.settle_s, settings.adopt_s) > 1e8  # and never again


def test_the_learning_rate_rises_and_falls_to_nothing() -> None:
    course = recipe.DEFAULT.gesture
    rates = [loop._rate(course, step, 1000) for step in range(1000)]
    assert max(rates) == pytest.approx(course.rate)
    assert rates.index(max(rates)) == 100
    assert rates[0] < 0.05 * course.rate
    assert rates[-1] < 1e-4 * course.rate
    assert loop._rate(recipe.PAPER.gesture, 700, 1000) == 1e-3


# --- one command ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four short sessions of one user."""
    out = tmp_path_factory.mktemp("train") / "data"
    small = ["--users", "1", "--sessions", "4", "--minutes", "1", "--workers", "1"]
    assert main(["simulate", "--out", str(out), *small]) == 0
    return out


def asked(out: Path, *words: str | Path) -> list[str | Path]:
    return ["train", *words, "--epochs", "2", "--out", out]


def train(out: Path, *words: str | Path) -> int:
    return main([str(word) for word in asked(out, *words)])


def test_a_training_from_a_bundle_begins_better_than_from_random(
    data: Path, tmp_path: Path, capsys: Capture
) -> None:
    gestures = data, "--task", "gesture"
    shipped = ROOT / "models" / "orbtouch.orb"
    assert train(tmp_path / "random.orb", *gestures) == 0
    capsys.readouterr()
    assert train(tmp_path / "from.orb", *gestures, "--from", shipped) == 0
    assert "CNN-3D starts from the bundle's conv1, conv2, dense1" in capsys.readouterr().err
    first = {
        name: json.loads((tmp_path / f"{name}.json").read_text())["gesture"]["epochs"][0]["loss"]
        for name in ("random", "from")
    }
    assert first["from"] < 0.5 * first["random"]
    assert bundle.read(tmp_path / "from.orb").card["from"] == bundle.read(shipped).hash[:16]


def test_recordings_become_a_bundle_that_the_device_accepts(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "my.orb"
    assert train(out, data) == 0
    loaded = bundle.read(out)
    Recognizer(loaded)  # replays the golden vectors
    assert (loaded.labels, loaded.locates) == (SHIPPED.labels, True)
    assert loaded.mapping == SHIPPED.mapping
    found = json.loads((tmp_path / "my.json").read_text())
    assert found["labels"] == list(SHIPPED.labels)
    assert [row["held_out"] for row in found["sessions"]].count(True) == 1
    for network in ("gesture", "location"):  # the honest figure and the other, always
        honest = found[network]["honesty"]
        assert honest["unseen"] is not None
        assert honest["random"] is not None
    events = sum(map(sum, found["gesture"]["answered"][1:]))
    card = (tmp_path / "my.md").read_text()
    assert f"of {events} | | |" in card.partition("understood, as in play")[2]
    assert "windows at random, as the paper's protocol" in card
    assert loaded.card["command"] in card
    for drawing in ("gestures", "calibration", "places", "touches"):
        assert f"![my-{drawing}](my-{drawing}.svg)" in card
        assert "</svg>" in (tmp_path / f"my-{drawing}.svg").read_text()
    assert not (tmp_path / "my.orb.training").exists()


def test_on_a_large_grid_positions_are_found_in_a_crop_at_any_strength(tmp_path: Path) -> None:
    folder, out = tmp_path / "data", tmp_path / "my.orb"
    large = "--users 1 --sessions 4 --minutes 1 --workers 1 --rate 10 --gestures press,pinch"
    assert main(["simulate", "--out", str(folder), *large.split(), "--grid=16x20"]) == 0
    assert train(out, folder) == 0
    loaded = bundle.read(out)
    assert loaded.golden.images.shape[1:] == (16, 20)
    assert onnx_reader.read(loaded.location_onnx).shape == (1, 15, 15)
    device = Recognizer(loaded)  # replays the golden vectors
    images = loaded.golden.images
    places = np.array([device.touch(image) for image in images])
    faint = np.array([device.touch(0.5 + 0.5 * image) for image in images])
    np.testing.assert_allclose(faint, places, atol=1e-3)
    assert (places.min(axis=0) >= -0.5).all()
    assert (places.max(axis=0) <= (19.5, 15.5)).all()
    assert json.loads((tmp_path / "my.json").read_text())["location"]["half_strength"] < 1e-3
    assert "– change at half the strength | 0.000" in (tmp_path / "my.md").read_text()


def test_one_person_s_examples_are_all_turned_and_many_people_s_are_not() -> None:
    default, paper = (RECIPES[name].gesture for name in ("default", "paper"))
    assert default.of_people(1).augmentation.turned == 1.0
    assert default.of_people(2) == default
    assert paper.of_people(1) == paper


def test_resuming_is_exact(data: Path, tmp_path: Path, monkeypatch: Patch, capsys: Capture) -> None:
    whole, parts = tmp_path / "whole" / "my.orb", tmp_path / "parts" / "my.orb"
    for out in (whole, parts):
        out.parent.mkdir()
    assert train(whole, data) == 0
    real = loop._Run.epoch
    begun: list[int] = []

    def epoch(self: loop._Run) -> training.Epoch:
        begun.append(1)
        done = real(self)
        if len(begun) in (2, 5):  # in an epoch of each network
            raise KeyboardInterrupt
        return done

    monkeypatch.setattr(loop._Run, "epoch", epoch)
    for _ in range(2):
        assert train(parts, data) == 130
        assert "the same command goes on from here" in capsys.readouterr().err
        assert parts.with_name("my.orb.training").is_dir()
        assert not parts.exists()
    assert main(["train", str(data), "--epochs", "3", "--out", str(parts)]) == 2
    assert "interrupted training of other data or options" in capsys.readouterr().err
    assert train(parts, data) == 0
    assert parts.read_bytes() == whole.read_bytes()
    assert parts.with_suffix(".json").read_text() == whole.with_suffix(".json").read_text()


@pytest.mark.parametrize("trained", ["gesture", "location"])
def test_a_lone_network_borrows_the_shipped_other(trained: str, data: Path, tmp_path: Path) -> None:
    ours = bundle.read(bundle.default_path())
    assert train(tmp_path / "my.orb", data, "--task", trained, "--labels", "button") == 0
    made = bundle.read(tmp_path / "my.orb")
    assert (made.location_onnx == ours.location_onnx) == (trained == "gesture")
    assert (made.embedding_onnx == ours.embedding_onnx) == (trained == "location")
    if trained == "location":
        own = made.labels, made.mapping, made.debounce
        assert own == (ours.labels, ours.mapping, ours.debounce)


def test_auxiliary_gestures_are_no_answers(data: Path, tmp_path: Path, capsys: Capture) -> None:
    more, other = tmp_path / "more", tmp_path / "other"
    small = ["--users", "1", "--sessions", "4", "--minutes", "1", "--workers", "1"]
    for folder, names in ((more, "press,pinch,twist_cw,twist_ccw,swipe"), (other, "swipe,press")):
        assert main(["simulate", "--out", str(folder), *small, "--gestures", names]) == 0
    capsys.readouterr()
    out, gesture = tmp_path / "my.orb", ("--task", "gesture")
    assert "add --task gesture" in refused(capsys, *asked(out, data, "--auxiliary", more))
    assert "begin alike" in refused(capsys, *asked(out, other, *gesture, "--auxiliary", more))
    assert train(out, data, *gesture, "--auxiliary", more) == 0
    made = bundle.read(out)
    Recognizer(made)
    assert (made.labels, made.mapping) == (SHIPPED.labels, SHIPPED.mapping)
    assert made.card["auxiliary"] == "swipe"
    found = json.loads((tmp_path / "my.json").read_text())
    assert found["labels"] == list(SHIPPED.labels)
    assert len(found["sessions"]) == 8
    assert len(found["gesture"]["confusion"]) == len(SHIPPED.labels)
    # The same training without them is another: they were learned.
    assert train(tmp_path / "plain.orb", data, *gesture) == 0
    assert bundle.read(tmp_path / "plain.orb").embedding_onnx != made.embedding_onnx


def test_the_shipped_auxiliary_gestures_are_none_that_few_examples_are_measured_on() -> None:
    folder = ROOT / "models" / "training" / "auxiliary"
    listed = vocabulary.read(folder / vocabulary.FILE)
    own = listed.entries[len(SHIPPED.entries) :]
    assert listed.labels[: len(SHIPPED.labels)] == SHIPPED.labels
    # Those are a double tap, a squeeze and a swipe, which ship, and the knock of the lesson.
    assert not {entry.label for entry in own} & {*gesture_file.shipped(), "knock"}
    assert sorted(entry.file or Path() for entry in own) == sorted(
        path for path in folder.glob("*.toml") if path.name != vocabulary.FILE
    )
    done = gesture_file.load([entry.file for entry in own if entry.file])
    assert {entry.label for entry in own} <= done.keys()


def test_another_grid_rate_unit_and_vocabulary_are_as_good(data: Path, tmp_path: Path) -> None:
    own = tmp_path / "own"
    size = ["--grid", "3x4", "--rate", "20", "--gestures", "press,swipe"]
    small = ["--users", "2", "--sessions", "1", "--minutes", "1", "--workers", "1"]
    assert main(["simulate", "--out", str(own), *size, *small]) == 0
    for path in own.glob("*.npz"):  # a sensor that counts, and reads about 0 untouched
        old = reader.load(path)
        rest = float(old.frames[:10].mean())
        counts = np.rint(300.0 * (old.frames - old.frames[:10].mean(axis=0)))
        origin = replace(old.origin, unit="counts")
        path.write_bytes(writer.pack(replace(old, frames=counts.astype(np.float32), origin=origin)))
    (own / vocabulary.FILE).write_text(
        '[[gesture]]\nlabel = "press"\nlocated = true\ncommand = [\n'
        '{command = "left", left_of = 1.5}, {command = "right"}]\n'
        '[[gesture]]\nlabel = "swipe"\ncommand = "hold"\n'
    )
    assert train(tmp_path / "my.orb", own, "--task", "gesture") == 0
    made = bundle.read(tmp_path / "my.orb")
    assert (made.rows, made.columns, made.window, made.rate_hz) == (3, 4, 20, 20.0)
    assert made.preprocess.normalise == "difference"
    # As if its readings were divided by what they are untouched, as the orb's are.
    assert 0.3 < made.preprocess.scale / (300.0 * rest) < 3.0
    assert not made.locates
    # Nothing tells left from right, so a press does neither.
    assert made.mapping.command("press", None) is None
    assert made.mapping.command("swipe", None) == "hold"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["--split", "windows"],
            "the score would be that of memory; split by session, user, time",
        ),
        (["--split", "user"], "there is only one user; record another, or use --split time"),
        (["--labels", "cue"], "no cue label names a gesture; it has true and button labels"),
        (["--seed", "900001"], "this training has seed 900001"),
        (["--with", "models/orbtouch.orb"], "--with lends a network that is not trained"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(
    words: list[str], sentence: str, data: Path, tmp_path: Path, capsys: Capture
) -> None:
    assert sentence in refused(capsys, *asked(tmp_path / "my.orb", data, *words))
    assert not list(tmp_path.glob("my.*"))


def test_shared_frames_are_on_one_side(data: Path, tmp_path: Path, capsys: Capture) -> None:
    # A copy under another name, user and session is still the same frames.
    only = tmp_path / "twice"
    only.mkdir()
    first = reader.load(sorted(data.glob("*.npz"))[0])
    (only / "a.npz").write_bytes(writer.pack(first))
    other = replace(first, origin=replace(first.origin, user="99", session="99"))
    (only / "b.npz").write_bytes(writer.pack(other))
    error = refused(capsys, *asked(tmp_path / "my.orb", only, "--split", "session"))
    assert "there is only one session" in error


def test_a_bundle_of_another_sensor_or_rate_is_no_start(
    data: Path, tmp_path: Path, capsys: Capture
) -> None:
    slow = ROOT / "models" / "orbtouch-10hz.orb"
    words = asked(tmp_path / "x.orb", data, "--task", "gesture", "--from", slow)
    assert "has windows of 10 images of 5×5 taxels, the recordings 40" in refused(capsys, *words)
