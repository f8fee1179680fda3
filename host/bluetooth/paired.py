"""List of the orbs that BlueZ has paired with this computer; nothing is opened."""

from __future__ import annotations

import asyncio

from controller.links.bluetooth import bluez
from controller.links.bluetooth.bluez import BluetoothError, Bus, Objects, bonded, devices
from controller.links.bluetooth.identifiers import ALIAS, SERVICE_UUID

ASK_S = 2.0  # for BlueZ to answer


def orbs() -> list[tuple[str, str]]:
    """Return URL and name of each; none where there is no BlueZ to ask."""
    if not bluez.available():
        return []
    try:
        objects = asyncio.run(asyncio.wait_for(_objects(), ASK_S))
    except (BluetoothError, TimeoutError):
        return []
    return [
        (f"rfcomm://{device['Address']}", str(device.get("Alias", "")))
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
