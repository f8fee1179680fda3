"""USB gadget: the kernel's own USB host takes the orb for a gamepad and a keyboard."""

import contextlib
import errno
import os
import signal
import time
from pathlib import Path
from typing import Any

from controller.links import open_link
from controller.links.base import LinkError
from controller.links.usb import UsbLink
from controller.shared.protocol.messages import State
from tests.support.fake_device import welcome

from ..guest import CaseError, Guest, Process
from ..hid import HOLD, game, measure, press, tap
from ..input import events, until_told

UDC = Path("/sys/class/udc/dummy_udc.0")
USB = Path("/sys/bus/usb/devices")
GADGET = Path("/sys/kernel/config/usb_gadget/orbtouch")
KEYS = Path("/tmp/usb.toml")


def run(guest: Guest) -> None:
    """Press, unplug, unbind, kill and end, and see that no key stays down."""
    missing(guest)
    guest.run("modprobe", "dummy_hcd")
    KEYS.write_text("[profile.hold]\n" + HOLD)
    link = open_link("usb:", welcome())
    assert isinstance(link, UsbLink)
    played(guest, link)
    link.close()
    guest.until(lambda: not inputs(), "the input devices to go")
    guest.check(not GADGET.exists(), "closed: the gadget is removed")
    unplugged(guest)
    killed(guest)


def missing(guest: Guest) -> None:
    """See what is told where a part of the system is missing."""
    for step in ("libcomposite", "usb_f_hid"):
        try:
            open_link("usb:", welcome())
        except LinkError as error:
            guest.saw(f"before {step}: {error}")
        else:
            raise CaseError("a gadget without the kernel's modules")
        guest.run("modprobe", step)
        if not GADGET.parent.exists():
            guest.run("mount", "-t", "configfs", "none", "/sys/kernel/config")


def played(guest: Guest, link: UsbLink) -> None:
    """See commands of this process in the kernel's devices."""
    pad = there(guest, link)["pad"]
    names = sorted(device.name for device in inputs().values())
    guest.saw(f"input devices {' and '.join(names)}")
    tap(link, pad)
    measure(guest, link, pad, "USB gadget")
    game(guest, link)


def unplugged(guest: Guest) -> None:
    """Pull the cable while a key is down, and put it back; then unbind the gadget by hand."""
    link = open_link(f"usb:?keys={KEYS}", welcome())
    assert isinstance(link, UsbLink)
    keyboard = there(guest, link)["keyboard"]
    press(link, "left")
    told = events(keyboard, 1)[0]
    guest.check(told[1:] == ("KEY_LEFT", 1), "a key is held")
    cable = next(USB.glob("*/usb*-port1/disable"))  # of the host's port
    cable.write_text("1")
    guest.measured("key up after the cable is pulled", [let_go(keyboard)])
    press(link, "left")
    guest.until(lambda: not polled(link), "the link to miss its host")
    press(link, "left")  # without a host
    cable.write_text("0")
    keyboard = there(guest, link)["keyboard"]
    link.send(State(("left",)), 0)
    time.sleep(0.3)
    guest.check(not keyboard.active_keys(), "plugged in again: nothing is down")
    press(link, "left")
    until_told(keyboard, "KEY_LEFT", 1)
    until_told(keyboard, "KEY_LEFT", 0)
    guest.saw("a key whose holder reports nothing more goes up")
    press(link, "left")
    until_told(keyboard, "KEY_LEFT", 1)
    (GADGET / "UDC").write_text("\n")
    guest.measured("key up after the gadget is unbound", [let_go(keyboard)])
    guest.until(lambda: not polled(link), "the link to miss its host")
    guest.check(not link.problem, "and the link waits for a host")
    link.close()


def killed(guest: Guest) -> None:
    """Kill a real controller, and one whose guard died before it; then end one."""
    controller, keyboard = holding(guest)
    controller.end(signal.SIGKILL)
    guest.measured("key up after SIGKILL of the controller", [let_go(keyboard)])
    controller, keyboard = holding(guest)
    guest.saw("a new start replaces the gadget of a killed one")
    for child in children(controller.process.pid):
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
    guest.until(keyboard.active_keys, "a key to be held without the guard")
    controller.end(signal.SIGKILL)
    guest.check(keyboard.active_keys(), "without its guard a killed controller leaves a key down")
    controller, again = holding(guest)
    guest.measured("key up by the next start", [let_go(keyboard)])
    guest.check(controller.end() == 0, "the controller ended well")
    guest.measured("key up after SIGTERM of the controller", [let_go(again)])
    guest.check(not GADGET.exists(), "the gadget is removed")


def holding(guest: Guest) -> tuple[Process, Any]:
    """Start a controller, and return it with the keyboard when its own hand holds a key."""
    before = {device.path: device for device in inputs().values()}
    words = ["--sensor", "virtual", "--link", f"usb:?keys={KEYS}"]
    controller = guest.python("controller", *words, name="controller")

    def fresh() -> Any:
        found = inputs()
        stale = [one for one in found.values() if one.path in before and alive(before[one.path])]
        return {} if stale else found

    keyboard = guest.until(fresh, "input devices")["keyboard"]
    guest.until(keyboard.active_keys, "a key to be held")
    return controller, keyboard


def there(guest: Guest, link: UsbLink) -> dict[str, Any]:
    """Wait until the link has a host, and the kernel input devices."""
    try:
        guest.until(lambda: polled(link), "the orb to have a host")
    except CaseError as error:
        state = (UDC / "state").read_text().strip()
        raise CaseError(f"{error}: {state}, {link.problem or 'no problem'}") from None
    found: dict[str, Any] = guest.until(inputs, "input devices")
    return found


def polled(link: UsbLink) -> bool:
    link.poll()
    return link.connected


def inputs() -> dict[str, Any]:
    """Return the kernel's devices that the orb has become: "keyboard" and "pad"; {}: none."""
    import evdev

    found = {}
    for place in evdev.list_devices():
        with contextlib.suppress(OSError):
            device = evdev.InputDevice(place)
            if device.info.bustype == evdev.ecodes.BUS_USB and device.info.vendor == 0x1209:
                codes = device.capabilities().get(evdev.ecodes.EV_KEY, [])
                found["keyboard" if evdev.ecodes.KEY_LEFT in codes else "pad"] = device
    return found if {"keyboard", "pad"} <= set(found) else {}


def alive(device: Any) -> bool:
    """Return whether an open device is still plugged in."""
    try:
        device.active_keys()
    except (OSError, SystemError):  # evdev's C code says either when the device has gone
        return False
    return True


def let_go(keyboard: Any) -> float:
    """Return the seconds until the key is up, or its device has gone."""
    start_s = time.time()
    try:
        until_told(keyboard, "KEY_LEFT", 0)
    except OSError as error:
        if error.errno != errno.ENODEV:
            raise
    return time.time() - start_s


def children(pid: int) -> list[int]:
    """Return the processes that a process has started."""
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
