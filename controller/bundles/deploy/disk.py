"""The disk under the shelf: each call is a step that happens or does not."""

import contextlib
import os
from pathlib import Path
from typing import Protocol

from controller.files import sync, sync_folder


class Files(Protocol):
    """What the shelf asks of a folder; a power cut may come before or after any call."""

    def write(self, path: Path, data: bytes) -> None:
        """Write a file and return when it is on the disk itself; cut short, part of it is there.

        Raises:
            OSError: The disk is full or fails.
        """

    def rename(self, path: Path, to: Path) -> None:
        """Give a file the name of another, which it replaces; return when that is on the disk.

        Raises:
            OSError: It cannot be done.
        """

    def remove(self, path: Path) -> None:
        """Delete a file, if it is there and that is possible."""


class RealFiles:
    """The file system."""

    def write(self, path: Path, data: bytes) -> None:
        """Write a file and have it on the disk."""
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            file.write(data)
            file.flush()
            sync(file.fileno())

    def rename(self, path: Path, to: Path) -> None:
        """Replace a file and have that on the disk."""
        os.replace(path, to)  # noqa: PTH105 (Path.replace does the same; the pair reads better)
        sync_folder(to.parent)

    def remove(self, path: Path) -> None:
        """Delete a file."""
        with contextlib.suppress(OSError):
            path.unlink()
