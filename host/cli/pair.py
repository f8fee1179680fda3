"""`host pair`: find an orb that waits to be paired, pair with it, and print what to run next."""

from __future__ import annotations

import argparse
import asyncio
import logging
import sys
from collections.abc import Sequence
from typing import Any, Final

from controller.errors import TROUBLE, complain, how_to_install
from controller.links.bluetooth import bluez
from controller.links.bluetooth.bluez import (
    ADAPTER,
    ALIAS,
    DEVICE,
    SERVICE_UUID,
    BluetoothError,
    Bus,
    Properties,
    bonded,
)
from host.connection import rfcomm

LOOK_S: Final = 30
PAIR_S: Final = 60.0  # a person compares digits on two screens
_WORDS: Final = {
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
}


def main(argv: Sequence[str]) -> int:
    """Return 0 when paired, 1 for trouble, 2 for wrong usage."""
    options = _parser().parse_args(argv)
    logging.basicConfig(format="%(message)s", level=logging.WARNING, stream=sys.stderr)
    if sys.platform in _WORDS:
        print(_WORDS[sys.platform])
        return 0
    if not bluez.available():
        lack = f"pairing needs dbus-fast; {how_to_install('bluetooth')}"
        return complain("host", lack, TROUBLE)
    try:
        return asyncio.run(_pair(options))
    except BluetoothError as error:
        return complain("host", error, TROUBLE)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="host pair",
        allow_abbrev=False,
        description="Find an orb that waits to be paired (controller pair, or its button) and pair "
        "with it. Both show six digits; confirm them here if they are the same.",
        epilog="On Windows and macOS it prints what to click: their own settings pair.",
    )
    add = parser.add_argument
    add("address", metavar="ADDRESS", nargs="?", type=_address, help="the orb's (default: look)")
    add("--adapter", metavar="NAME", default="", help="hci1, or an address (default: the first)")
    add("--seconds", metavar="N", type=int, default=LOOK_S, help="to look for (default: 30)")
    add("--yes", action="store_true", help="pair without comparing digits")
    return parser


def _address(words: str) -> str:
    if not rfcomm.ADDRESS.fullmatch(words):
        raise argparse.ArgumentTypeError(f"{words} is no address like 00:11:22:33:44:55")
    return words.upper()


async def _pair(options: argparse.Namespace) -> int:
    from controller.links.bluetooth.pairing_agent import (
        NO_SCREEN,
        SCREEN,
        PairingAgent,
        Prompt,
        accept_all,
    )

    bus = await Bus.connect()
    try:
        adapter = await bus.adapter(options.adapter)
        if not await bus.get(adapter, ADAPTER, "Powered"):
            await bus.set(adapter, ADAPTER, "Powered", "b", True)
        agent = PairingAgent(bus, accept_all if options.yes else Prompt().confirm)
        # Not the default agent: BlueZ asks the agent of the caller of Pair, and other
        # programs' pairings are not ours to answer.
        await agent.register(NO_SCREEN if options.yes else SCREEN, default=False)
        path, device = await _find(bus, adapter, options.address, options.seconds)
        who = f"{device.get('Alias', 'the orb')} ({device['Address']})"
        if bonded(device):
            print(f"{who} is paired already", flush=True)
        else:
            print(f"pairing with {who} ...", flush=True)
            agent.allow(PAIR_S)
            await bus.call(path, DEVICE, "Pair", timeout_s=PAIR_S)
            print(f"paired with {who}", flush=True)
        await bus.set(path, DEVICE, "Trusted", "b", True)
        local = await bus.get(adapter, ADAPTER, "Address")
        channel = None
        try:
            channel = await asyncio.to_thread(rfcomm.look_up, device["Address"], local)
        except OSError as error:
            print(f"it does not say what it offers: {error.strerror or error}")
        if channel is None:
            print("it waits for no host yet; start it there: controller --link rfcomm:")
        print(f"play: host --link rfcomm://{device['Address']}", flush=True)
        return 0
    finally:
        bus.close()


async def _find(
    bus: Bus, adapter: str, address: str | None, seconds: int
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
        print(f"looking for an orb, for {seconds} s at most ...", flush=True)
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
