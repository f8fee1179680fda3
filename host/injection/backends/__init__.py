"""Key injection into the program with the focus: back ends, found by name.

A back end is `create(name, kind)` in a module of this package. If its `ENDS_WITH_PROCESS` is true,
the kernel releases its keys when its process dies.
"""

import importlib
import os
import sys
from abc import ABC, abstractmethod
from types import ModuleType
from typing import Final, cast

from controller.shared.errors import TroubleError
from controller.shared.keymap.keymap import Kind

AUTO: Final = "auto"
PRINT: Final = "print"  # in place of a back end: strokes are printed
NAMES: Final = ("uinput", "x11", "windows", "macos")
_BY_SYSTEM: Final = {"win32": "windows", "darwin": "macos"}


class BackendError(TroubleError, OSError):
    """Keys cannot be pressed here; the message is one sentence with what to do."""


class Backend(ABC):
    """A device that presses keys, named as in `controller.shared.keymap.key_names`."""

    @abstractmethod
    def set(self, key: str, *, down: bool) -> None:
        """Press a key, or release it if it is down; OSError if the system refuses it."""

    def close(self) -> None:  # noqa: B027
        """Close the device."""


def open_backend(name: str, kind: Kind) -> tuple[str, Backend]:
    """Open a back end by name, or the best (BackendError: none); return its name with it."""
    name = _BY_SYSTEM.get(sys.platform, AUTO) if name == AUTO else name
    if name != AUTO:
        return name, _create(name, kind)
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
    """Return whether the system releases the keys of a back end when its process is killed."""
    return bool(_module(name).ENDS_WITH_PROCESS)


def _create(name: str, kind: Kind) -> Backend:
    return cast(Backend, _module(name).create(name, kind))


def _module(name: str) -> ModuleType:
    own = "by_pynput" if name in ("x11", "macos") else name
    return importlib.import_module(f"{__name__}.{own}")


def _wayland() -> bool:
    """Return whether the session is Wayland's, where X11 reaches few windows."""
    session = os.environ.get("XDG_SESSION_TYPE", "")
    return session == "wayland" or bool(os.environ.get("WAYLAND_DISPLAY"))
