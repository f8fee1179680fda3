"""List of the system's serial ports, without opening one, and which may be an orb's.

    python -m host.discovery.ports     prints them as JSON; a process, because listing can hang

Windows' list stalls on Bluetooth ports whose device is away (pyserial issue 450).
"""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from typing import Any, Final

from serial.tools import list_ports

from controller.links.bluetooth import bluez
from controller.links.bluetooth.bluez import BluetoothError, Bus, Objects, bonded, devices
from controller.links.bluetooth.identifiers import ALIAS, SERVICE_UUID

BLUEZ_S: Final = 2.0  # for BlueZ to answer
LIST_S: Final = 5.0  # for the list; then there is none
PRODUCT: Final = "orbtouch"  # in a USB descriptor of ours, in any case
# USB identities of a Raspberry Pi's own USB port, when it is set up as a serial device.
USB: Final = {
    (0x0525, 0xA4A7): "Linux serial gadget",
    (0x1D6B, 0x0104): "Linux composite gadget",
}
_LIST: Final = (sys.executable, "-m", "host.discovery.ports")
_BONDED: Final = ("BTHENUM", "/dev/rfcomm")  # Windows' hardware id; Linux's name of a bound channel


@dataclass(frozen=True, slots=True)
class Port:
    """A port as the system describes it.

    Attributes:
        url: Its name.
        why: Why it may be an orb's; "" for no reason.
        about: What the system calls it.
        key: The file with the key that the orb there was met with; "": none.
    """

    url: str
    why: str = ""
    about: str = ""
    key: str = ""


def listed() -> list[Port]:
    """Return the system's ports; none if the list does not come in time."""
    try:
        done = subprocess.run(
            _LIST,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            timeout=LIST_S,
            check=True,
        )
        return [Port(**entry) for entry in json.loads(done.stdout)]
    except (subprocess.SubprocessError, OSError, ValueError, TypeError):
        return []


def describe(entry: Any) -> Port:
    """Return the port of one entry of pyserial's list.

    Args:
        entry: A `serial.tools.list_ports_common.ListPortInfo`.
    """
    words = " ".join(str(text) for text in (entry.manufacturer, entry.product) if text)
    about = words or str(entry.description or "")
    if PRODUCT in f"{words} {entry.description}".lower():
        return Port(entry.device, "its USB descriptor says OrbTouch", about)
    if (entry.vid, entry.pid) in USB:
        return Port(entry.device, f"USB: {USB[entry.vid, entry.pid]}", about)
    if entry.device.startswith(_BONDED) or str(entry.hwid).startswith(_BONDED):
        return Port(entry.device, "bonded by Bluetooth", about)
    return Port(entry.device, "", about)


def paired() -> list[Port]:
    """Return the orbs that BlueZ has paired; none where there is no BlueZ. Nothing is opened."""
    if not bluez.available():
        return []
    try:
        objects = asyncio.run(asyncio.wait_for(_objects(), BLUEZ_S))
    except (BluetoothError, TimeoutError):
        return []
    return [
        Port(f"rfcomm://{device['Address']}", "paired over Bluetooth", str(device.get("Alias", "")))
        for device in devices(objects).values()
        if bonded(device)
        and (SERVICE_UUID in device.get("UUIDs", ()) or device.get("Alias") == ALIAS)
    ]


async def _objects() -> Objects:
    bus = await Bus.connect()
    try:
        return await bus.objects()
    finally:
        bus.close()


def main() -> None:
    """Print what pyserial lists, and orbs that are paired over Bluetooth."""
    found = [describe(entry) for entry in list_ports.comports()]
    print(json.dumps([asdict(port) for port in (*found, *paired())]))


if __name__ == "__main__":
    main()
