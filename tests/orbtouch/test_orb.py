"""A connected orb: a real process with a real link, whose every tenth frame has a command."""

import json
import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest

import orbtouch
from controller.shared.protocol.messages import Command, ContactState, Telemetry
from host.connection.receiver import Connected, Delivered, Lost, Received
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
    assert (first.name, first.gesture, first.position) == ("drop", "pinch", None)
    assert second.t - first.t == pytest.approx(0.2)  # ten frames of 20 ms


def test_state_and_panel_are_those_of_the_orb(url: str) -> None:
    with orbtouch.connect(url) as orb:
        assert orb.classes == ()
        next(iter(orb))
        assert orb.link == "live"
        assert orb.classes == fake_device.welcome().labels
        assert orb.image.shape == (5, 5)
        assert list(orb.probabilities) == list(orb.classes)
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


class Told:
    """A receiver that has got these, and then nothing."""

    def __init__(self, *received: Received) -> None:
        self.received = [Connected(fake_device.welcome()), *received]

    def poll(self) -> list[Received]:
        received, self.received = self.received, []
        return received


LANDED = ContactState(7, 2.0, 1.5, 0.1, 6.0, 0.5, 1, 0.9)
DEEPER = ContactState(8, 2.0, 1.5, 0.1, 9.0, 0.5, 2, 0.8, -30.0, 5.0, 1.5, 0.25)


def test_press_command_and_release_are_told_in_order_with_their_times() -> None:
    told: Any = Told(
        Delivered(LANDED, 700),
        Delivered(Command("drop", "pinch", 0.5, None, 8), 800),
        Delivered(DEEPER, 800),
        Delivered(ContactState(8), 900),
    )
    press, command, release = orbtouch.Orb(told).events()
    deepest = orbtouch.Contact(0.8, (2.0, 1.5), 0.1, 9.0, 0.5, 2, 0.8, -30.0, 5.0, 1.5, 0.25)
    assert isinstance(press, orbtouch.Press)
    assert (press.t, press.contact.depth_mm) == (0.7, 6.0)
    assert command == orbtouch.Command(0.8, "drop", "pinch", 0.5, None)
    assert release == orbtouch.Release(0.9, deepest)


def test_contact_frame_and_held_gesture_are_the_present_ones_until_the_link_is_lost() -> None:
    shares = (0.0, 1.0, 0.0, 0.0, 0.0)
    felt = Telemetry(8, bytes([126] * 25), shares, None, "press", True, 10.0)
    told: Any = Told(Delivered(DEEPER, 800), Delivered(felt, 800))
    orb = orbtouch.Orb(told)
    assert (orb.contact, orb.frame, orb.held) == (None, None, "")
    orb.events()
    contact, frame = orb.contact, orb.frame
    assert contact is not None
    assert (contact.angle_deg, orb.held) == (-30.0, "press")
    assert frame is not None
    assert (frame.number, frame.t) == (8, 0.8)
    assert frame.image == pytest.approx(-0.01)
    told.received = [Lost("it was cut off")]
    assert orb.events() == [orbtouch.Release(0.8, contact)]
    assert (orb.contact, orb.held) == (None, "")


@pytest.mark.slow
def test_a_touch_on_a_virtual_orb_is_a_command() -> None:
    """A press of a fifth of a second at the left, timed by the orb's own frames."""
    with orbtouch.connect(seed=3) as orb:
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
    assert found[0].position == pytest.approx((0.0, 2.0), abs=0.6)


@pytest.mark.slow
def test_a_sensor_is_recorded(tmp_path: Path) -> None:
    made = orbtouch.record(tmp_path / "own.npz", 2.0, seed=3)
    assert made.frames.shape[1:] == (5, 5)
    assert (made.t[0] >= 0.025, made.t[-1]) == (True, 2.0)
    with pytest.raises(orbtouch.Error, match="own"):
        orbtouch.record(tmp_path / "own.npz", 2.0)
    with pytest.raises(orbtouch.Error, match=r"^duration = 0\.5; expected is a number 1 or more$"):
        orbtouch.record(tmp_path / "short.npz", 0.5)
    with pytest.raises(orbtouch.Error, match="is a folder; name a file to make"):
        orbtouch.record(tmp_path, 2.0)
    with pytest.raises(orbtouch.Error, match="nothing was recorded in 1 s; a second or more is"):
        orbtouch.record(tmp_path / "short.npz", 1.0)
