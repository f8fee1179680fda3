"""The sensor `mpr121` on a bus whose chips are memory, as those of Linux's i2c-stub are."""

import sys
from pathlib import Path

import numpy as np
import pytest

from controller.sensors import base as sensors
from controller.sensors.geometry import SensorAwayError, SensorError
from controller.sensors.mpr121 import Mpr121
from tests.support import ROOT
from tests.support.described import described

CHIPS = "rows = 5\ncolumns = 5\naddresses = [0x5A, 0x5B, 0x5C]\n"


class FakeBus:
    """A bus of chips that are 256 registers each; an unplugged one raises as smbus2 does."""

    def __init__(self, *addresses: int) -> None:
        self.chips = {address: bytearray(256) for address in addresses}
        self.closed = False

    def set(self, address: int, counts: list[int]) -> None:
        """Put 10-bit counts of the electrodes into a chip's registers."""
        data = b"".join(count.to_bytes(2, "little") for count in counts)
        self.chips[address][4 : 4 + len(data)] = data

    def write_byte_data(self, address: int, register: int, value: int) -> None:
        self._chip(address)[register] = value

    def read_i2c_block_data(self, address: int, register: int, length: int) -> list[int]:
        assert length <= 32  # the most that SMBus has
        return list(self._chip(address)[register : register + length])

    def close(self) -> None:
        self.closed = True

    def _chip(self, address: int) -> bytearray:
        if address not in self.chips:
            raise OSError(121, "Remote I/O error")
        return self.chips[address]


def test_counts_become_capacitances_of_all_chips_in_order() -> None:
    bus = FakeBus(0x5A, 0x5B, 0x5C)
    for number, address in enumerate(bus.chips):
        bus.set(address, [500 + 12 * number + electrode for electrode in range(12)])
    sensor = Mpr121(described(CHIPS), bus, 40.0)
    # AN3889: C = I T 1024 / (counts V), 16 µA, 0.5 µs, 3.3 V
    expected = 16 * 0.5 * 1024 / 3.3 / (500 + np.arange(25))
    np.testing.assert_allclose(sensor.read(0.0).ravel(), expected, rtol=1e-5)
    assert (sensor.signal.unit, sensor.signal.sign) == ("pF", 1)  # a finger adds capacitance
    assert sensor.rate_hz == 40.0


def test_the_chips_are_told_to_run_with_twelve_electrodes() -> None:
    bus = FakeBus(0x5A)
    Mpr121(described("rows = 3\ncolumns = 4\n"), bus)
    registers = bus.chips[0x5A]
    assert registers[0x5E] & 0x0F == 12
    assert (registers[0x5C] & 0x3F, registers[0x5D] >> 5) == (16, 1)  # 16 µA for 0.5 µs
    assert registers[0x80] == 0x63


def test_the_upper_bits_of_a_count_are_not_read() -> None:
    bus = FakeBus(0x5A)
    bus.set(0x5A, [0xFC00 | 512] * 12)
    sensor = Mpr121(described("rows = 1\ncolumns = 2\nsupply_v = 2.0\n"), bus)
    assert sensor.read(0.0).tolist() == [[8.0, 8.0]]


def test_a_chip_that_is_not_there_is_named_and_may_come_back() -> None:
    bus = FakeBus(0x5A)
    with pytest.raises(SensorAwayError, match="no MPR121 answers at 0x5b of /dev/i2c-1"):
        Mpr121(described("rows = 4\ncolumns = 5\naddresses = [0x5A, 0x5B]\n"), bus)


def test_more_taxels_than_electrodes_are_refused() -> None:
    with pytest.raises(SensorError, match="more than the 12 electrodes"):
        Mpr121(described("rows = 5\ncolumns = 5\n"), FakeBus(0x5A))


def test_without_smbus2_one_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "smbus2", None)
    wiring = ROOT / "firmware" / "mpr121" / "mpr121_direct.toml"
    with pytest.raises(SensorError, match=r"needs smbus2; pip install 'orbtouch\[i2c\]'"):
        sensors.load("mpr121", wiring=wiring)


def test_a_bus_that_is_not_there(tmp_path: Path) -> None:
    pytest.importorskip("smbus2")
    wiring = tmp_path / "mine.toml"
    wiring.write_text("bus = 99\nrows = 1\ncolumns = 2\n")
    with pytest.raises(SensorError, match="cannot open /dev/i2c-99: no such file or directory"):
        sensors.load("mpr121", wiring=wiring)
