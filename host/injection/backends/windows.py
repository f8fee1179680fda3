"""Windows: SendInput with scan codes, which games that read DirectInput need.

Never run on Windows; the tests check the packed structures. Programs that run as administrator
ignore the input of other programs.
"""

import ctypes
import sys
from collections.abc import Callable
from ctypes import c_size_t, c_uint8, c_uint16, c_uint32
from typing import Final

from controller.shared.keymap.key_names import EXTENDED, KEYS
from controller.shared.keymap.keymap import Kind
from host.injection.backends import Backend, BackendError

ENDS_WITH_PROCESS: Final = False
INPUT_KEYBOARD: Final = 1
KEYEVENTF_EXTENDEDKEY: Final = 1
KEYEVENTF_KEYUP: Final = 2
KEYEVENTF_SCANCODE: Final = 8
WIDE: Final = ctypes.sizeof(c_size_t) == 8  # 64 bits


class KeyboardInput(ctypes.Structure):
    """KEYBDINPUT of winuser.h."""

    _fields_ = (
        ("virtual_key", c_uint16),
        ("scan", c_uint16),
        ("flags", c_uint32),
        ("time_ms", c_uint32),
        ("extra", c_size_t),
    )


class _Union(ctypes.Union):
    # MOUSEINPUT, the largest member, gives the union its size.
    _fields_ = (("keyboard", KeyboardInput), ("mouse", c_uint8 * (32 if WIDE else 24)))


class Input(ctypes.Structure):
    """INPUT of winuser.h."""

    _fields_ = (("type", c_uint32), ("union", _Union))


Send = Callable[[Input], int]  # how many inputs were taken


class Windows(Backend):
    """The keyboard of the desktop."""

    def __init__(self, send: Send) -> None:
        self._send = send

    def set(self, key: str, *, down: bool) -> None:
        """Press or release a key."""
        scan = KEYS[key].scan
        flags = KEYEVENTF_SCANCODE | (KEYEVENTF_EXTENDEDKEY if scan >= EXTENDED else 0)
        flags |= 0 if down else KEYEVENTF_KEYUP
        keyboard = KeyboardInput(0, scan & 0xFF, flags, 0, 0)
        if self._send(Input(INPUT_KEYBOARD, _Union(keyboard=keyboard))) != 1:
            raise BackendError(
                f"Windows does not press {key}: the program in front runs as administrator, or "
                "the screen is locked"
            )


def create(name: str, kind: Kind) -> Windows:
    """Return the desktop's keyboard; BackendError if this is not Windows, or a pad is wanted."""
    if kind != "keyboard":
        raise BackendError("Windows has no virtual pads of its own; use --target keyboard")
    if sys.platform != "win32":
        raise BackendError("the back end 'windows' needs Windows")
    send_input = ctypes.WinDLL("user32", use_last_error=True).SendInput

    def send(one: Input) -> int:
        return int(send_input(1, ctypes.byref(one), ctypes.sizeof(one)))

    return Windows(send)
