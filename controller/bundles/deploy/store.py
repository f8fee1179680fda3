"""Installed bundles: a folder, and the record in it that names the one in use.

A bundle is written under the name of its hash and read again before `installed.toml` names it; both
are written by `files.atomic_write`. After an interruption, even by a power cut, the device has the
old bundle or the new one. Programs that change the folder at once wait for each other.

    FOLDER/76913f8e79414a23.orb
    FOLDER/installed.toml       current, previous, and measurements of each bundle
"""

import contextlib
import re
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import tomli_w

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.container import BundleError
from controller.shared import config, files
from controller.shared.errors import reason

RECORD: Final = "installed.toml"
KEEP: Final = 8  # bundles; the current and previous one, and the newest others
_NAME: Final = "[0-9a-f]{16}"
_FILE: Final = re.compile(rf"({_NAME})\.orb")
INCOMING: Final = "incoming"  # its folder of uploads, and of bundles that are learned
_MAX_MESSAGE: Final = 200  # characters of an error in the record


@dataclass(frozen=True, slots=True)
class StoredBundle:
    """One bundle in the store."""

    # the first 16 digits of its hash
    name: str = field(metadata={"pattern": _NAME, "expected": "16 digits of a hash"})
    step_us: float  # median control step on this device, microseconds
    installed: str  # time of installation, ISO 8601
    corrects: str | None = None  # name of the bundle that it is a correction of; None if it is none


@dataclass(frozen=True, slots=True)
class InstalledRecord:
    """Content of `installed.toml`."""

    current: str  # name of the bundle in use; "" is the shipped one
    previous: str | None = None  # name of the bundle in use before; None if there was none
    entries: tuple[StoredBundle, ...] = ()  # the bundles in the store, oldest first

    def __post_init__(self) -> None:
        known = ("", *(entry.name for entry in self.entries))
        for name in (self.current, self.previous, *(entry.corrects for entry in self.entries)):
            if name is not None and name not in known:
                raise ValueError(f"a name {name!r} that is not among its bundles")

    def entry(self, name: str) -> StoredBundle | None:
        """Return the entry of a bundle; None for the shipped one."""
        return next((entry for entry in self.entries if entry.name == name), None)

    @property
    def before(self) -> str | None:
        """The bundle before the last change, an installation too; None if there was none."""
        entry = self.entry(self.current)
        if entry is None or entry.corrects is not None:
            return None if entry is None else entry.corrects
        older = ("", *(one.name for one in self.entries[: self.entries.index(entry)]))
        return self.previous if self.previous in older else None  # a newer one was undone


