"""A sensor that is unplugged and comes back: the loop waits, holds nothing, and plays on."""

import logging
from pathlib import Path

import pytest

from controller.recognition.images.frames import Frame
from controller.recognition.images.scale import Signal
from controller.recognition.pipeline import Pipeline
from controller.recordings import reader
from controller.runtime.device import Device
from controller.sensors import calibration_store
from controller.sensors.geometry import SensorAwayError
from controller.shared.protocol.messages import Command, Contacts, State, Telemetry
from tests.support.loop_bench import FINGER, SHIPPED, Bench, Certain


class Loose(Bench):
    """A bench whose sensor's plug is out for a while."""

    def open(self) -> Device:
        device = super().open()
        read = self.sensors[-1].read

        def plugged(t_s: float) -> Frame:
            if 3.95 <= t_s < 5.05:
                raise SensorAwayError("the plug is out")
            return read(t_s)

        self.sensors[-1].read = plugged  # type: ignore[method-assign]
        return device


def test_the_loop_waits_for_an_absent_sensor(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "controller"):
        bench = Loose().run(8.05)
    told = [m.frame for m in bench.messages(Telemetry) if isinstance(m, Telemetry)]
    assert told == [*range(1, 40), *range(51, 81)]
    assert [r.message for r in caplog.records] == [
        "the plug is out; waiting for it",
        "the sensor is back after 1.1 s",
    ]


def test_nothing_is_held_while_the_sensor_is_away_and_a_later_touch_is_recognised() -> None:
    bench = Loose((3.0, FINGER), (5.5, Contacts(())), (6.5, FINGER)).run(8.05)
    told = [m.pressed if isinstance(m, State) else type(m) for m in bench.messages(Command, State)]
    assert told == [Command, ("left",), (), Command, ("left",)]


def test_a_recording_has_no_frames_of_that_time_and_says_why(tmp_path: Path) -> None:
    Loose(record=tmp_path / "x.npz").run(8.05)
    recording = reader.load(tmp_path / "x.npz")
    assert not ((recording.t > 3.95) & (recording.t < 5.05)).any()
    assert [(mark.kind, mark.text) for mark in recording.marks if mark.kind == "lost"] == [
        ("lost", "the plug is out")
    ]


def test_a_scale_that_was_learned_is_kept_for_the_next_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(calibration_store, "folder", lambda: tmp_path)
    bench = Bench()
    device = bench.open()
    signal = Signal("counts")
    device.pipeline = Pipeline(SHIPPED.settings, Certain(), SHIPPED.mapping, signal=signal)
    for number in range(200):
        if number in (30, 120):  # two touches of five seconds; six decide
            device.sensor.touch(FINGER.contacts, number / 10)
        if number in (80, 170):
            device.sensor.touch((), number / 10)
        device.advance(10.0)
        assert bool(calibration_store.scale(device.sensor.device_id)) == (number >= 129)
    kept = calibration_store.scale(device.sensor.device_id)
    assert kept == device.pipeline.learned
    signal = Signal("counts", learned=kept)
    again = Pipeline(SHIPPED.settings, Certain(), SHIPPED.mapping, signal=signal)
    assert again.learned == kept
