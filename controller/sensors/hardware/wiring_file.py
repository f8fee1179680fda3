"""A wiring from a TOML file, every line checked; `default.toml` shows and explains all of them."""

import re
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from controller.config import MAX_BYTES, ConfigError, line_of, parse_toml
from controller.errors import reason
from controller.files import read_text
from controller.sensors.hardware import HardwareError
from controller.sensors.hardware.converters import find, names
from controller.sensors.hardware.wiring import (
    SCHEMES,
    CircuitWiring,
    ConverterWiring,
    Electrodes,
    PumpWiring,
    Times,
    Wiring,
)

Check = Callable[[str, Any], Any]  # (where, value) -> the value, or an error

MOST: Final = 32  # electrodes of one kind
_PULLED: Final = (2, 3)  # pins with resistors to the supply on every Raspberry Pi
_SPI: Final = {0: ((9, 10, 11), {0: 8, 1: 7}), 1: ((19, 20, 21), {0: 18, 1: 17, 2: 16})}


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
        source: What errors begin with.

    Raises:
        HardwareError: It is none.
    """
    try:
        table = parse_toml(text)
    except ConfigError as error:
        raise HardwareError(f"{source}, {error}") from None
    try:
        wiring = _wiring(table)
        _together(wiring)
    except _FaultyError as fault:
        line = line_of(text, fault.table, fault.name) or line_of(text, fault.name)
        raise HardwareError(f"{source}{line}: {fault} (docs/hardware.md)") from None
    return wiring


class _FaultyError(ValueError):
    """An entry cannot be used."""

    def __init__(self, table: str, name: str, message: str) -> None:
        where = f"[{table}] {name}" if table else name
        super().__init__(f"{where} {message}")
        self.table, self.name = table, name


# --- single entries -------------------------------------------------------------------------------


def _number(least: float, most: float, parts: float = 1.0) -> Check:
    """Return a check for a number within limits; it is divided by `parts`."""

    def check(where: str, value: Any) -> float:
        if type(value) not in (int, float) or not least <= value <= most:
            raise ValueError(f"is {value!r}; write a number from {least:g} to {most:g}")
        return float(value) / parts

    return check


def _whole(least: int, most: int) -> Check:
    def check(where: str, value: Any) -> int:
        if type(value) is not int or not least <= value <= most:
            raise ValueError(f"is {value!r}; write a whole number from {least} to {most}")
        return value

    return check


def _wholes(least: int, most: int, limit: int = MOST) -> Check:
    """Return a check for a list of different whole numbers."""
    one = _whole(least, most)

    def check(where: str, value: Any) -> tuple[int, ...]:
        if not isinstance(value, list) or not 1 <= len(value) <= limit:
            raise ValueError(f"is {value!r}; write a list of 1 to {limit} numbers")
        numbers = tuple(one(where, number) for number in value)
        for number in numbers:
            if numbers.count(number) > 1:
                raise ValueError(f"has {number} twice")
        return numbers

    return check


def _one_of(*words: str) -> Check:
    def check(where: str, value: Any) -> str:
        if value not in words:
            raise ValueError(f"is {value!r}; it is {' or '.join(map(repr, words))}")
        return str(value)

    return check


def _name(where: str, value: Any) -> str:
    if not isinstance(value, str) or not re.fullmatch(r"[A-Za-z0-9_-]{1,24}", value):
        raise ValueError(f"is {value!r}; write up to 24 letters, digits, - and _")
    return value


def _gains(where: str, value: Any) -> tuple[tuple[float, ...], ...]:
    one = _number(0.1, 10.0)
    if not isinstance(value, list) or not all(isinstance(row, list) for row in value):
        raise ValueError("is no list of rows; write [[1.0, 0.98, ...], ...]")
    return tuple(tuple(one(where, number) for number in row) for row in value)


_PIN: Final = _whole(0, 27)
_PINS: Final = _wholes(0, 27)
_PLAIN: Final[dict[str, Check]] = {
    "name": _name,
    "pitch_mm": _number(0.1, 1000.0),
    "scheme": _one_of(*SCHEMES),
    "order": _wholes(0, MOST - 1),
    "supply_v": _number(1.0, 5.5),
    "button": _PIN,
    "led": _PIN,
    "gain": _gains,
}
_SECTIONS: Final[dict[str, tuple[type, dict[str, tuple[str, Check]]]]] = {
    "electrodes": (
        Electrodes,
        {
            "columns": ("columns", _PINS),
            "rows": ("rows", _PINS),
            "channels": ("channels", _wholes(0, 63)),
        },
    ),
    "converter": (
        ConverterWiring,
        {
            "type": ("type", _one_of(*names())),
            "bus": ("bus", _whole(0, 6)),
            "devices": ("devices", _wholes(0, 3)),
            "clock_hz": ("clock_hz", _whole(10_000, 10_000_000)),
            "ground": ("ground", _whole(0, 7)),
        },
    ),
    "circuit": (
        CircuitWiring,
        {
            "row_pf": ("row_pf", _number(1.0, 10_000.0)),
            "bleed_mohm": ("bleed_mohm", _number(0.1, 10_000.0)),
            "reach": ("reach", _number(0.01, 1.0)),
            "ghosting": ("ghosting", _number(0.0, 1.0)),
        },
    ),
    "times": (
        Times,
        {
            "discharge_us": ("discharge_s", _number(1.0, 100_000.0, 1e6)),
            "settle_us": ("settle_s", _number(1.0, 100_000.0, 1e6)),
            "samples": ("samples", _whole(1, 256)),
        },
    ),
    "pump": (
        PumpWiring,
        {
            "pin": ("pin", _PIN),
            "channel": ("channel", _whole(0, 63)),
            "zero_v": ("zero_v", _number(0.0, 5.0)),
            "v_per_kpa": ("v_per_kpa", _number(0.001, 10.0)),
            "target_kpa": ("target_kpa", _number(0.05, 20.0)),
            "limit_kpa": ("limit_kpa", _number(0.05, 20.0)),
            "longest_s": ("longest_s", _number(0.5, 120.0)),
            "rest_s": ("rest_s", _number(0.5, 600.0)),
        },
    ),
}


def _wiring(table: dict[str, Any]) -> Wiring:
    """Return the wiring of a table, every entry checked by itself."""
    for name in table:
        if name not in _PLAIN and name not in _SECTIONS:
            known = ", ".join([*_PLAIN, *(f"[{section}]" for section in _SECTIONS)])
            raise _FaultyError("", name, f"is unknown; there are {known}")
    if "electrodes" not in table:
        raise _FaultyError("", "[electrodes]", "is missing; it says what hangs on which pin")
    given: dict[str, Any] = {
        name: _checked("", name, check, table[name])
        for name, check in _PLAIN.items()
        if name in table
    }
    for section, (kind, entries) in _SECTIONS.items():
        if section not in table:
            continue
        if not isinstance(table[section], dict):
            raise _FaultyError("", section, f"is no table; write [{section}] above its entries")
        made: dict[str, Any] = {}
        for name, value in table[section].items():
            if name not in entries:
                raise _FaultyError(section, name, f"is unknown; there are {', '.join(entries)}")
            field, check = entries[name]
            made[field] = _checked(section, name, check, value)
        for name in entries if section == "electrodes" else ():
            if name not in made:
                raise _FaultyError(section, name, "is missing")
        if section == "converter":
            made.setdefault("ground", None)
        given[section] = kind(**made)
    if "converter" not in given or given["converter"].ground is None:
        given.setdefault("scheme", "taxel")
    bare = replace(
        Wiring(), converter=ConverterWiring(ground=None), button=None, led=None, pump=None
    )
    return replace(bare, **given)


def _checked(table: str, name: str, check: Check, value: Any) -> Any:
    try:
        return check(name, value)
    except _FaultyError:
        raise
    except ValueError as error:
        raise _FaultyError(table, name, str(error)) from None


# --- what must go together ------------------------------------------------------------------------


def _together(wiring: Wiring) -> None:
    """Refuse entries that do not go together."""
    _pins(wiring)
    _channels(wiring)
    electrodes, pump = wiring.electrodes, wiring.pump
    if wiring.order and sorted(wiring.order) != list(range(len(electrodes.columns))):
        raise _FaultyError(
            "", "order", f"does not have each column, 0 to {len(electrodes.columns) - 1}, once"
        )
    if wiring.scheme == "column" and wiring.converter.ground is None:
        raise _FaultyError(
            "", "scheme", "is 'column', which needs an input tied to ground: see [converter] ground"
        )
    if wiring.gain and [len(row) for row in wiring.gain] != [wiring.columns] * wiring.rows:
        raise _FaultyError("", "gain", f"is not {wiring.rows} rows of {wiring.columns} numbers")
    fastest = find(wiring.converter.type).fastest_hz
    if wiring.converter.clock_hz > fastest:
        raise _FaultyError(
            "converter", "clock_hz", f"is more than the {fastest} that {wiring.converter.type} can"
        )
    if pump is not None and pump.target_kpa >= pump.limit_kpa:
        raise _FaultyError("pump", "target_kpa", f"is not below limit_kpa, {pump.limit_kpa:g}")


def _pins(wiring: Wiring) -> None:
    """Refuse pins that two things want, or that cannot float."""
    where, chosen = wiring.converter, wiring.electrodes
    bus, selects = _SPI.get(where.bus, ((), {}))
    taken = dict.fromkeys(bus, f"SPI {where.bus}")
    for device in where.devices:
        if device in selects:
            taken[selects[device]] = f"chip select {device} of SPI {where.bus}"
    wanted = [("electrodes", "columns", f"column {i}", p) for i, p in enumerate(chosen.columns)]
    wanted += [("electrodes", "rows", f"row {i}", pin) for i, pin in enumerate(chosen.rows)]
    if wiring.pump is not None:
        wanted.append(("pump", "pin", "the pump", wiring.pump.pin))
    if wiring.button is not None:
        wanted.append(("", "button", "the button", wiring.button))
    if wiring.led is not None:
        wanted.append(("", "led", "the LED", wiring.led))
    for table, name, what, pin in wanted:
        if pin in taken:
            raise _FaultyError(table, name, f"gives GPIO {pin} to {what}, but it is {taken[pin]}'s")
        if pin in _PULLED and name == "rows":
            raise _FaultyError(
                table, name, f"gives GPIO {pin} to {what}, but a resistor pulls it up; use another"
            )
        taken[pin] = what


def _channels(wiring: Wiring) -> None:
    """Refuse converter inputs that are not there, or that two things want."""
    where, chosen, chip = wiring.converter, wiring.electrodes, find(wiring.converter.type)
    inputs = chip.channels * len(where.devices)
    if len(chosen.channels) != len(chosen.rows):
        raise _FaultyError(
            "electrodes", "channels", f"has {len(chosen.channels)} for {len(chosen.rows)} rows"
        )
    taken: dict[int, str] = {}
    if where.ground is not None:
        if where.ground >= chip.channels:
            raise _FaultyError("converter", "ground", f"is no input of a {where.type}")
        for i in range(len(where.devices)):
            taken[i * chip.channels + where.ground] = "ground"
    wanted = [("electrodes", "channels", f"row {i}", c) for i, c in enumerate(chosen.channels)]
    if wiring.pump is not None:
        wanted.append(("pump", "channel", "the pressure sensor", wiring.pump.channel))
    for table, name, what, channel in wanted:
        if channel >= inputs:
            raise _FaultyError(
                table, name, f"gives input {channel} to {what}, but there are only {inputs}"
            )
        if channel in taken:
            raise _FaultyError(
                table, name, f"gives input {channel} to {what}, but it is {taken[channel]}'s"
            )
        taken[channel] = what