class BundleStore:
    """A folder of bundles, which need not exist; by default the user's own."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or home()

    def record(self) -> InstalledRecord:
        """Return the record of what is installed; BundleError if it is damaged."""
        path = self.folder / RECORD
        try:
            return _parse(config.parse_toml(files.read_text(path, config.MAX_BYTES)))
        except FileNotFoundError:
            return InstalledRecord("")
        except OSError as error:
            problem = f"cannot be read: {reason(error)}"
        except ValueError as error:
            problem = f"is damaged: {str(error)[:_MAX_MESSAGE]}"
        raise BundleError(
            f"the record {path} {problem}; remove it to go back to the bundle that ships, then "
            "install yours again"
        )

    def path(self, name: str, rate_hz: float | None = None) -> Path:
        """Return the path of a bundle; "" is the shipped one, of a rate if there is one for it."""
        return self.folder / f"{name}.orb" if name else bundles.default_path(rate_hz)

    def current(self, rate_hz: float | None = None) -> Path:
        """Return the bundle in use; if none is installed, the shipped one of a rate."""
        return self.path(self.record().current, rate_hz)

    def install(self, data: bytes, entry: StoredBundle) -> InstalledRecord:
        """Take a tested bundle into use; the old one is kept as the previous.

        Raises:
            BundleError: The bundle reads back differently, or the record is damaged.
            OSError: It cannot be written; nothing has changed.
        """
        with files.locked(self.folder):
            before = self.record()
            path = self.path(entry.name)
            files.atomic_write(path, data)
            if path.read_bytes() != data:
                raise BundleError(f"{path} reads back differently; is the disk failing?")
            others = tuple(other for other in before.entries if other.name != entry.name)
            previous = before.current if before.current != entry.name else before.previous
            after = _kept(InstalledRecord(entry.name, previous, (*others, entry)))
            self._write(after)
            self._remove_others(after)
        return after

    def use(self, name: str) -> InstalledRecord:
        """Take a stored bundle into use, "" the shipped one; BundleError if it cannot be."""
        with files.locked(self.folder):
            return self._use(self.record(), name)

    def undo(self, *, correction: bool = False) -> InstalledRecord:
        """Undo the last change, or only a `correction`; BundleError if it was none."""
        with files.locked(self.folder):
            record = self.record()
            entry = record.entry(record.current)
            other = correction and (entry is None or entry.corrects is None)
            if other or record.before is None:
                raise BundleError("there is no change to undo")
            return self._use(record, record.before)

    def _use(self, record: InstalledRecord, name: str) -> InstalledRecord:
        """Take a bundle of the store into use; the current one is kept as the previous."""
        bundles.read(self.path(name))
        after = replace(record, current=name, previous=record.current)
        self._write(after)
        return after

    def _write(self, record: InstalledRecord) -> None:
        files.atomic_write(self.folder / RECORD, _text(record).encode())

    def _remove_others(self, record: InstalledRecord) -> None:
        """Delete bundles that the record does not name, and what killed programs left.

        The lock is held, so no program is writing here.
        """
        for path in self.folder.iterdir():
            match = _FILE.fullmatch(path.name)
            if match and record.entry(match[1]) is None:
                with contextlib.suppress(OSError):
                    path.unlink()
        files.sweep(self.folder, age_s=0.0)
        files.sweep(self.folder / INCOMING)


def home() -> Path:
    """Return the user's own store; it may not exist."""
    return files.data_folder() / "bundles"


def name_of(bundle: Bundle) -> str:
    """Return the name that a bundle has in a store."""
    return bundle.hash[:16]


def shown_name(name: str | None) -> str:
    """Return the name of a bundle for messages; "" if there is none."""
    return "" if name is None else name or "the shipped bundle"


def summary(bundle: Bundle) -> str:
    """Return the gestures and the sensor of a bundle, as text."""
    return f"{', '.join(bundle.labels[1:])}; for {sensor_summary(bundle)}"


def sensor_summary(bundle: Bundle) -> str:
    """Return the sensor of a bundle as text."""
    grid = f"{bundle.rows}×{bundle.columns} taxels"
    return f"{grid} at {bundle.rate_hz:g} Hz, {bundle.pitch_mm:g} mm apart"


def _kept(record: InstalledRecord) -> InstalledRecord:
    """Return the record without the oldest spare bundles; corrections are removed first.

    A correction of a removed bundle becomes one of the bundle that the removed one corrects.
    """
    needed = {record.current, record.previous}
    spare = [entry for entry in record.entries if entry.name not in needed]
    spare.sort(key=lambda entry: entry.corrects is None)
    removed = {entry.name: entry for entry in spare[: max(0, len(record.entries) - KEEP)]}
    kept = []
    for entry in record.entries:
        while entry.corrects in removed:
            entry = replace(entry, corrects=removed[entry.corrects].corrects)
        if entry.name not in removed:
            kept.append(entry)
    return replace(record, entries=tuple(kept))


def _text(record: InstalledRecord) -> str:
    table = _without_none(asdict(record))
    entries = table.pop("entries")
    table["bundles"] = {entry.pop("name"): _without_none(entry) for entry in entries}
    return tomli_w.dumps(table)


def _without_none(table: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if value is not None}


def _parse(table: dict[str, Any]) -> InstalledRecord:
    """Return the record in a table; ValueError if it is none."""
    listed = table.pop("bundles", {})
    if not isinstance(listed, dict) or not all(isinstance(one, dict) for one in listed.values()):
        raise ValueError("bundles is no table of tables")
    entries = tuple(
        config.settings(StoredBundle, {**values, "name": name}, name)
        for name, values in listed.items()
    )
    return config.settings(InstalledRecord, {**table, "entries": entries})
