"""macOS: through pynput, which posts events to Quartz. Never tried on a Mac."""

import ctypes
import ctypes.util
from typing import Any, Final

from controller.errors import how_to_install
from controller.keymap.key_names import KEYS
from controller.keymap.keymap import Kind
from host.injection.backends import BackendError

ENDS_WITH_PROCESS: Final = False


class MacOS:
    """The keyboard of macOS, driven by virtual key codes."""

    def __init__(self, controller: Any, key_code: Any) -> None:
        """Take pynput's two classes: an open Controller, and KeyCode."""
        self._controller, self._key_code = controller, key_code

    def press(self, key: str) -> None:
        """Put a key down."""
        self._do(self._controller.press, key)

    def release(self, key: str) -> None:
        """Lift a key."""
        self._do(self._controller.release, key)

    def _do(self, what: Any, key: str) -> None:
        if KEYS[key].mac < 0:
            raise BackendError(f"macOS has no key {key!r} that can be pressed; map another one")
        try:
            what(self._key_code.from_vk(KEYS[key].mac))
        except Exception as error:  # pynput passes on what Quartz raises, of no common class
            raise BackendError(f"macOS does not press {key}: {error}") from error

    def close(self) -> None:
        """Nothing is held open."""


def create(kind: Kind) -> MacOS:
    """Make sure that we are trusted.

    Raises:
        BackendError: We are not, or pynput is missing.
    """
    if kind != "keyboard":
        raise BackendError("macOS has no virtual pads; use --target keyboard (docs/keys.md)")
    try:
        from pynput.keyboard import Controller, KeyCode
    except ModuleNotFoundError:
        raise BackendError(f"keys need pynput; {how_to_install('keys')}") from None
    if not _trusted():
        raise BackendError(
            "macOS lets no key be pressed yet; allow your terminal in System Settings, Privacy & "
            "Security, Accessibility, and start again (docs/keys.md)"
        )
    return MacOS(Controller(), KeyCode)


def _trusted() -> bool:
    """Whether the user has allowed this program to press keys; macOS ignores it silently if not."""
    library = ctypes.util.find_library("ApplicationServices")
    return library is None or bool(ctypes.CDLL(library).AXIsProcessTrusted())
