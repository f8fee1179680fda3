"""Linux: a virtual keyboard or gamepad in the kernel, for X11, Wayland and the console.

The numbers are those of linux/uinput.h and linux/input-event-codes.h.
"""

import errno
import fcntl
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Final

from controller.shared.keymap.key_names import KEYS, PAD, STICK, Axis
from controller.shared.keymap.keymap import Kind
from host.injection.backends import Backend, BackendError

ENDS_WITH_PROCESS: Final = True  # the kernel releases the keys of a removed device
DEVICE: Final = "/dev/uinput"
RULE: Final = Path(__file__).parents[1] / "60-orbtouch.rules"

EV_SYN, EV_KEY, EV_ABS = 0, 1, 3
EVENT: Final = struct.Struct("@llHHi")  # input_event: seconds, microseconds, type, code, value
SETUP: Final = struct.Struct("@4H80sI")  # struct uinput_setup: bus, vendor, product, version, name
ABS_SETUP: Final = struct.Struct("@H2x6i")  # code; value, least, most, fuzz, flat, resolution
UI_SET_EVBIT: Final = 0x40045564  # _IOW('U', 100, int)
UI_SET_KEYBIT: Final = 0x40045565
UI_SET_ABSBIT: Final = 0x40045567
UI_DEV_SETUP: Final = 0x405C5503  # _IOW('U', 3, struct uinput_setup)
UI_ABS_SETUP: Final = 0x401C5504  # _IOW('U', 4, struct uinput_abs_setup)
UI_DEV_CREATE: Final = 0x5501  # _IO('U', 1)
UI_DEV_DESTROY: Final = 0x5502
_BUS_VIRTUAL: Final = 6
_KEYBOARD_BLOCK: Final = range(1, 32)  # udev recognises a keyboard by all of these
_STICKS: Final = (0, 1, 3, 4)
_HATS: Final = (0x10, 0x11)

Control = Callable[[int, int, int | bytes], object]  # fcntl.ioctl


class Uinput(Backend):
    """A virtual device with the lifetime of this object."""

    def __init__(self, kind: Kind, device: str = DEVICE, control: Control | None = None) -> None:
        """Create the device (BackendError: it cannot); `control` is `fcntl.ioctl` by default."""
        self._control = control or fcntl.ioctl
        self._values: dict[int, int] = {}  # of axes
        try:
            self._handle = os.open(device, os.O_WRONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            raise BackendError(_why(device, error)) from error
        try:
            self._describe(kind)
            self._control(self._handle, UI_DEV_CREATE, 0)
        except OSError as error:
            os.close(self._handle)
            raise BackendError(
                f"{device} makes no {kind}: {error.strerror}; this kernel is too old"
            ) from error

    def _describe(self, kind: Kind) -> None:
        self._control(self._handle, UI_SET_EVBIT, EV_KEY)
        if kind == "keyboard":
            for code in {*_KEYBOARD_BLOCK, *(key.evdev for key in KEYS.values())}:
                self._control(self._handle, UI_SET_KEYBIT, code)
        else:
            self._control(self._handle, UI_SET_EVBIT, EV_ABS)
            for button in PAD.values():
                if not isinstance(button, Axis):
                    self._control(self._handle, UI_SET_KEYBIT, button)
            for code, end in (*((c, STICK) for c in _STICKS), *((c, 1) for c in _HATS)):
                self._control(self._handle, UI_SET_ABSBIT, code)
                setup = ABS_SETUP.pack(code, 0, -end, end, 0, 0, 0)
                self._control(self._handle, UI_ABS_SETUP, setup)
        name = f"OrbTouch {kind}".encode()
        # Vendor and product are 0, so that no driver mistakes it for a product.
        self._control(self._handle, UI_DEV_SETUP, SETUP.pack(_BUS_VIRTUAL, 0, 0, 1, name, 0))

    def set(self, key: str, *, down: bool) -> None:
        """Press or release a key, button or direction; an axis held in another direction stays."""
        entry = KEYS[key].evdev if key in KEYS else PAD[key]
        if isinstance(entry, Axis):
            if down:
                self._values[entry.code] = entry.value
            elif self._values.get(entry.code) == entry.value:
                self._values[entry.code] = 0
            event = EVENT.pack(0, 0, EV_ABS, entry.code, self._values.get(entry.code, 0))
        else:
            event = EVENT.pack(0, 0, EV_KEY, entry, int(down))
        os.write(self._handle, event + EVENT.pack(0, 0, EV_SYN, 0, 0))

    def close(self) -> None:
        """Remove the device; the kernel releases its keys."""
        try:
            self._control(self._handle, UI_DEV_DESTROY, 0)
        finally:
            os.close(self._handle)


def _why(device: str, error: OSError) -> str:
    if error.errno in (errno.EACCES, errno.EPERM):
        return (
            f"you may not write to {device}; once, type: sudo cp {RULE} /etc/udev/rules.d/ && "
            "sudo udevadm control --reload && sudo udevadm trigger --sysname-match=uinput "
            "(orbtouch docs keys)"
        )
    if error.errno in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"there is no {device}; load it with: sudo modprobe uinput (orbtouch docs keys)"
    return f"cannot open {device}: {error.strerror} (orbtouch docs keys)"


def create(name: str, kind: Kind) -> Uinput:
    """Make a keyboard or a pad."""
    return Uinput(kind)
