"""Any predictor plays live: on the virtual orb, a sensor or a replay, in this program."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pygame
import pytest

import orbtouch
from orbtouch import in_process

CLASSES = ("poke", "null")
Windows = np.ndarray


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five seconds of presses, as a file."""
    path = tmp_path_factory.mktemp("live") / "session.npz"
    orbtouch.simulate(minutes=0.5, gestures=("press",))[0.0:5.0].save(path)
    return path


def poke(windows: Windows) -> Windows:
    """A touch by the mean of the latest images: 2 % below rest is one."""
    depth = 1.0 - windows[:, -8:].mean(axis=(1, 2, 3))
    touched = (depth > 0.02).astype(float)
    return np.stack([touched, 1.0 - touched], axis=1)


def test_a_callable_answers_a_replay_with_its_own_gestures(session: Path, tmp_path: Path) -> None:
    mapping = tmp_path / "own.toml"
    mapping.write_text('poke = "left"\n')
    with orbtouch.live(poke, classes=CLASSES, replay=session, mapping=mapping) as orb:
        commands = list(orb)  # which ends with the replay
    assert commands
    assert {(one.gesture, one.name) for one in commands} == {("poke", "left")}


def test_a_network_answers_a_replay_as_a_device_does(session: Path) -> None:
    network = orbtouch.load_network()
    expected = [one.t for one in network.run(orbtouch.load_recording(session))]
    with orbtouch.live(network, replay=session) as orb:
        heard = [one.t for one in orb]  # a busy machine is late with one, which is not obeyed then
    assert len(heard) > len(expected) / 2
    assert {round(t, 2) for t in heard} <= {round(t, 2) for t in expected}


def broken(windows: Windows) -> Windows:
    raise ValueError("no \033[2Jweights")


def unsure(windows: Windows) -> Windows:
    return np.full((1, 2), 0.9)


@pytest.mark.parametrize(
    ("predict", "said"),
    [
        (broken, r"^broken raised ValueError at .*: no \\x1b\[2Jweights$"),
        (
            unsure,
            r"^unsure returned \[0.9, 0.9\]; expected are probabilities of poke, null, which sum",
        ),
    ],
)
def test_a_callable_that_fails_is_one_sentence(
    predict: Callable[[Windows], Windows], said: str
) -> None:
    with orbtouch.live(predict, classes=CLASSES) as orb, pytest.raises(orbtouch.Error, match=said):
        for _ in orb:
            pass


def test_a_callable_longer_than_a_frame_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = in_process._Judge(orbtouch.load_network()._bundle, lambda x: [[0.0, 1.0]], (1, 0))
    now = iter(np.arange(0.0, 100.0, 0.06))
    monkeypatch.setattr(time, "monotonic", lambda: next(now))
    for _ in range(in_process._LATE):
        judge.probabilities(np.ones((40, 5, 5), np.float32))
    assert "takes 60 ms for a window, longer than a frame of 25 ms" in judge.problem


def test_slips_are_answered_before_anything_starts() -> None:
    with pytest.raises(orbtouch.Error, match='"null" among them'):
        orbtouch.live(poke, classes=("poke", "hold"))
    with pytest.raises(orbtouch.Error, match="there is no option 'speed'; there are sensor, seed"):
        orbtouch.live(poke, classes=CLASSES, speed=3)
    with pytest.raises(orbtouch.Error, match="str is no network and cannot be called"):
        orbtouch.live("forest", classes=CLASSES)  # type: ignore[arg-type]


def test_a_game_is_played_with_a_callable_that_fails_at_its_end() -> None:
    words = ("--headless", "--seconds", "0.5")
    assert orbtouch.play(poke, classes=CLASSES, words=words) == 0

    def closing(windows: Windows) -> Windows:
        pygame.event.post(pygame.event.Event(pygame.QUIT))
        return broken(windows)

    with pytest.raises(orbtouch.Error, match=r"closing raised ValueError"):
        orbtouch.play(closing, classes=CLASSES, words=("--headless", "--seconds", "60"))
