"""What the cases of the HID links share."""

from __future__ import annotations

import logging
import sys
import time

from controller.links import open_link
from controller.links.hid import HidLink
from controller.protocol import COMMANDS, VERSION, Command, State, Welcome

from .guest import Guest
from .input import Desktop, drain, events

WELCOME = Welcome(
    version=VERSION, boot_nonce=1, device_id="virtual-1", name="OrbTouch", virtual=True,
    rows=5, columns=5, pitch_mm=10.0, rate_hz=10.0, heartbeat_ms=100, deadman_ms=300,
    labels=("null", "press"), commands=COMMANDS,
)  # fmt: skip
PRESSES = 200
RETURNS = 5


def orb(url: str) -> HidLink:
    """Open the link, in this process."""
    logging.basicConfig(
        format="%(relativeCreated)d %(name)s %(message)s", level=logging.DEBUG, stream=sys.stderr
    )
    link = open_link(url, WELCOME)
    assert isinstance(link, HidLink)
    return link


def press(link: HidLink, name: str) -> None:
    """Say that the player makes a gesture, and holds it."""
    link.send(Command(name, "press", 1.0, None, 1), 0)
    link.send(State((name,)), 0)


def look(guest: Guest, url: str, transport: str) -> None:
    """Try out a link: pairing, events, latency, return, release."""
    link = orb(url)
    link.pair(120)
    desktop = Desktop(guest, guest.addresses[1], transport)
    known = desktop.pair()
    guest.saw(f"BlueZ: {known}")
    inputs = guest.until(desktop.inputs, "input devices")
    guest.saw(str(inputs))
    guest.until(lambda: link.poll() or link.connected, "the orb to notice")
    pad = inputs["pad"]
    time.sleep(1.0)
    drain(pad)
    press(link, "left")
    guest.saw(str(events(pad, 2)))
    guest.saw(f"battery: {desktop.known.get('Percentage')}")
    link.close()
    desktop.close()
