"""The folder of installed bundles, and the one line in it that says which of them is in use.

A bundle is written under the name of its hash and read again before `installed.toml` speaks of it;
that file is replaced in one step. So whatever stops an installation, even the power, the device
has the old bundle or the new one.

    FOLDER/76913f8e79414a23.orb
    FOLDER/installed.toml       current, previous, and what each was measured to need
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from controller import bundle as bundles
from controller import folders, toml_text
from controller.bundle import Bundle, BundleError
from controller.config import parse_toml
from controller.errors import reason
from controller.files import read_text
from controller.record import record

if TYPE_CHECKING:
    from controller.shelf.files import Files

RECORD: Final = "installed.toml"
KEEP: Final = 8  # bundles; the two that count and the newest others
_NAME: Final = r"[0-9a-f]{16}"
_MAX_BYTES: Final = 64 << 10  # of the record; its eight entries have some hundred each
_MAX_MESSAGE: Final = 200  # characters of what is wrong with it


@record
class Entry:
    """One bundle on the shelf.

    Attributes:
        name: The first 16 digits of its hash.
        engine: What runs it fastest here.
        step_us: Median of a control step with that engine, microseconds.
        installed: When, ISO 8601.
    """

    name: str
    engine: str
    step_us: float
    installed: str


@record
class Record:
    """What `installed.toml` says.

    Attributes:
        current: The name of the bundle in use; "" is the one that ships.
        previous: The one that was in use before, likewise; None if there was none.
        entries: The bundles on the shelf, oldest first.
    """

    current: str = ""
    previous: str | None = None
    entries: tuple[Entry, ...] = ()

    def entry(self, name: str) -> Entry | None:
        """Return what is known of a bundle."""
        return next((entry for entry in self.entries if entry.name == name), None)


class Shelf:
    """A folder of bundles."""

    def __init__(self, folder: Path | None = None, files: Files | None = None) -> None:
        """Look at a folder, by default the user's own; it need not exist."""
        self.folder = folder or home()
        if files is not None:
            self._files = files

    @cached_property
    def _files(self) -> Files:
        """The disk, for those who install."""
        from controller.shelf.files import RealFiles

        return RealFiles()

    def record(self) -> Record:
        """Return what is installed.

        Raises:
            BundleError: The record is damaged.
        """
        path = self.folder / RECORD
        try:
            return _parse(parse_toml(read_text(path, _MAX_BYTES)))
        except FileNotFoundError:
            return Record()
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

    def install(self, data: bytes, entry: Entry) -> Record:
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
        after = Record(entry.name, previous, (*others, entry))
        kept = _kept(after)
        self._switch(kept)
        for gone in set(after.entries) - set(kept.entries):
            self._files.remove(self.path(gone.name))
        return kept

    def rollback(self) -> Record:
        """Take the bundle of before into use; a second time brings the newer one back.

        Raises:
            BundleError: There is none, or it is damaged, or the record is.
            OSError: The record cannot be written; then nothing has changed.
        """
        record = self.record()
        if record.previous is None:
            raise BundleError("nothing was installed before this bundle, so there is no way back")
        bundles.read(self.path(record.previous))
        after = replace(record, current=record.previous, previous=record.current)
        self._switch(after)
        return after

    def _switch(self, record: Record) -> None:
        """Replace the record, in one step."""
        beside = self.folder / f"{RECORD}.new"
        try:
            self._files.write(beside, _text(record).encode())
            self._files.rename(beside, self.folder / RECORD)
        finally:
            self._files.remove(beside)


def home() -> Path:
    """Return the user's own shelf; it may not exist."""
    return folders.data() / "bundles"


def name_of(bundle: Bundle) -> str:
    """Return the name that a bundle has on a shelf."""
    return bundle.hash[:16]


def _kept(record: Record) -> Record:
    """Return the record without the oldest bundles that nobody goes back to."""
    needed = {record.current, record.previous}
    spare = [entry for entry in record.entries if entry.name not in needed]
    gone = set(spare[: max(0, len(record.entries) - KEEP)])
    return replace(record, entries=tuple(e for e in record.entries if e not in gone))


def _text(record: Record) -> str:
    table: dict[str, Any] = {"current": record.current}
    if record.previous is not None:
        table["previous"] = record.previous
    table["bundles"] = {
        entry.name: {
            "engine": entry.engine,
            "step_us": round(entry.step_us, 1),
            "installed": entry.installed,
        }
        for entry in record.entries
    }
    return toml_text.dumps(table)


def _parse(table: dict[str, Any]) -> Record:
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
    return Record(current, previous, entries)


def _entry(name: str, values: Any) -> Entry:
    if not re.fullmatch(_NAME, name):
        raise ValueError(f"{name!r} is no bundle's name")
    match values:
        case {"engine": str(engine), "step_us": int() | float() as step_us, "installed": str(when)}:
            if 0.0 <= step_us < 1e9:
                return Entry(name, engine, float(step_us), when)
    raise ValueError(f"bundles.{name} has no engine, step_us and installed")
