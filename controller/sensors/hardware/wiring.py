"""Wiring of an orb: electrodes and their pins, and the times of a scan, from a TOML file.

`config.settings` checks each entry against the metadata of its field. `default.toml` shows and
explains all of them with their defaults, and docs/hardware.md draws them.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

from controller.sensors.hardware import HardwareError
from controller.shared import config, files
from controller.shared.config import ConfigError

CHANNELS: Final = 8  # single-ended inputs of each type


@dataclass(frozen=True, slots=True)
class Chip:
    """One type of converter, which answers three bytes with its count in the lowest bits."""

    bits: int  # resolution
    fastest_hz: int  # the SPI clock that it is good for at 3.3 V

    def request(self, channel: int) -> bytes:
        """Return the bytes that ask for a channel: a start bit, single-ended, the channel."""
        return ((0b11000 | channel) << self.bits + 2).to_bytes(3, "big")

    def decode(self, answer: bytes) -> int | None:
        """Return the count; None: no converter is there, which would pull the null bit low."""
        told = int.from_bytes(answer, "big")
        return None if told >> self.bits & 1 else told & (1 << self.bits) - 1


# Microchip, data sheets DS21295 and DS21298, figures 6-1.
CHIPS: Final = {"mcp3008": Chip(10, 1_350_000), "mcp3208": Chip(12, 1_000_000)}

Scheme = Literal["taxel", "column"]

MAX_ELECTRODES: Final = 32  # of one kind


def number(default: Any, low: float, high: float, **limits: Any) -> Any:
    """Return a field for a number within limits."""
    return field(default=default, metadata={"range": (low, high), **limits})


def numbers(default: tuple[int, ...], high: int, most: int = MAX_ELECTRODES) -> Any:
    """Return a field for a list of different whole numbers from 0."""
    expected = f"a list of 1 to {most} different whole numbers from 0 to {high}"
    limits = {"range": (0, high), "count": (1, most), "expected": expected}
    return field(default=default, metadata=limits)


def named(default: str) -> Any:
    """Return a field for the name of a sensor."""
    limits = {"pattern": "[A-Za-z0-9_-]{1,24}", "expected": "1 to 24 letters, digits, - and _"}
    return field(default=default, metadata=limits)


def _pin(default: int | None) -> Any:
    """Return a field for the number of a GPIO pin."""
    return number(default, 0, 27)


@dataclass(frozen=True, slots=True)
class Electrodes:
    """Pins by their GPIO (BCM) numbers, and converter channels."""

    # pins of the columns, left to right
    columns: tuple[int, ...] = numbers((5, 6, 13, 19, 26), 27)
    rows: tuple[int, ...] = numbers((17, 27, 22, 23, 24), 27)  # pins of the rows, top to bottom
    # the converter's channel of each row; a second converter's begin where the first one's end
    channels: tuple[int, ...] = numbers((0, 1, 2, 3, 4), 63)


@dataclass(frozen=True, slots=True)
class ConverterWiring:
    """The converters, all of one type."""

    type: str = field(default="mcp3208", metadata={"choices": tuple(CHIPS)})  # a key of `CHIPS`
    bus: int = number(0, 0, 6)  # the SPI bus
    devices: tuple[int, ...] = numbers((0,), 3, 4)  # its chip selects, one a converter
    clock_hz: int = number(1_000_000, 10_000, 10_000_000)  # SPI clock
    # the input of each converter that is tied to ground: reading it empties the sampling capacitor
    # of what the last reading left there. None: there is none, and each row is read once while it
    # is grounded, which only the scheme "taxel" can do
    ground: int | None = number(6, 0, 7)


@dataclass(frozen=True, slots=True)
class CircuitWiring:
    """The analogue parts, as they were soldered in."""

    # capacitance of a row to ground: its capacitor, converter input, pin and lead
    row_pf: float = number(150.0, 1.0, 10_000.0)
    # R_m of the paper (section 3.2), from each row to ground
    bleed_mohm: float = number(50.0, 0.1, 10_000.0)
    # share of a row's voltage that comes to the converter: below 1 with C_m in series
    reach: float = number(1.0, 0.01, 1.0)


@dataclass(frozen=True, slots=True)
class Times:
    """The slots of a scan."""

    # all electrodes grounded before each slot
    discharge_s: float = number(100e-6, 1.0, 100_000.0, divisor=1e6, key="discharge_us")
    # from the column's rise to the first conversion
    settle_s: float = number(100e-6, 1.0, 100_000.0, divisor=1e6, key="settle_us")
    samples: int = number(4, 1, 256)  # conversions of one reading, which are averaged


@dataclass(frozen=True, slots=True)
class PumpWiring:
    """The pump and its pressure sensor."""

    pin: int = _pin(12)  # switches the pump; high is on
    channel: int = number(7, 0, 63)  # the converter's channel of the pressure sensor
    zero_v: float = number(0.2, 0.0, 5.0)  # its output without pressure
    v_per_kpa: float = number(0.27, 0.001, 10.0)  # its slope
    target_kpa: float = number(2.2, 0.05, 20.0)  # what the orb is inflated to
    # pressure at which the pump is refused until the next start
    limit_kpa: float = number(2.4, 0.05, 20.0)
    longest_s: float = number(20.0, 0.5, 120.0)  # how long the pump may run without a rest
    rest_s: float = number(20.0, 0.5, 600.0)  # how long it then rests


@dataclass(frozen=True, slots=True)
class Wiring:
    """Everything about one orb's hardware."""

    name: str = named("orb")  # what the orb is called
    pitch_mm: float = number(10.0, 0.1, 1000.0)  # distance of two taxels
    electrodes: Electrodes = field(default_factory=Electrodes)  # pins and channels
    converter: ConverterWiring = field(default_factory=ConverterWiring)  # which, and where
    circuit: CircuitWiring = field(default_factory=CircuitWiring)  # the analogue parts
    times: Times = field(default_factory=Times)  # the slots
    # "taxel": one row floats at a time, as in the paper; "column": all rows of a column settle
    # together
    scheme: Scheme = "column"
    supply_v: float = number(3.3, 1.0, 5.5)  # of the pins; also the converter's reference
    button: int | None = _pin(16)  # the label button's pin, to ground; None: there is none
    led: int | None = _pin(20)  # the status LED's pin; None: there is none
    # the pump; None: the orb is inflated by hand
    pump: PumpWiring | None = field(default_factory=PumpWiring)

    @property
    def rows(self) -> int:
        """Number of row electrodes."""
        return len(self.electrodes.rows)

    @property
    def columns(self) -> int:
        """Number of column electrodes."""
        return len(self.electrodes.columns)


