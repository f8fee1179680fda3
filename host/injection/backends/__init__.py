"""Ways to press a key in the program that has the focus: one file each, found by name.

A back end is `create(kind)` in a module of this package. If its `ENDS_WITH_PROCESS` is true, the
kernel releases its keys when its process dies.
"""

import importlib
import os
import sys
from abc import ABC, abstractmethod
from typing import Final, cast

from controller.errors import TroubleError
from controller.keymap.keymap import Kind

AUTO: Final = "auto"
NAMES: Final = ("uinput", "x11", "windows", "macos")


class BackendError(TroubleError, OSError):
    """Keys cannot be pressed here; the message is one sentence with what to do."""


class Backend(ABC):
    """A device that presses keys, named as in `controller.keymap.key_names`."""

    def press(self, key: str) -> None:
        """Put a key down.

        Raises:
            OSError: The system refuses it.
        """
        self.set(key, down=True)

    def release(self, key: str) -> None:
        """Put a key up; one that is up stays up.

        Raises:
            OSError: The system refuses it.
        """
        self.set(key, down=False)

    @abstractmethod
    def set(self, key: str, *, down: bool) -> None:
        """Put a key down, or up."""

    def close(self) -> None:  # noqa: B027
        """Close the device."""


def open_backend(name: str, kind: Kind) -> tuple[str, Backend]:
    """Open a back end by name, or the best there is; return its name with it.

    Raises:
        BackendError: It cannot be used here.
    """
    if name != AUTO:
        return name, _create(name, kind)
    if sys.platform == "win32":
        return "windows", _create("windows", kind)
    if sys.platform == "darwin":
        return "macos", _create("macos", kind)
    try:
        return "uinput", _create("uinput", kind)
    except BackendError as error:
        if kind == "gamepad" or not os.environ.get("DISPLAY") or _wayland():
            raise
        refused = str(error)
    try:
        return "x11", _create("x11", kind)
    except BackendError as error:
        raise BackendError(f"{refused}; or through X11: {error}") from None


def ends_with_process(name: str) -> bool:
    """Return whether the keys of a back end go up by themselves when its process is killed."""
    return bool(importlib.import_module(f"{__name__}.{name}").ENDS_WITH_PROCESS)


def _create(name: str, kind: Kind) -> Backend:
    return cast(Backend, importlib.import_module(f"{__name__}.{name}").create(kind))


def _wayland() -> bool:
    """Whether X11 would reach a few windows only."""
    session = os.environ.get("XDG_SESSION_TYPE", "")
    return session == "wayland" or bool(os.environ.get("WAYLAND_DISPLAY"))
