"""X11 without uinput: through pynput and the server's XTEST extension.

It does not reach native Wayland windows.
"""

from typing import Any, Final

from controller.errors import how_to_install
from controller.keymap.key_names import KEYS
from controller.keymap.keymap import Kind
from host.injection.backends import Backend, BackendError

ENDS_WITH_PROCESS: Final = False  # the server does not release the keys of a dead program


class X11(Backend):
    """The keyboard of an X server, driven by key symbols; or another one that pynput drives."""

    system = "the X server"

    def __init__(self, controller: Any, key_code: Any) -> None:
        """Prepare with pynput's open Controller and its class KeyCode."""
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


def create(kind: Kind) -> X11:
    """Connect to the X server that DISPLAY names.

    Raises:
        BackendError: There is no server, or no pynput.
    """
    if kind != "keyboard":
        raise BackendError("X11 has no pads; a virtual pad needs Linux's uinput (docs/keys.md)")
    try:
        return X11(*open_pynput())
    except BackendError:
        raise
    except Exception as error:  # without a display the import fails with various errors
        line = str(error).strip().split("\n")[0] or type(error).__name__
        raise BackendError(f"no X server can be reached: {line}") from error


def open_pynput() -> tuple[Any, Any]:
    """Return an open Controller of pynput, and its class KeyCode.

    Raises:
        BackendError: pynput is missing.
    """
    try:
        from pynput.keyboard import Controller, KeyCode
    except ModuleNotFoundError:
        raise BackendError(f"keys need pynput; {how_to_install('keys')}") from None
    return Controller(), KeyCode
