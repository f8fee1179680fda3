"""Pairing with an orb over Bluetooth, through BlueZ: find it, compare digits, trust it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import closing
from typing import Any, Final

from controller.shared.bluetooth import bluez
from controller.shared.bluetooth.bluez import (
    ADAPTER,
    ALIAS,
    DEVICE,
    SERVICE_UUID,
    BluetoothError,
    Bus,
    Properties,
    bonded,
)

LOOK_S: Final = 30
PAIR_S: Final = 60.0  # a person compares digits on two screens
BY_SYSTEM: Final = {
    "win32": """\
On the orb: controller pair
Here: Settings, Bluetooth & devices, Add device, Bluetooth, OrbTouch; compare the digits.
Then: Settings, Bluetooth & devices, Devices, More Bluetooth settings, COM Ports: note the
"Outgoing" one of OrbTouch, such as COM5.
Play: host --link COM5""",
    "darwin": """\
On the orb: controller pair
Here: System Settings, Bluetooth, OrbTouch, Connect; compare the digits.
Then: ls /dev/cu.OrbTouch*
Play: host --link /dev/cu.OrbTouch""",
}  # steps where the system's own settings pair

Tell = Callable[[str], object]  # takes a line for the user
Confirm = Callable[[str, str], Awaitable[bool]]  # takes the orb's name, and the six digits


async def pair(
    tell: Tell,
    confirm: Confirm | None,
    *,
    adapter: str = "",
    address: str | None = None,
    seconds: int = LOOK_S,
) -> str:
    """Pair with the orb that waits for it; return its URL.

    Without `confirm` no digits are compared. BluetoothError if there is no orb, or several, or no
    Bluetooth.
    """
    from controller.shared.bluetooth.pairing_agent import (
        NO_SCREEN,
        SCREEN,
        PairingAgent,
        accept_all,
    )

    with closing(await Bus.connect()) as bus:
        path_of_adapter = await bus.adapter(adapter)
        if not await bus.get(path_of_adapter, ADAPTER, "Powered"):
            await bus.set(path_of_adapter, ADAPTER, "Powered", "b", True)
        agent = PairingAgent(bus, confirm or accept_all)
        # Not the default agent: BlueZ asks the agent of the caller of Pair, and other
        # programs' pairings are not ours to answer.
        await agent.register(SCREEN if confirm else NO_SCREEN, default=False)
        path, device = await _find(bus, path_of_adapter, address, seconds, tell)
        name = f"{device.get('Alias', 'the orb')} ({device['Address']})"
        if bonded(device):
            tell(f"{name} is paired already")
        else:
            tell(f"pairing with {name} ...")
            agent.allow(PAIR_S)
            await bus.call(path, DEVICE, "Pair", timeout_s=PAIR_S)
            tell(f"paired with {name}")
        await bus.set(path, DEVICE, "Trusted", "b", True)
        return f"rfcomm://{device['Address']}"


async def _find(
    bus: Bus, adapter: str, address: str | None, seconds: int, tell: Tell
) -> tuple[str, Properties]:
    """Return the path and the properties of the one orb that is there, or raise BluetoothError."""

    def wanted(device: Properties) -> bool:
        if address is not None:
            return bool(device.get("Address") == address)
        heard = "RSSI" in device or bonded(device)  # BlueZ remembers those of a while ago, too
        named = SERVICE_UUID in device.get("UUIDs", ()) or device.get("Alias") == ALIAS
        return heard and named

    async def look() -> dict[str, Properties]:
        known = bluez.devices(await bus.objects(), adapter)
        return {path: device for path, device in known.items() if wanted(device)}

    changed = asyncio.Event()
    silence = bus.listen(lambda path, interface, changes: changed.set())
    found = await look()
    if not (address and found):
        tell(f"looking for an orb, for {seconds} s at most ...")
        filters: dict[str, Any] = {"Transport": bluez.variant("s", "bredr")}
        await bus.call(adapter, ADAPTER, "SetDiscoveryFilter", "a{sv}", filters)
        await bus.call(adapter, ADAPTER, "StartDiscovery")
        try:
            async with asyncio.timeout(seconds):
                while not found:
                    await changed.wait()
                    changed.clear()
                    found = await look()
        except TimeoutError:
            pass
        finally:
            await bus.call(adapter, ADAPTER, "StopDiscovery")
    silence()
    if not found:
        where = f" at {address}" if address else ""
        raise BluetoothError(
            f"found no orb{where} within {seconds} s; open its window first: controller pair"
        )
    if len(found) > 1:
        addresses = ", ".join(device["Address"] for device in found.values())
        raise BluetoothError(f"found several orbs: {addresses}; name one: host pair ADDRESS")
    return next(iter(found.items()))
