"""A connected orb: a real process with a real link, whose every tenth frame has a command."""

import json
import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pygame
import pytest

import orbtouch
from tests.support import fake_device
from tests.support.processes import LineProcess


@pytest.fixture
def url() -> Iterator[str]:
    process = LineProcess((sys.executable, fake_device.__file__, "listen://127.0.0.1:0"))
    yield json.loads(process.line())["listening"].replace("listen:", "socket:")
    process.close()


def test_commands_are_iterated_as_they_come(url: str) -> None:
    with orbtouch.connect(url) as orb:
        first, second = islice(orb, 2)
    assert (first.name, first.gesture, first.touch) == ("drop", "pinch", None)
    assert second.t_s - first.t_s == pytest.approx(0.2)  # ten frames of 20 ms


def test_state_and_panel_are_those_of_the_orb(url: str) -> None:
    with orbtouch.connect(url) as orb:
        assert orb.labels == ()
        next(iter(orb))
        assert orb.link == "live"
        assert orb.labels == fake_device.welcome().labels
        assert orb.image.shape == (5, 5)
        assert list(orb.probabilities) == list(orb.labels)
        surface = pygame.Surface((390, 600))
        orb.draw(surface, pygame.Rect(0, 0, 390, 600))
    assert np.ptp(pygame.surfarray.array3d(surface)) > 100  # there is a picture


def test_iteration_ends_when_the_orb_is_closed(url: str) -> None:
    orb = orbtouch.connect(url)
    for _ in orb:
        orb.close()


def test_nobody_at_the_port_is_one_sentence() -> None:
    with orbtouch.connect("socket://127.0.0.1:9") as orb, pytest.raises(orbtouch.Error, match="9"):
        next(iter(orb))


def test_a_missing_key_is_named_before_anything_connects() -> None:
    with pytest.raises(orbtouch.Error, match=r"nothing\.key"):
        orbtouch.connect("socket://127.0.0.1:9", key="nothing.key")


@pytest.mark.slow
def test_a_touch_on_a_virtual_orb_is_a_command() -> None:
    """A press of a fifth of a second at the left, timed by the orb's own frames."""
    with orbtouch.connect(options=("--seed", "3")) as orb:
        found: list[orbtouch.Command] = []
        while orb.link != "live" or not orb.probabilities.get("null", 0) > 0.9:
            found += orb.commands()
        frame = 0
        while not found:
            frame += 1
            orb._receiver.wait(0.05)  # for the next frame
            orb.touch((0, 2)) if frame % 60 < 8 else orb.touch()
            found += orb.commands()
    assert (found[0].gesture, found[0].name) == ("press", "left")
    assert found[0].touch == pytest.approx((0.0, 2.0), abs=0.6)


@pytest.mark.slow
def test_a_sensor_is_recorded(tmp_path: Path) -> None:
    made = orbtouch.record(tmp_path / "own.npz", 4.0, "--seed", "3")
    assert made.frames.shape[1:] == (5, 5)
    assert 1.0 < made.seconds < 4.0
    with pytest.raises(orbtouch.Error, match="own"):
        orbtouch.record(tmp_path / "own.npz", 4.0)