# --- from a file ----------------------------------------------------------------------------------

_PULLED: Final = (2, 3)  # pins with resistors to the supply on every Raspberry Pi
_SPI: Final = {0: ((9, 10, 11), {0: 8, 1: 7}), 1: ((19, 20, 21), {0: 18, 1: 17, 2: 16})}


def located(path: Path) -> Path:
    """Return a description's file, that which ships for `builtin:NAME`, or raise HardwareError."""
    kind, _, name = str(path).partition(":")
    if kind != "builtin":
        return path
    known = {file.stem: file for file in files.shipped("firmware").glob("*/*.toml")}
    known["orb"] = Path(__file__).with_name("default.toml")
    if name not in known:
        raise HardwareError(f"there is no {path}; there are {', '.join(sorted(known))}")
    return known[name]


Use = tuple[str, str, str, int]  # table, key, what uses it, and the number of a pin or an input


def read(path: Path | None) -> Wiring:
    """Return the wiring in a file, or the default; HardwareError says what is wrong where."""
    if path is None:
        return Wiring()
    return config.checked(located(path), _checked, HardwareError, "orbtouch docs hardware")


def _checked(table: dict[str, Any]) -> Wiring:
    """Return the wiring of a table, or raise ConfigError."""
    wiring = _wiring(table)
    _check_pins(wiring)
    _check_channels(wiring)
    _check_scan(wiring)
    return wiring


