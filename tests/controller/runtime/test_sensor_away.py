"""A sensor that is unplugged and comes back: the loop waits, holds nothing, and plays on."""

import logging
from pathlib import Path

import pytest

from controller.protocol.messages import Command, Contacts, State, Telemetry
from controller.recognition.frames import Frame
from controller.recordings import reader
from controller.runtime.device import Device
from controller.sensors.base import SensorAwayError
from tests.support.loop_bench import FINGER, Bench, Slab


class Loose(Bench):
    """A bench whose sensor's plug is out for a while."""

    def __init__(self, *requests: tuple[float, Contacts], record: Path | None = None) -> None:
        super().__init__(*requests, record=record)
        self.out = (3.95, 5.05)

    def open(self) -> Device:
        device = super().open()
        inner: Slab = self.sensors[-1]
        read = inner.read

        def plugged(t_s: float) -> Frame:
            if self.out[0] <= t_s < self.out[1]:
                raise SensorAwayError("the plug is out")
            return read(t_s)

        inner.read = plugged  # type: ignore[method-assign]
        return device


def test_the_loop_waits_for_a_sensor_that_is_away_and_says_so_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with caplog.at_level(logging.INFO, "controller"):
        bench = Loose().run(8.05)
    told = [m.frame for m in bench.messages(Telemetry) if isinstance(m, Telemetry)]
    assert told == [*range(1, 40), *range(51, 81)]
    assert [r.message for r in caplog.records] == [
        "the plug is out; waiting for it",
        "the sensor is back after 1.1 s",
    ]


def test_nothing_is_held_while_the_sensor_is_away() -> None:
    bench = Loose((3.0, FINGER)).run(8.05)
    told = [
        message.pressed if isinstance(message, State) else message.name
        for message in bench.messages(Command, State)
        if isinstance(message, Command | State)
    ]
    assert told == ["left", ("left",), ()]


def test_a_touch_after_the_return_is_recognised() -> None:
    bench = Loose((6.0, FINGER), (6.5, Contacts(()))).run(8.05)
    assert [m.name for m in bench.messages(Command) if isinstance(m, Command)] == ["left"]


def test_a_recording_has_no_frames_of_that_time_and_says_why(tmp_path: Path) -> None:
    Loose(record=tmp_path / "x.npz").run(8.05)
    recording = reader.load(tmp_path / "x.npz")
    assert not ((recording.t > 3.95) & (recording.t < 5.05)).any()
    assert [(mark.kind, mark.text) for mark in recording.marks if mark.kind == "lost"] == [
        ("lost", "the plug is out")
    ]
