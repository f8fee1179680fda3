"""The label button of every sensor, and the virtual hand that heeds cues."""

import numpy as np
import pytest

from controller.capture.cues import Cue, Phase
from controller.capture.simulated_hand import CuedHand
from controller.recordings.recording import UNKNOWN, Provenance, Recording
from controller.sensors import base as sensors
from controller.sensors.base import Geometry, SensorError
from controller.sensors.replay import Replay
from controller.sensors.virtual import Virtual

GRID = Geometry(5, 5, 10.0)
MINUTES = 1


def played(seed: int) -> tuple[Virtual, list[str | None], list[str]]:
    """Let the hand press every three seconds; return what the button said, and what was true."""
    orb = Virtual(seed, 10.0)
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
        if name not in ("replay", "orb"):  # which need a recording, and a Raspberry Pi
            sensor = sensors.load(name, 10.0)
            sensor.read(0.1)
            assert sensor.button(0.1) in (None, "null", "")


def test_the_virtual_hand_presses_its_button_nearly_when_it_presses_the_orb() -> None:
    _, said, true = played(3)
    agree = np.mean([one == other for one, other in zip(said, true, strict=True)])
    assert 0.93 < agree < 1.0
    presses = sum(a == "press" != b for a, b in zip(said[1:], said, strict=False))
    assert presses in (MINUTES * 20 - 2, MINUTES * 20 - 1)  # sometimes it is forgotten
    assert played(3)[1] == said


def test_a_brush_is_not_labelled() -> None:
    orb = Virtual(3, 10.0)
    orb.perform(1, "brush", 2.0, 2.0, 1.0)
    assert {orb.button(k / 10) for k in range(1, 60)} == {"null"}


def test_a_replay_says_what_the_button_said() -> None:
    origin = Provenance("x", 5, 5, 10.0, 10.0, ("null", "press"), "hash", "none", "0")
    nobody = np.full(3, UNKNOWN, dtype=np.int16)
    replay = Replay(
        Recording(
            origin,
            np.full((3, 5, 5), 40.0, dtype=np.float32),
            t=np.array([0.1, 0.2, 0.3]),
            sequence=np.array([1, 2, 3]),
            label=nobody,
            button=np.array([0, 1, UNKNOWN], dtype=np.int16),
            key=nobody,
            cue=nobody,
            excluded=np.zeros(3, dtype=np.bool_),
            touch=np.full((3, 2), np.nan),
        )
    )
    assert [replay.button(t_s) for t_s in (0.1, 0.2, 0.3)] == ["null", "press", None]
    with pytest.raises(SensorError, match=r"no frame at 0\.150 s"):
        replay.button(0.15)


def test_an_obedient_hand_reacts_to_go_and_to_nothing_else() -> None:
    hand = CuedHand(GRID, seed=1)
    quiet = [Cue(Phase.GET_READY, "press"), Cue(Phase.REST, "press"), Cue(Phase.GO, "null")]
    assert [hand.obey(cue, 1.0) for cue in quiet] == [None] * 3
    assert hand.obey(Cue(Phase.GO, "press", paused=True), 1.0) is None
    wish = hand.obey(Cue(Phase.GO, "press", place=(1.0, 3.0)), 1.0)
    assert wish is not None
    at_s, perform = wish
    assert 1.2 <= at_s <= 1.6
    assert (perform.label, perform.x, perform.y) == ("press", 1.0, 3.0)