def _wiring(table: dict[str, Any]) -> Wiring:
    """Return the wiring of a table, without what it does not name, or raise ConfigError."""
    electrodes = table.get("electrodes")
    if electrodes is None:
        raise ConfigError("has no table [electrodes], which names the pins of rows and columns")
    wiring = config.settings(Wiring, table)
    for key in ("columns", "rows", "channels"):
        if key not in electrodes:
            raise ConfigError(f"has no {key} under [electrodes]", "electrodes")
    absent: dict[str, Any] = {key: None for key in ("button", "led", "pump") if key not in table}
    if "ground" not in table.get("converter", {}):
        wiring = replace(wiring, converter=replace(wiring.converter, ground=None))
        if "scheme" not in table:
            wiring = replace(wiring, scheme="taxel")
    return replace(wiring, **absent)


# --- entries that must go together ----------------------------------------------------------------


def _check_scan(wiring: Wiring) -> None:
    """Refuse a scan, a converter or a pump that cannot work like this."""
    pump, converter = wiring.pump, wiring.converter
    if wiring.scheme == "column" and converter.ground is None:
        words = "has scheme = 'column', which needs an input tied to ground: [converter] ground"
        raise ConfigError(words, "", "scheme")
    fastest = CHIPS[converter.type].fastest_hz
    if converter.clock_hz > fastest:
        words = f"has clock_hz = {converter.clock_hz}, more than the {fastest} of {converter.type}"
        raise ConfigError(words, "converter", "clock_hz")
    if pump is not None and pump.target_kpa >= pump.limit_kpa:
        words = f"has a target_kpa that is not below limit_kpa, {pump.limit_kpa:g}"
        raise ConfigError(words, "pump", "target_kpa")


def _check_pins(wiring: Wiring) -> None:
    """Refuse pins with two uses, and rows on pins that cannot float."""
    where, chosen = wiring.converter, wiring.electrodes
    bus, selects = _SPI.get(where.bus, ((), {}))
    taken = dict.fromkeys(bus, f"SPI {where.bus}")
    for device in where.devices:
        if device in selects:
            taken[selects[device]] = f"chip select {device} of SPI {where.bus}"
    uses = [("electrodes", "columns", f"column {i}", pin) for i, pin in enumerate(chosen.columns)]
    uses += [("electrodes", "rows", f"row {i}", pin) for i, pin in enumerate(chosen.rows)]
    if wiring.pump is not None:
        uses.append(("pump", "pin", "the pump", wiring.pump.pin))
    if wiring.button is not None:
        uses.append(("", "button", "the button", wiring.button))
    if wiring.led is not None:
        uses.append(("", "led", "the LED", wiring.led))
    _check_single(uses, taken, "GPIO")
    for row, pin in enumerate(chosen.rows):
        if pin in _PULLED:
            words = f"gives GPIO {pin} to row {row}, but a resistor pulls it up; use another"
            raise ConfigError(words, "electrodes", "rows")


def _check_channels(wiring: Wiring) -> None:
    """Refuse converter inputs that do not exist or have two uses."""
    where, chosen = wiring.converter, wiring.electrodes
    inputs = CHANNELS * len(where.devices)
    if len(chosen.channels) != len(chosen.rows):
        words = f"has {len(chosen.channels)} channels for {len(chosen.rows)} rows"
        raise ConfigError(words, "electrodes", "channels")
    taken: dict[int, str] = {}
    if where.ground is not None:
        taken = {i * CHANNELS + where.ground: "ground" for i in range(len(where.devices))}
    uses = [("electrodes", "channels", f"row {i}", c) for i, c in enumerate(chosen.channels)]
    if wiring.pump is not None:
        uses.append(("pump", "channel", "the pressure sensor", wiring.pump.channel))
    for table, key, what, channel in uses:
        if channel >= inputs:
            words = f"gives input {channel} to {what}, but there are only {inputs}"
            raise ConfigError(words, table, key)
    _check_single(uses, taken, "input")


def _check_single(uses: Iterable[Use], taken: dict[int, str], kind: str) -> None:
    """Refuse a number with two uses; `taken` has the use of those that are not free."""
    for table, key, what, number in uses:
        if number in taken:
            words = f"gives {kind} {number} to {what}, but it is {taken[number]}'s"
            raise ConfigError(words, table, key)
        taken[number] = what
