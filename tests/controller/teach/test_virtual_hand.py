"""The scripted hand of the virtual orb: a user's gestures, other people and other days."""

from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.capture.cues import Cue, Phase
from controller.capture.simulated_hand import CuedHand
from controller.cli.run import parser as grammar
from controller.runtime.assemble import open_device, prepare
from controller.sensors import base as sensors
from controller.sensors.base import SensorError
from controller.sensors.virtual import knows, show
from controller.simulator.virtual_orb import VirtualOrb
from controller.teach import dataset_folder


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A folder with the example: the paper's gestures and a knock."""
    dataset_folder.example(tmp_path / "mine")
    return tmp_path / "mine"


def test_the_virtual_orb_does_a_user_s_gestures(mine: Path) -> None:
    orb = sensors.load("virtual", 10.0, gestures=(mine / "knock.toml",))
    said = set()
    for k in range(1, 100):
        if k % 20 == 0:
            orb.perform(k, "knock", 2.0, 2.0, k / 10)
        orb.read(k / 10)
        said.add((orb.label(k / 10), orb.button(k / 10)))
    assert {label for label, _ in said} == {button for _, button in said} == {"null", "knock"}
    assert {truth.label for truth in orb.truths()} == {"knock"}
    assert knows((mine / "knock.toml",), "knock")
    assert not knows((), "knock")
    with pytest.raises(SensorError, match="cannot read the gesture"):
        sensors.load("virtual", 10.0, gestures=(mine / "absent.toml",))


def test_a_hand_shows_what_it_knows_of_a_bundle(mine: Path) -> None:
    grid = sensors.Geometry(5, 5, 10.0)
    labels = ("null", "press", "knock")

    def shown(*gestures: Path) -> set[str]:
        script = show(labels, grid, 1, gestures)
        return {next(script)[1].label for _ in range(20)}

    assert shown() == {"press"}
    assert shown(mine / "knock.toml") == {"press", "knock"}


def test_where_no_gesture_is_asked_for_a_hand_may_stray() -> None:
    grid = sensors.Geometry(5, 5, 10.0)
    cue = Cue(Phase.GO, "null")
    assert CuedHand(grid, 1).obey(cue, 1.0) is None
    wish = CuedHand(grid, 1, strays=("brush", "rest")).obey(cue, 1.0)
    assert wish is not None
    assert wish[1].label in ("brush", "rest")


def read(orb: VirtualOrb) -> np.ndarray:
    orb.perform(1, "pinch", 2.0, 2.0, 0.5)
    return np.array([orb.read(k / 10) for k in range(1, 20)])


def test_another_day_is_the_same_orb_and_person_with_other_noise_and_mood() -> None:
    days = [VirtualOrb(5, day=day) for day in (0, 1, 2, 2)]
    frames = [read(orb) for orb in days]
    assert (frames[2] == frames[3]).all()
    assert (frames[0] != frames[1]).any()
    assert (frames[1] != frames[2]).any()
    rest = [one[:4].mean(axis=0) for one in frames]
    assert np.abs(rest[1] / rest[0] - 1.0).max() < 0.1
    other = read(VirtualOrb(6))[:4].mean(axis=0)  # another orb was made otherwise
    assert np.abs(other / rest[0] - 1.0).max() > 0.1
    assert days[0].style.left_handed == days[1].style.left_handed
    assert days[0].style.finger_radius == days[1].style.finger_radius
    assert days[0].style.press_depth != days[1].style.press_depth


def test_another_user_has_another_style_on_the_same_orb() -> None:
    ada, ben = VirtualOrb(5, user=1), VirtualOrb(5, user=2)
    assert ada.style.finger_radius != ben.style.finger_radius
    assert (ada.read(0.1) == ben.read(0.1)).all()  # before anybody touches it


def test_the_orb_that_plays_knows_the_gestures_of_a_vocabulary(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = grammar().parse_args(
        ["--labels", str(mine / "gestures.toml"), "--link", "listen://127.0.0.1:0"]
    )
    parts = prepare(options)
    parts.link.close()
    device = open_device(parts, 1)
    assert device.sensor.virtual
    device.sensor.perform(1, "knock", 2.0, 2.0, 1.0)
    device.close()
    assert main(["--labels", str(mine / "absent.toml")]) == 2
    assert "cannot read" in capsys.readouterr().err
