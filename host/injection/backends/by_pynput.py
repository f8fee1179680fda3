"""X11 without uinput, through the server's XTEST extension, and macOS, through Quartz: by pynput.

X11 does not reach native Wayland windows. Never tried on a Mac.
"""

import ctypes
import ctypes.util
from typing import Any, Final

from controller.shared.errors import how_to_install
from controller.shared.keymap.key_names import KEYS
from controller.shared.keymap.keymap import Kind
from host.injection.backends import Backend, BackendError

ENDS_WITH_PROCESS: Final = False  # the system does not release the keys of a dead program


class X11(Backend):
    """The keyboard of an X server, driven by key symbols; or another one that pynput drives."""

    system = "the X server"

    def __init__(self, controller: Any, key_code: Any) -> None:
        self._controller, self._key_code = controller, key_code

    def set(self, key: str, *, down: bool) -> None:
        """Press or release a key."""
        code = self.code(key)
        try:
            # A character would be sent as a synthetic event, which many programs ignore; a key
            # symbol as "vk" goes through XTEST.
            (self._controller.press if down else self._controller.release)(
                self._key_code.from_vk(code)
            )
        except Exception as error:  # pynput's errors have no common class
            raise BackendError(f"{self.system} does not press {key}: {error}") from error

    def code(self, key: str) -> int:
        """Return the system's number of a key."""
        return KEYS[key].keysym


class MacOS(X11):
    """The keyboard of macOS, driven by virtual key codes."""

    system = "macOS"

    def code(self, key: str) -> int:
        """Return the virtual key code of a key; BackendError if it has none."""
        if KEYS[key].mac < 0:
            raise BackendError(f"macOS has no key {key!r} that can be pressed; map another one")
        return KEYS[key].mac


def create(name: str, kind: Kind) -> X11:
    """Connect to the X server that DISPLAY names, or to macOS if it trusts this program."""
    if kind != "keyboard":
        raise BackendError(f"{name} has no pads; it needs Linux's uinput (orbtouch docs keys)")
    try:
        from pynput.keyboard import Controller, KeyCode

        opened = Controller(), KeyCode
    except ModuleNotFoundError:
        raise BackendError(f"keys need pynput; {how_to_install('keys')}") from None
    except Exception as error:  # without a display the import fails with various errors
        line = str(error).strip().split("\n")[0] or type(error).__name__
        raise BackendError(f"{name} cannot be reached: {line}") from error
    if name == "x11":
        return X11(*opened)
    if not _trusted():
        raise BackendError(
            "macOS lets no key be pressed yet; allow your terminal in System Settings, Privacy & "
            "Security, Accessibility, and start again (orbtouch docs keys)"
        )
    return MacOS(*opened)


def _trusted() -> bool:
    """Whether the user has allowed this program to press keys; macOS ignores it silently if not."""
    library = ctypes.util.find_library("ApplicationServices")
    return library is None or bool(ctypes.CDLL(library).AXIsProcessTrusted())
