"""The folder of installed bundles, and the one line in it that says which of them is in use.

A bundle is written under the name of its hash and read again before `installed.toml` speaks of it;
that file is replaced in one step. So whatever stops an installation, even the power, the device
has the old bundle or the new one.

    FOLDER/76913f8e79414a23.orb
    FOLDER/installed.toml       current, previous, and what each was measured to need
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import tomli_w

from controller import files
from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle, BundleError
from controller.config import parse_toml
from controller.errors import reason
from controller.files import read_text

if TYPE_CHECKING:
    from controller.bundles.deploy.disk import Files

RECORD: Final = "installed.toml"
KEEP: Final = 8  # bundles; the two that count and the newest others
_NAME: Final = r"[0-9a-f]{16}"
_MAX_BYTES: Final = 64 << 10  # of the record; its eight entries have some hundred each
_MAX_MESSAGE: Final = 200  # characters of what is wrong with it


@dataclass(frozen=True, slots=True)
class StoredBundle:
    """One bundle on the shelf.

    Attributes:
        name: The first 16 digits of its hash.
        engine: What runs it fastest here.
        step_us: Median of a control step with that engine, microseconds.
        installed: When, ISO 8601.
        corrects: The name of the bundle that it is a correction of; None: it is none.
    """

    name: str
    engine: str
    step_us: float
    installed: str
    corrects: str | None = None


@dataclass(frozen=True, slots=True)
class InstalledRecord:
    """What `installed.toml` says.

    Attributes:
        current: The name of the bundle in use; "" is the one that ships.
        previous: The one that was in use before, likewise; None if there was none.
        entries: The bundles on the shelf, oldest first.
    """

    current: str = ""
    previous: str | None = None
    entries: tuple[StoredBundle, ...] = ()

    def entry(self, name: str) -> StoredBundle | None:
        """Return what is known of a bundle."""
        return next((entry for entry in self.entries if entry.name == name), None)


class BundleStore:
    """A folder of bundles."""

    def __init__(self, folder: Path | None = None, files: Files | None = None) -> None:
        """Look at a folder, by default the user's own; it need not exist."""
        self.folder = folder or home()
        if files is not None:
            self._files = files

    @cached_property
    def _files(self) -> Files:
        """The disk, for those who install."""
        from controller.bundles.deploy.disk import RealFiles

        return RealFiles()

    def record(self) -> InstalledRecord:
        """Return what is installed.

        Raises:
            BundleError: The record is damaged.
        """
        path = self.folder / RECORD
        try:
            return _parse(parse_toml(read_text(path, _MAX_BYTES)))
        except FileNotFoundError:
            return InstalledRecord()
        except OSError as error:
            problem = f"cannot be read: {reason(error)}"
        except ValueError as error:
            problem = f"is damaged: {str(error)[:_MAX_MESSAGE]}"
        raise BundleError(
            f"the record {path} {problem}; remove it to go back to the bundle that ships, then "
            "install yours again"
        )

    def path(self, name: str) -> Path:
        """Return where the bundle of a name is; "" is the one that ships."""
        return self.folder / f"{name}.orb" if name else bundles.default_path()

    def current(self) -> tuple[Path, str]:
        """Return the bundle in use, and the engine that runs it fastest ("": not measured).

        Raises:
            BundleError: The record is damaged.
        """
        record = self.record()
        entry = record.entry(record.current)
        return self.path(record.current), entry.engine if entry else ""

    def install(self, data: bytes, entry: StoredBundle) -> InstalledRecord:
        """Take a proved bundle into use; the old one stays for `rollback`.

        Raises:
            BundleError: The bundle, read again, is not what was written, or the record is damaged.
            OSError: It cannot be written; then nothing has changed.
        """
        before = self.record()
        path = self.path(entry.name)
        beside = path.with_suffix(".new")
        try:
            self._files.write(beside, data)
            if beside.read_bytes() != data:
                raise BundleError(f"{beside} is not what was written; is the disk failing?")
            self._files.rename(beside, path)
        finally:
            self._files.remove(beside)
        others = tuple(other for other in before.entries if other.name != entry.name)
        previous = before.current if before.current != entry.name else before.previous
        after = InstalledRecord(entry.name, previous, (*others, entry))
        kept = _kept(after)
        self._switch(kept)
        for gone in {e.name for e in after.entries} - {e.name for e in kept.entries}:
            self._files.remove(self.path(gone))
        return kept

    def rollback(self) -> InstalledRecord:
        """Take the bundle of before into use; a second time brings the newer one back.

        Raises:
            BundleError: There is none, or it is damaged, or the record is.
            OSError: The record cannot be written; then nothing has changed.
        """
        record = self.record()
        if record.previous is None:
            raise BundleError("nothing was installed before this bundle, so there is no way back")
        return self._use(record, record.previous)

    def take_back(self) -> InstalledRecord:
        """Take the bundle into use that the present one is a correction of; others likewise.

        Raises:
            BundleError: It is no correction, or what it corrects is damaged, or the record is.
            OSError: The record cannot be written; then nothing has changed.
        """
        record = self.record()
        entry = record.entry(record.current)
        if entry is None or entry.corrects is None:
            raise BundleError("there is no correction to take back")
        return self._use(record, entry.corrects)

    def _use(self, record: InstalledRecord, name: str) -> InstalledRecord:
        """Take a bundle of the shelf into use; the present one stays for `rollback`."""
        bundles.read(self.path(name))
        after = replace(record, current=name, previous=record.current)
        self._switch(after)
        return after

    def _switch(self, record: InstalledRecord) -> None:
        """Replace the record, in one step."""
        beside = self.folder / f"{RECORD}.new"
        try:
            self._files.write(beside, _text(record).encode())
            self._files.rename(beside, self.folder / RECORD)
        finally:
            self._files.remove(beside)


