"""Store of known devices, a table `KnownDevice` under the identity that each reports.

The file is devices.toml in the user's configuration folder. It is never half written; a damaged one
is put aside.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import tomli_w

from controller.shared.config import parse_toml, settings
from controller.shared.errors import reason
from controller.shared.files import atomic_write, config_folder, read_text
from tetris.files import load

MOST: Final = 64  # devices; the one that was not seen for the longest time makes room
_MAX_BYTES: Final = 256 * 1024

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class KnownDevice:
    """A device that was here before."""

    device_id: str  # its identity, whatever its port
    name: str = ""  # what it calls itself
    virtual: bool = False
    port: str = ""  # where it last was: a port's name or URL
    seen: str = ""  # when, in UTC, as ISO 8601
    target: str = ""  # what it played last; "": nothing yet
    keys: str = ""  # path of the mapping that it played with; "": the target's own
    profile: str = ""  # of that mapping; "": the first one
    key: str = ""  # path of the key that it was met with; "": none


def default_path() -> Path:
    """Return the user's own file; it may not exist yet."""
    return config_folder() / "devices.toml"


class DeviceStore:
    """The devices that are known, in a file."""

    def __init__(self, path: Path | None = None, warn: Callable[[str], None] = log.warning) -> None:
        """Read the file (None: the user's own); `warn` takes a sentence if it is damaged."""
        self._path, self._warn = path or default_path(), warn
        self._known = self._read()

    @property
    def devices(self) -> list[KnownDevice]:
        """All of them, the one that was here last first."""
        return sorted(self._known.values(), key=lambda known: known.seen, reverse=True)

    def named(self, words: str) -> list[KnownDevice]:
        """Return the devices of an identity or, if there are none, of a name."""
        exact = self._known.get(words)
        return [exact] if exact else [known for known in self.devices if known.name == words]

    def remember(self, device_id: str, **values: Any) -> None:
        """Note something of a device, and write the file; a disk that is full costs a warning."""
        before = self._known.get(device_id, KnownDevice(device_id))
        known = replace(before, **values)
        if known == before and device_id in self._known:
            return
        # Others may have written since; what they noted of other devices stays.
        self._known = {**self._read(), device_id: known}
        self._write()

    def _write(self) -> None:
        self._known = {device.device_id: device for device in self.devices[:MOST]}
        known = {
            name: {field: getattr(device, field) for field in _NAMES}
            for name, device in self._known.items()
        }
        text = "# Known devices (orbtouch docs find).\n\n" + tomli_w.dumps({"device": known})
        try:
            atomic_write(self._path, text.encode(), private=True)
        except OSError as error:
            self._warn(f"cannot write {self._path}: {reason(error)}")

    def _read(self) -> dict[str, KnownDevice]:
        """Return what the file holds; one that is damaged is put aside, and told of."""
        none: dict[str, KnownDevice] = {}
        known, trouble = load(self._path, _load, none)
        if trouble:
            self._warn(trouble)
        return known


def _load(path: Path) -> dict[str, KnownDevice]:
    """Return the devices of a file; ValueError if a value cannot be used."""
    devices: Any = parse_toml(read_text(path, _MAX_BYTES), _MAX_BYTES).get("device", {})
    if not isinstance(devices, dict) or not all(isinstance(one, dict) for one in devices.values()):
        raise ValueError("device is no table of tables")
    return {
        device_id: settings(KnownDevice, {**entry, "device_id": device_id}, f"device.{device_id}")
        for device_id, entry in devices.items()
    }


_NAMES: Final = tuple(field.name for field in fields(KnownDevice) if field.name != "device_id")
