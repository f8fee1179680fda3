"""Wirings from TOML files, every entry checked; `default.toml` shows and explains all of them."""

from collections.abc import Iterable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from controller import config
from controller.config import MAX_BYTES, ConfigError, line_of, parse_toml
from controller.errors import reason
from controller.files import read_text
from controller.sensors.hardware import HardwareError
from controller.sensors.hardware.converters import find
from controller.sensors.hardware.wiring import Wiring

_PULLED: Final = (2, 3)  # pins with resistors to the supply on every Raspberry Pi
_SPI: Final = {0: ((9, 10, 11), {0: 8, 1: 7}), 1: ((19, 20, 21), {0: 18, 1: 17, 2: 16})}
_GAIN: Final = (0.1, 10.0)

Use = tuple[str, str, str, int]  # table, key, what uses it, and the number of a pin or an input


def read(path: Path | None) -> Wiring:
    """Return the wiring in a file, or without one the default wiring.

    Raises:
        HardwareError: It cannot be read, or is none; one sentence, with the line.
    """
    if path is None:
        return shipped()
    try:
        text = read_text(path, MAX_BYTES)
    except OSError as error:
        raise HardwareError(f"cannot read {path}: {reason(error)}") from None
    return parse(text, str(path))


def shipped() -> Wiring:
    """Return the default wiring."""
    text = (files("controller.sensors.hardware") / "default.toml").read_text(encoding="utf-8")
    return parse(text, "default.toml")


def parse(text: str, source: str) -> Wiring:
    """Return the wiring in a text.

    Args:
        text: TOML.
        source: The beginning of error messages.

    Raises:
        HardwareError: It is none.
    """
    try:
        table = parse_toml(text)
    except ConfigError as error:
        raise HardwareError(f"{source}, {error}") from None
    try:
        wiring = _wiring(table)
        _check_pins(wiring)
        _check_channels(wiring)
        _check_scan(wiring)
    except ConfigError as error:
        line = line_of(text, error.table, error.key) or line_of(text, error.key)
        raise HardwareError(f"{source}{line} {error} (docs/hardware.md)") from None
    return wiring


def _wiring(table: dict[str, Any]) -> Wiring:
    """Return the wiring of a table; parts that it does not name are not there.

    Raises:
        ConfigError: An entry cannot be used.
    """
    electrodes = table.get("electrodes")
    if electrodes is None:
        raise ConfigError("has no table [electrodes], which names the pins of rows and columns")
    gain = _gain(table.pop("gain", []))
    wiring = config.settings(Wiring, table)
    for key in ("columns", "rows", "channels"):
        if key not in electrodes:
            raise ConfigError(f"has no {key} under [electrodes]", "electrodes")
    absent: dict[str, Any] = {key: None for key in ("button", "led", "pump") if key not in table}
    if "ground" not in table.get("converter", {}):
        wiring = replace(wiring, converter=replace(wiring.converter, ground=None))
        if "scheme" not in table:
            wiring = wiring.scanned("taxel")
    return replace(wiring, gain=gain, **absent)


def _gain(rows: Any) -> tuple[tuple[float, ...], ...]:
    """Return the gains of taxels, row by row.

    Raises:
        ConfigError: They are no numbers within limits.
    """
    low, high = _GAIN
    if isinstance(rows, list) and all(isinstance(row, list) for row in rows):
        numbers = [one for row in rows for one in row]
        if all(type(one) in (int, float) and low <= one <= high for one in numbers):
            return tuple(tuple(float(one) for one in row) for row in rows)
    expected = f"rows of numbers from {low:g} to {high:g}, [[1.0, 0.98, ...], ...]"
    raise ConfigError(f"has gain = {rows!r}; expected is {expected}", "", "gain")


# --- entries that must go together ----------------------------------------------------------------


def _check_scan(wiring: Wiring) -> None:
    """Refuse a scan, a converter or a pump that cannot work like this."""
    order, pump, converter = wiring.order, wiring.pump, wiring.converter
    if order and sorted(order) != list(range(wiring.columns)):
        words = f"has an order without each column, 0 to {wiring.columns - 1}, once"
        raise ConfigError(words, "", "order")
    if wiring.scheme == "column" and converter.ground is None:
        words = "has scheme = 'column', which needs an input tied to ground: [converter] ground"
        raise ConfigError(words, "", "scheme")
    if wiring.gain and [len(row) for row in wiring.gain] != [wiring.columns] * wiring.rows:
        words = f"has a gain that is not {wiring.rows} rows of {wiring.columns} numbers"
        raise ConfigError(words, "", "gain")
    fastest = find(converter.type).fastest_hz
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
    where, chosen, chip = wiring.converter, wiring.electrodes, find(wiring.converter.type)
    inputs = chip.channels * len(where.devices)
    if len(chosen.channels) != len(chosen.rows):
        words = f"has {len(chosen.channels)} channels for {len(chosen.rows)} rows"
        raise ConfigError(words, "electrodes", "channels")
    taken: dict[int, str] = {}
    if where.ground is not None:
        if where.ground >= chip.channels:
            words = f"has ground = {where.ground}, which is no input of a {where.type}"
            raise ConfigError(words, "converter", "ground")
        taken = {i * chip.channels + where.ground: "ground" for i in range(len(where.devices))}
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
