"""The hand of the virtual orb and its label button: gestures, cues, other people and days."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.cli.run import options_of
from controller.recordings.recording import UNKNOWN
from controller.runtime.assemble import open_device, prepare
from controller.sensors import base as sensors
from controller.sensors.geometry import Geometry, SensorError
from controller.sensors.replay import Replay
from controller.sensors.virtual import Options, Virtual, knows, show
from controller.shared.cues import Cue, Phase
from controller.simulator.hand.performance import DISTRACTORS
from controller.simulator.virtual_orb import VirtualOrb
from controller.teach.session import CuedHand
from tests.support import ROOT
from tests.support.recordings import of, origin

GRID = Geometry(5, 5, 10.0)
MINUTES = 1


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A folder with the example: the paper's gestures and a knock."""
    return Path(shutil.copytree(ROOT / "examples" / "knock", tmp_path / "mine"))


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
    with pytest.raises(SensorError, match="cannot read "):
        sensors.load("virtual", 10.0, gestures=(mine / "absent.toml",))


def test_a_hand_shows_what_it_knows_of_a_bundle(mine: Path) -> None:
    labels = ("null", "press", "knock")

    def shown(*gestures: Path) -> set[str]:
        script = show(labels, GRID, 1, gestures)
        return {next(script)[1].label for _ in range(20)}

    assert shown() == {"press"}
    assert shown(mine / "knock.toml") == {"press", "knock"}


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


def test_the_orb_knows_a_vocabulary(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = options_of(
        ["--sensor", f"virtual:gestures={mine / 'knock.toml'}", "--link", "listen://127.0.0.1:0"]
    )
    parts = prepare(options)
    parts.link.close()
    device = open_device(parts, 1)
    assert device.sensor.virtual
    device.sensor.perform(1, "knock", 2.0, 2.0, 1.0)
    device.close()
    assert main(["--sensor", f"virtual:gestures={mine / 'absent.toml'}"]) == 2
    assert "cannot read" in capsys.readouterr().err


def played(seed: int) -> tuple[Virtual, list[str | None], list[str]]:
    """Let the hand press every three seconds; return what the button said, and what was true."""
    orb = Virtual(Options(seed=seed), 10.0)
    said, true = [], []
    for k in range(1, MINUTES * 600):
        if k % 30 == 0:
            orb.perform(k, "press", 2.0, 2.0, k / 10)
        orb.read(k / 10)
        said.append(orb.button(k / 10))
        true.append(orb.label(k / 10))
    return orb, said, true


def test_every_sensor_says_what_its_button_does() -> None:
    for name in sensors.names():
        # Those need a recording, a Raspberry Pi, a port or a bus.
        if name not in ("replay", "orb", "lines", "mpr121"):
            sensor = sensors.load(name, 10.0)
            sensor.read(0.1)
            assert sensor.button(0.1) in (None, "null", "")


def test_the_virtual_hand_presses_its_button_nearly_in_time() -> None:
    _, said, true = played(3)
    agree = np.mean([one == other for one, other in zip(said, true, strict=True)])
    assert 0.93 < agree < 1.0
    presses = sum(a == "press" != b for a, b in zip(said[1:], said, strict=False))
    assert presses in (MINUTES * 20 - 2, MINUTES * 20 - 1)  # sometimes it is forgotten
    assert played(3)[1] == said


def test_a_brush_is_not_labelled() -> None:
    orb = Virtual(Options(seed=3), 10.0)
    orb.perform(1, "brush", 2.0, 2.0, 1.0)
    assert {orb.button(k / 10) for k in range(1, 60)} == {"null"}


def test_a_replay_says_what_the_button_said() -> None:
    about = origin(labels=("null", "press"))
    replay = Replay(of(np.full((3, 5, 5), 40.0), about, button=[0, 1, UNKNOWN]))
    assert [replay.button(t_s) for t_s in (0.1, 0.2, 0.3)] == ["null", "press", None]
    with pytest.raises(SensorError, match=r"no frame at 0\.150 s"):
        replay.button(0.15)


def test_an_obedient_hand_reacts_to_go_and_to_nothing_else() -> None:
    hand = CuedHand(GRID, seed=1)
    quiet = [Cue(Phase.GET_READY, "press"), Cue(Phase.REST, "press")]
    assert [hand.obey(cue, 1.0) for cue in quiet] == [None] * 2
    stray = CuedHand(GRID, 1).obey(Cue(Phase.GO, "null"), 1.0)
    assert stray is not None
    assert stray[1].label in DISTRACTORS
    wish = hand.obey(Cue(Phase.GO, "press", place=(1.0, 3.0)), 1.0)
    assert wish is not None
    at_s, perform = wish
    assert 1.2 <= at_s <= 1.6
    assert (perform.label, perform.x, perform.y) == ("press", 1.0, 3.0)