def home() -> Path:
    """Return the user's own shelf; it may not exist."""
    return files.data_folder() / "bundles"


def name_of(bundle: Bundle) -> str:
    """Return the name that a bundle has on a shelf."""
    return bundle.hash[:16]


def _kept(record: InstalledRecord) -> InstalledRecord:
    """Return the record without the oldest bundles that are spare, corrections first.

    A correction of a bundle that goes becomes one of what that bundle corrects.
    """
    needed = {record.current, record.previous}
    spare = [entry for entry in record.entries if entry.name not in needed]
    spare.sort(key=lambda entry: entry.corrects is None)
    gone = {entry.name: entry for entry in spare[: max(0, len(record.entries) - KEEP)]}
    kept = []
    for entry in record.entries:
        while entry.corrects in gone:
            entry = replace(entry, corrects=gone[entry.corrects].corrects)
        if entry.name not in gone:
            kept.append(entry)
    return replace(record, entries=tuple(kept))


def _text(record: InstalledRecord) -> str:
    table: dict[str, Any] = {"current": record.current}
    if record.previous is not None:
        table["previous"] = record.previous
    table["bundles"] = {
        entry.name: {
            "engine": entry.engine,
            "step_us": round(entry.step_us, 1),
            "installed": entry.installed,
            **({} if entry.corrects is None else {"corrects": entry.corrects}),
        }
        for entry in record.entries
    }
    return tomli_w.dumps(table)


def _parse(table: dict[str, Any]) -> InstalledRecord:
    """Return the record that a table describes.

    Raises:
        ValueError: It describes none.
    """
    listed = table.get("bundles", {})
    if not isinstance(listed, dict):
        raise ValueError("bundles is no table")
    entries = tuple(_entry(name, values) for name, values in listed.items())
    known = ["", *(entry.name for entry in entries)]
    current, previous = table.get("current"), table.get("previous")
    if current not in known or previous not in (None, *known):
        raise ValueError(f"it names a bundle {current!r} or {previous!r} that it does not list")
    for entry in entries:
        if entry.corrects not in (None, *known):
            raise ValueError(f"it names a bundle {entry.corrects!r} that it does not list")
    return InstalledRecord(current, previous, entries)


def _entry(name: str, values: Any) -> StoredBundle:
    if not re.fullmatch(_NAME, name):
        raise ValueError(f"{name!r} is no bundle's name")
    match values:
        case {"engine": str(engine), "step_us": int() | float() as step_us, "installed": str(when)}:
            corrects = values.get("corrects")
            if 0.0 <= step_us < 1e9 and isinstance(corrects, str | None):
                return StoredBundle(name, engine, float(step_us), when, corrects)
    raise ValueError(f"bundles.{name} has no engine, step_us and installed")
