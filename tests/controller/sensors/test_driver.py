"""The real orb's driver: spidev and lgpio as far as they can be tried without a Raspberry Pi."""

import errno
import re
import sys
import time
from types import ModuleType
from typing import cast

import numpy as np
import pytest

pytest.importorskip("gpiozero", reason="the driver's pins are gpiozero's")

from gpiozero.pins.mock import MockFactory

from controller.sensors import base as sensors
from controller.sensors import orb
from controller.sensors.hardware import HardwareAwayError, HardwareError, raspberry_pi
from controller.sensors.hardware.emulated.board import EmulatedBoard, FakeChip
from controller.sensors.hardware.emulated.circuit import WiringFault
from controller.sensors.hardware.raspberry_pi import SpiDev


class Spidev(ModuleType):
    """The module spidev, as far as it is used: one class, whose devices answer like a chip."""

    def __init__(self, bench: EmulatedBoard) -> None:
        super().__init__("spidev")
        self.bench, self.fails = bench, cast("OSError | None", None)
        self.opened: list[tuple[int, int]] = []
        outer = self

        class SpiDevice:
            mode, max_speed_hz = 3, 0

            def open(self, bus: int, device: int) -> None:
                if outer.fails is not None:
                    raise outer.fails
                outer.opened.append((bus, device))

            def xfer2(self, data: list[int]) -> list[int]:
                assert (self.mode, self.max_speed_hz) == (0, 1_000_000)
                if outer.fails is not None:
                    raise outer.fails
                return list(outer.bench.board.buses[0].transfer(bytes(data)))

            def close(self) -> None:
                pass

        self.SpiDev = SpiDevice


@pytest.fixture
def pi(monkeypatch: pytest.MonkeyPatch) -> Spidev:
    """A computer whose pins and bus lead to an emulated orb."""
    bench = EmulatedBoard(seed=3)
    bench.board.knobs.close()
    bench.board.pins.close()
    fake = Spidev(bench)
    monkeypatch.setitem(sys.modules, "spidev", fake)
    monkeypatch.setattr(raspberry_pi, "raspberry", lambda: bench.factory)
    monkeypatch.setattr(raspberry_pi, "wait", bench.circuit.advance)
    return fake


def test_an_orb_on_a_computers_pins_is_read(pi: Spidev, monkeypatch: pytest.MonkeyPatch) -> None:
    circuit = pi.bench.circuit
    monkeypatch.setattr(time, "perf_counter", lambda: circuit.now_s)
    sensor = sensors.load("orb", 10.0)
    assert not sensor.virtual
    assert sensor.device_id.startswith("orb")
    assert (sensor.geometry.rows, sensor.geometry.columns) == (5, 5)
    frame = np.mean([sensor.read(k / 10) for k in range(8)], axis=0)
    assert frame == pytest.approx(pi.bench.picofarads, rel=0.05)
    assert sensor.button(0.8) == "null"
    assert pi.opened == [(0, 0)]
    sensor.close()


def test_a_bus_that_fails_is_looked_for_again(pi: Spidev) -> None:
    bus = SpiDev(0, 0, 1_000_000)
    pi.fails = OSError(errno.ENODEV, "No such device")
    for _ in range(3):
        with pytest.raises(OSError, match="No such device"):
            bus.transfer(b"\x06\0\0")
    pi.fails = None
    assert len(bus.transfer(b"\x06\0\0")) == 3
    assert pi.opened == [(0, 0), (0, 0)]


def test_no_permission_and_no_bus_are_one_sentence_each(pi: Spidev) -> None:
    pi.fails = PermissionError(errno.EACCES, "Permission denied")
    with pytest.raises(HardwareError, match="add yourself to the group spi"):
        SpiDev(0, 0, 1_000_000)
    pi.fails = FileNotFoundError(errno.ENOENT, "No such file or directory")
    with pytest.raises(HardwareAwayError, match="switch SPI on with raspi-config"):
        SpiDev(0, 0, 1_000_000)


@pytest.mark.parametrize("module", ["spidev", "lgpio"])
def test_missing_library_is_told(pi: Spidev, monkeypatch: pytest.MonkeyPatch, module: str) -> None:
    monkeypatch.undo()
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.delitem(sys.modules, "gpiozero.pins.lgpio", raising=False)
    if module == "spidev":
        monkeypatch.setattr(raspberry_pi, "raspberry", MockFactory)
    with pytest.raises(HardwareError, match=r"'orbtouch\[pi\]' .*, or try --sensor emu"):
        sensors.load("orb", 10.0)


def bench_of(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `--sensor orb` find an emulated board with a fault."""
    bench = EmulatedBoard(seed=3, faults=[WiringFault.parse(fault)])
    monkeypatch.setattr(orb, "open_board", lambda wiring: bench.board)


def test_a_fault_at_start_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    bench_of("unplugged", monkeypatch)
    with pytest.raises(HardwareError, match="the membrane is plugged in"):
        sensors.load("orb", 10.0)


def test_a_slow_orb_is_read_as_fast_as_it_can_be(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    bench_of("slow_clock=3", monkeypatch)
    with caplog.at_level("INFO"):
        slow = sensors.load("orb", 40.0)
    scan_ms = float(re.findall(r"a scan takes ([\d.]+) ms here", caplog.text)[0])
    assert scan_ms > 0.8 * 1000 / 40
    assert slow.rate_hz == int(0.8 * 1000 / scan_ms)
    assert f"so the orb is read at {slow.rate_hz:g} Hz" in caplog.text
    assert sensors.load("orb", 10.0).rate_hz == 10.0


def test_waiting_is_never_too_short() -> None:
    for seconds in (0.0, 1e-5, 1e-3):
        began = time.perf_counter()
        raspberry_pi.wait(seconds)
        assert time.perf_counter() - began >= seconds


def test_a_chip_answers_as_its_data_sheet_says() -> None:
    asked: list[int] = []

    def measure(channel: int) -> float:
        asked.append(channel)
        return 0.5

    assert FakeChip(12, measure).transfer(b"\x07\x40\0") == bytes((0xFF, 0b11101000, 0))
    assert FakeChip(10, measure).transfer(b"\x01\xd0\0") == bytes((0xFF, 0b11111010, 0))
    assert asked == [5, 5]
    assert FakeChip(12, measure).transfer(b"\0\0\0") == b"\xff\xff\xff"  # no start bit
