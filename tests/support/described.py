"""Descriptions of sensors and wirings from texts, read as users' files are: from mine.toml."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

from controller.sensors.hardware import description, wiring

Read = TypeVar("Read")


def described(text: str) -> description.Description:
    """Return the description in a text, or raise SensorError."""
    return _read(text, lambda path: description.read(path, "lines"))


def wired(text: str) -> wiring.Wiring:
    """Return the wiring in a text, or raise HardwareError."""
    return _read(text, wiring.read)


def _read(text: str, read: Callable[[Path], Read]) -> Read:
    with TemporaryDirectory() as folder:
        path = Path(folder, "mine.toml")
        path.write_text(text, encoding="utf-8")
        return read(path)
