"""macOS: through pynput, which posts events to Quartz. Never tried on a Mac."""

import ctypes
import ctypes.util
from typing import Final

from controller.keymap.key_names import KEYS
from controller.keymap.keymap import Kind
from host.injection.backends import BackendError
from host.injection.backends.x11 import X11, open_pynput

ENDS_WITH_PROCESS: Final = False


class MacOS(X11):
    """The keyboard of macOS, driven by virtual key codes."""

    system = "macOS"

    def code(self, key: str) -> int:
        """Return the virtual key code of a key.

        Raises:
            BackendError: It has none.
        """
        if KEYS[key].mac < 0:
            raise BackendError(f"macOS has no key {key!r} that can be pressed; map another one")
        return KEYS[key].mac


def create(kind: Kind) -> MacOS:
    """Check that this program is trusted, and return the keyboard.

    Raises:
        BackendError: It is not trusted, or pynput is missing.
    """
    if kind != "keyboard":
        raise BackendError("macOS has no virtual pads; use --target keyboard (docs/keys.md)")
    opened = open_pynput()
    if not _trusted():
        raise BackendError(
            "macOS lets no key be pressed yet; allow your terminal in System Settings, Privacy & "
            "Security, Accessibility, and start again (docs/keys.md)"
        )
    return MacOS(*opened)


def _trusted() -> bool:
    """Whether the user has allowed this program to press keys; macOS ignores it silently if not."""
    library = ctypes.util.find_library("ApplicationServices")
    return library is None or bool(ctypes.CDLL(library).AXIsProcessTrusted())
