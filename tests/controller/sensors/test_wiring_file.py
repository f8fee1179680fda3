"""The wiring file: what ships is the default, and every mistake is told with its line."""

import re
from pathlib import Path

import pytest

from controller.sensors.hardware import HardwareError
from controller.sensors.hardware.scanner import Slot, slots
from controller.sensors.hardware.wiring import CHIPS, Electrodes, Wiring, read
from tests.support import ROOT
from tests.support.described import wired

TEXT = """
name = "mine"
scheme = "taxel"

[electrodes]
columns = [5, 6]
rows = [17, 27, 22]
channels = [0, 1, 2]

[converter]
type = "mcp3008"
"""


def test_the_file_that_ships_is_the_default() -> None:
    path = ROOT / "controller" / "sensors" / "hardware" / "default.toml"
    assert read(path) == read(None) == Wiring()


def test_a_file_says_what_hangs_where_and_the_rest_is_usual() -> None:
    wiring = wired(TEXT + "[times]\nsettle_us = 250\n")
    assert (wiring.rows, wiring.columns) == (3, 2)
    assert wiring.electrodes == Electrodes((5, 6), (17, 27, 22), (0, 1, 2))
    assert wiring.converter.type == "mcp3008"
    assert wiring.times.settle_s == pytest.approx(250e-6)
    assert wiring.times.samples == Wiring().times.samples
    # What a file does not name is not there.
    assert (wiring.button, wiring.led, wiring.pump) == (None, None, None)
    assert wiring.converter.ground is None


NAME, SCHEME, COLUMNS = 'name = "mine"', 'scheme = "taxel"', "columns = [5, 6]"
CHANNELS, TYPE, ROWS = "channels = [0, 1, 2]", 'type = "mcp3008"', "rows = [17, 27, 22]"
MISTAKES = [
    (COLUMNS, "columns = [5, 17]", "line 7 gives GPIO 17 to row"),
    (COLUMNS, "columns = [5, 5]", "line 6 has columns = [5, 5] under [electrodes]; expected"),
    (COLUMNS, "columns = [5, 31]", "line 6 has columns = [5, 31] under [electrodes]"),
    (COLUMNS, "columns = []", "line 6 has columns = [] under"),
    (COLUMNS, "columns = [5, 10]", "but it is SPI 0's"),
    (COLUMNS, "columns = [5, 8]", "but it is chip select 0 of SPI 0's"),
    (ROWS, "rows = [17, 27, 2]", "a resistor pulls it up"),
    (CHANNELS, "channels = [0, 1]", "line 8 has 2 channels for 3"),
    (CHANNELS, "channels = [0, 1, 8]", "there are only 8"),
    (CHANNELS, "", "line 5 has no channels under [electrodes]"),
    (TYPE, 'type = "mcp9"', "line 11 has type = 'mcp9' under [converter]; expected"),
    (TYPE, "clock_hz = 2_000_000", "line 11 has clock_hz = 2000000, more than"),
    (TYPE, "ground = 2", "gives input 2 to row 2, but it is ground's"),
    (SCHEME, 'scheme = "column"', "line 3 has scheme = 'column', which needs an input"),
    (SCHEME, 'scheme = "all"', "line 3 has scheme = 'all'; expected is one of taxel, column"),
    (SCHEME, "button = 22", "line 3 gives GPIO 22 to the button"),
    (SCHEME, "colour = 1", "line 3 has the unknown key 'colour'; known are name,"),
    (NAME, 'name = "my orb"', "line 2 has name = 'my orb'; expected is 1 to 24 letters"),
    ("[converter]", "[convertor]", "line 10 has the unknown key 'convertor'"),
    (TYPE, "[pump]\ntarget_kpa = 3.0\nlimit_kpa = 2.5", "line 12 has a target_kpa that is not"),
    (TEXT, 'name = "x"', "has no table [electrodes]"),
    (TEXT, "name = ", ", line 1: invalid value"),
]


@pytest.mark.parametrize(("old", "new", "told"), MISTAKES)
def test_a_mistake_is_told_with_its_line(old: str, new: str, told: str) -> None:
    assert old in TEXT
    with pytest.raises(HardwareError) as caught:
        wired(TEXT.replace(old, new))
    message = str(caught.value)
    assert told in message
    assert re.match(r"\S+mine\.toml", message)
    assert "\n" not in message


def test_a_file_that_cannot_be_read_is_told_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(HardwareError, match="no such file"):
        read(tmp_path / "absent.toml")
    (tmp_path / "x.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(HardwareError, match="not text in UTF-8"):
        read(tmp_path / "x.toml")


def test_a_frame_goes_column_by_column() -> None:
    wiring = wired(TEXT)
    frame = slots(wiring, range(2))
    assert frame[:4] == [Slot(0, (0,)), Slot(0, (1,)), Slot(0, (2,)), Slot(1, (0,))]
    assert slots(wiring, [None]) == [Slot(None, (0,)), Slot(None, (1,)), Slot(None, (2,))]
    together = wired(TEXT.replace('"taxel"', '"column"') + "ground = 7\n")
    assert slots(together, range(2)) == [Slot(0, (0, 1, 2)), Slot(1, (0, 1, 2))]


def test_every_converter_asks_for_a_channel_and_understands_the_answer() -> None:
    # Data sheets DS21295 and DS21298, figures 6-1: what a microcontroller sends and receives.
    old, new = CHIPS["mcp3008"], CHIPS["mcp3208"]
    assert old.request(5) == bytes((0b00000001, 0b11010000, 0))
    assert old.decode(bytes((0xFF, 0b11111001, 0b10000001))) == 0b01_10000001
    assert new.request(5) == bytes((0b00000111, 0b01000000, 0))
    assert new.decode(bytes((0xFF, 0b11101010, 0b10000001))) == 0b1010_10000001
    assert old.decode(b"\xff\xff\xff") is new.decode(b"\xff\xff\xff") is None
