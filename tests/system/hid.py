"""Parts of the HID cases: an orb in this process, and a desktop to try it with."""

from __future__ import annotations

import contextlib
import errno
import logging
import signal
import sys
import time
from pathlib import Path
from typing import Any

from controller.links import open_link
from controller.links.base import Link, LinkError
from controller.links.hid import HidLink
from controller.shared.protocol.messages import COMMANDS, Command, State
from tests.support.fake_device import welcome

from .guest import Guest
from .input import Desktop, drain, events, until_told

PRESSES = 200
RETURNS = 5
PATIENT_S = 10.0  # for input devices after pairing
HOLD = "".join(f'{name} = {{ key = "left", mode = "hold" }}\n' for name in COMMANDS)


def orb(url: str) -> HidLink:
    """Open the link, in this process."""
    logging.basicConfig(
        format="%(relativeCreated)d %(name)s %(message)s", level=logging.DEBUG, stream=sys.stderr
    )
    end_s = time.monotonic() + PATIENT_S
    while True:
        try:
            link = open_link(url, welcome())
        except LinkError as error:
            if "Busy" not in str(error) or time.monotonic() > end_s:
                raise
            time.sleep(0.5)  # a bluetoothd that has just started is still switching adapters on
        else:
            assert isinstance(link, HidLink)
            return link


def press(link: Link, name: str) -> None:
    """Say that the player makes a gesture, and holds it."""
    link.send(Command(name, "press", 1.0, None, 1), 0)
    link.send(State((name,)), 0)


def there(guest: Guest, link: HidLink, desktop: Desktop) -> dict[str, Any]:
    """Wait until the orb has a host, and the desktop input devices that stay."""

    def connected() -> bool:
        link.poll()
        return link.connected

    def settled() -> dict[str, Any]:
        found = desktop.inputs() if desktop.settled() else {}
        with contextlib.suppress(OSError):  # it has gone again: the desktop was not ready
            for device in found.values():
                drain(device)
            return found
        return {}

    guest.until(connected, "the orb to have a host")
    inputs: dict[str, Any] = guest.until(settled, "input devices")
    return inputs


def pair(guest: Guest, link: HidLink, desktop: Desktop) -> None:
    """Pair, and see what BlueZ makes of the orb."""
    link.pair(120)
    desktop.find()
    desktop.pair()
    desktop.connect()
    end_s = time.monotonic() + PATIENT_S
    while not desktop.inputs() and time.monotonic() < end_s:
        time.sleep(0.1)
    if not desktop.inputs():  # it looked at the reports before it had the bond, and not again
        guest.saw("BlueZ made no input devices at first; the link was dropped once")
        desktop.drop()
    names = sorted(device.name for device in there(guest, link, desktop).values())
    guest.saw(f"input devices {' and '.join(names)}")
    known = desktop.known
    guest.saw(
        f"paired; BlueZ shows {known.get('Alias')} as {known.get('Icon')}, "
        f"{known.get('Modalias')}, battery {known.get('Percentage')}"
    )


def tap(link: Link, pad: Any) -> None:
    """Tap the hat to the left, and see it in the kernel's device."""
    drain(pad)
    press(link, "left")
    told = [(name, value) for _, name, value in events(pad, 2)]
    assert told == [("ABS_HAT0X", -1), ("ABS_HAT0X", 0)], told


def measure(guest: Guest, link: Link, pad: Any, what: str) -> None:
    """Take down how long commands need to the kernel's device."""
    waits = []
    for number in range(PRESSES):
        drain(pad)
        start_s = time.time()  # the kernel's events have this clock
        press(link, "rotate_cw" if number % 2 else "pause")
        waits.append(events(pad, 2)[0][0] - start_s)  # down and up
    guest.measured(f"command to /dev/input, {what}", waits)


def come_back(guest: Guest, link: HidLink, desktop: Desktop, what: str) -> None:
    """Drop the link from the orb's side, time after time."""
    waits = []
    for _ in range(RETURNS):
        desktop.drop()
        guest.until(lambda: not desktop.inputs(), "the input devices to go")
        start_s = time.perf_counter()
        pad = there(guest, link, desktop)["pad"]
        waits.append(time.perf_counter() - start_s)
        tap(link, pad)
    guest.saw(f"{RETURNS} of {RETURNS} times back by itself, with events")
    guest.measured(f"back after a lost link, {what}", waits)


def game(guest: Guest, link: Link) -> None:
    """See the pad with pygame, as a game does."""
    player = guest.python(f"{__package__}.joystick", name="joystick")
    guest.saw(player.expect("pad '"))
    press(link, "rotate_cw")
    button = player.expect("button")
    press(link, "right")
    guest.saw(f"pygame: {button}, {player.expect('hat')}")
    player.end(signal.SIGKILL)


def killed(guest: Guest, desktop: Desktop, url: str, what: str) -> None:
    """Kill a real controller while it holds a key, and see the key go up."""
    keys = Path("/tmp/hold.toml")
    keys.write_text("[profile.hold]\n" + HOLD)
    controller = guest.python(
        "controller", "--sensor", "virtual", "--link", f"{url}?keys={keys}", name="controller"
    )
    keyboard = guest.until(desktop.inputs, "input devices")["keyboard"]
    until_told(keyboard, "KEY_LEFT", 1)
    guest.saw("a real controller's own hand holds a key")
    controller.end(signal.SIGKILL)
    start_s = time.time()
    how = "the device goes away"
    try:
        until_told(keyboard, "KEY_LEFT", 0)
        how = "the key goes up"
    except OSError as error:
        if error.errno != errno.ENODEV:
            raise
    seconds = time.time() - start_s
    guest.measured(f"{how} after SIGKILL of the controller, {what}", [seconds])


def play(guest: Guest, desktop: Desktop, url: str, what: str) -> None:
    """Pair, press, come back five times, be seen by a game, and leave nothing down."""
    link = orb(url)
    pair(guest, link, desktop)
    pad = there(guest, link, desktop)["pad"]
    tap(link, pad)
    measure(guest, link, pad, what)
    game(guest, link)
    come_back(guest, link, desktop, what)
    link.close()
    guest.until(lambda: not desktop.inputs(), "the input devices to go with the orb")
    link = orb(url)
    tap(link, there(guest, link, desktop)["pad"])
    guest.saw("back after a new start of the orb")
    link.close()
    guest.until(lambda: not desktop.inputs(), "the input devices to go with the orb")
    killed(guest, desktop, url, what)
    desktop.close()
