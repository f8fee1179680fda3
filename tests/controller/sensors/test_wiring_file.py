"""The wiring file: what ships is the default, and every mistake is told with its line."""

from pathlib import Path

import pytest

from controller.sensors.hardware import HardwareError
from controller.sensors.hardware.converters import CHIPS
from controller.sensors.hardware.scanner import Slot, dark_slots, slots
from controller.sensors.hardware.wiring import Electrodes, Wiring, parse, read
from tests.support import ROOT

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


def complaint(text: str) -> str:
    with pytest.raises(HardwareError) as caught:
        parse(text, "mine.toml")
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_the_file_that_ships_is_the_default() -> None:
    path = ROOT / "controller" / "sensors" / "hardware" / "default.toml"
    assert read(path) == read(None) == Wiring()


def test_a_file_says_what_hangs_where_and_the_rest_is_usual() -> None:
    wiring = parse(TEXT, "mine.toml")
    assert (wiring.rows, wiring.columns) == (3, 2)
    assert wiring.electrodes == Electrodes((5, 6), (17, 27, 22), (0, 1, 2))
    assert wiring.converter.type == "mcp3008"
    assert wiring.times == Wiring().times
    # What a file does not name is not there.
    assert (wiring.button, wiring.led, wiring.pump) == (None, None, None)
    assert wiring.converter.ground is None


def test_times_are_written_in_microseconds() -> None:
    wiring = parse(TEXT + "[times]\nsettle_us = 250\nsamples = 1\n", "mine.toml")
    assert wiring.times.settle_s == pytest.approx(250e-6)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("columns = [5, 6]", "columns = [5, 17]", "line 7 gives GPIO 17 to row"),
        (
            "columns = [5, 6]",
            "columns = [5, 5]",
            "line 6 has columns = [5, 5] under [electrodes]; expected",
        ),
        (
            "columns = [5, 6]",
            "columns = [5, 31]",
            "line 6 has columns = [5, 31] under [electrodes]",
        ),
        ("columns = [5, 6]", "columns = []", "line 6 has columns = [] under"),
        ("columns = [5, 6]", "columns = [5, 10]", "but it is SPI 0's"),
        ("columns = [5, 6]", "columns = [5, 8]", "but it is chip select 0 of SPI 0's"),
        ("rows = [17, 27, 22]", "rows = [17, 27, 2]", "a resistor pulls it up"),
        ("channels = [0, 1, 2]", "channels = [0, 1]", "line 8 has 2 channels for 3"),
        ("channels = [0, 1, 2]", "channels = [0, 1, 8]", "there are only 8"),
        ("channels = [0, 1, 2]", "", "line 5 has no channels under [electrodes]"),
        (
            'type = "mcp3008"',
            'type = "mcp9"',
            "line 11 has type = 'mcp9' under [converter]; expected",
        ),
        ('type = "mcp3008"', "clock_hz = 2_000_000", "line 11 has clock_hz = 2000000, more than"),
        ('type = "mcp3008"', "ground = 2", "gives input 2 to row 2, but it is ground's"),
        (
            'scheme = "taxel"',
            'scheme = "column"',
            "line 3 has scheme = 'column', which needs an input",
        ),
        (
            'scheme = "taxel"',
            'scheme = "all"',
            "line 3 has scheme = 'all'; expected is one of taxel, column",
        ),
        ('scheme = "taxel"', "order = [1, 1]", "line 3 has order = [1, 1]; expected"),
        (
            'scheme = "taxel"',
            "order = [1]",
            "line 3 has an order without each column, 0 to 1, once",
        ),
        (
            'scheme = "taxel"',
            "gain = [[1.0, 1.0]]",
            "line 3 has a gain that is not 3 rows of 2 numbers",
        ),
        ('scheme = "taxel"', "button = 22", "line 3 gives GPIO 22 to the button"),
        ('scheme = "taxel"', "colour = 1", "line 3 has the unknown key 'colour'; known are name,"),
        (
            'name = "mine"',
            'name = "my orb"',
            "line 2 has name = 'my orb'; expected is 1 to 24 letters",
        ),
        ("[converter]", "[convertor]", "line 10 has the unknown key 'convertor'"),
    ],
)
def test_a_mistake_is_told_with_its_line(old: str, new: str, told: str) -> None:
    assert old in TEXT
    message = complaint(TEXT.replace(old, new))
    assert told in message
    assert message.startswith("mine.toml")
    assert "docs/hardware.md" in message


def test_a_pump_whose_target_is_above_its_limit_is_refused() -> None:
    text = TEXT + "[pump]\npin = 12\nchannel = 7\ntarget_kpa = 3.0\nlimit_kpa = 2.5\n"
    assert "line 15 has a target_kpa that is not below limit_kpa, 2.5" in complaint(text)
    assert parse(text.replace("3.0", "2.0"), "mine.toml").pump is not None


def test_what_is_no_wiring_is_told_in_one_sentence(tmp_path: Path) -> None:
    assert "mine.toml, line 1: invalid value" in complaint("name = ")
    assert "has no table [electrodes]" in complaint('name = "x"')
    with pytest.raises(HardwareError, match="no such file"):
        read(tmp_path / "absent.toml")
    (tmp_path / "x.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(HardwareError, match="not text in UTF-8"):
        read(tmp_path / "x.toml")


# --- the schedule ---------------------------------------------------------------------------------


def test_a_frame_goes_column_by_column_and_row_by_row() -> None:
    wiring = parse(TEXT, "mine.toml")
    assert list(slots(wiring))[:4] == [
        Slot(0, (0,)), Slot(0, (1,)), Slot(0, (2,)), Slot(1, (0,)),
    ]  # fmt: skip
    assert list(dark_slots(wiring)) == [Slot(None, (0,)), Slot(None, (1,)), Slot(None, (2,))]


def test_all_rows_of_a_column_can_settle_together_in_any_order_of_columns() -> None:
    text = TEXT.replace('"taxel"', '"column"\norder = [1, 0]') + "ground = 7\n"
    wiring = parse(text, "mine.toml")
    assert list(slots(wiring)) == [Slot(1, (0, 1, 2)), Slot(0, (0, 1, 2))]


# --- converters -----------------------------------------------------------------------------------


def test_every_converter_asks_for_a_channel_and_understands_the_answer() -> None:
    # Data sheets DS21295 and DS21298, figures 6-1: what a microcontroller sends and receives.
    old, new = CHIPS["mcp3008"], CHIPS["mcp3208"]
    assert old.request(5) == bytes((0b00000001, 0b11010000, 0))
    assert old.decode(bytes((0xFF, 0b11111001, 0b10000001))) == 0b01_10000001
    assert new.request(5) == bytes((0b00000111, 0b01000000, 0))
    assert new.decode(bytes((0xFF, 0b11101010, 0b10000001))) == 0b1010_10000001
    assert old.decode(b"\xff\xff\xff") is new.decode(b"\xff\xff\xff") is None
