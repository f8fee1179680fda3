"""X11, where there is no uinput: through pynput, which asks the server's XTEST extension.

Wayland's own windows are out of its reach.
"""

from typing import Any, Final

from controller.errors import how_to_install
from controller.keymap.key_names import KEYS
from controller.keymap.keymap import Kind
from host.injection.backends import BackendError

ENDS_WITH_PROCESS: Final = False  # the server keeps down what a dead program pressed


class X11:
    """The keyboard of an X server, driven by key symbols."""

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
        # A character would be sent as an event of its own, which many programs ignore; a key
        # symbol as "vk" goes through XTEST.
        try:
            what(self._key_code.from_vk(KEYS[key].keysym))
        except Exception as error:  # pynput passes on what Xlib raises, of no common class
            raise BackendError(f"the X server does not press {key}: {error}") from error

    def close(self) -> None:
        """Leave the server."""


def create(kind: Kind) -> X11:
    """Connect to the X server that DISPLAY names.

    Raises:
        BackendError: There is no server, or no pynput.
    """
    if kind != "keyboard":
        raise BackendError("X11 has no pads; a virtual pad needs Linux's uinput (docs/keys.md)")
    try:
        from pynput.keyboard import Controller, KeyCode
    except ModuleNotFoundError:
        raise BackendError(f"keys need pynput; {how_to_install('keys')}") from None
    except Exception as error:  # without a display its import fails, each time in another way
        raise BackendError(f"no X server can be reached: {_first_line(error)}") from error
    return X11(Controller(), KeyCode)


def _first_line(error: Exception) -> str:
    return str(error).strip().split("\n")[0] or type(error).__name__
