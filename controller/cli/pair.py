"""`controller pair`: pair this orb with a host over Bluetooth."""

from __future__ import annotations

import argparse
import asyncio
import logging
import sys
from collections.abc import Sequence
from contextlib import closing
from typing import TYPE_CHECKING

from controller.shared.arguments import Parser
from controller.shared.bluetooth import bluez
from controller.shared.bluetooth.bluez import (
    ADAPTER,
    DEVICE,
    PAIRING_S,
    BluetoothError,
    Bus,
    Properties,
    bonded,
    named,
)
from controller.shared.errors import how_to_install

if TYPE_CHECKING:
    from controller.shared.bluetooth.pairing_agent import Confirm, PairingAgent


def main(argv: Sequence[str]) -> int:
    """Return 0 when a host has paired, 1 if none has or there is trouble, 2 for wrong usage."""
    options = _parser().parse_args(argv)
    logging.basicConfig(format="%(message)s", level=logging.WARNING, stream=sys.stderr)
    if not bluez.available():
        raise BluetoothError(f"pairing needs dbus-fast; {how_to_install('bluetooth')}")
    return asyncio.run(_pair(options))


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="controller pair",
        description="Let a host find this orb and pair with it, for a limited time. Both show six "
        "digits; confirm them here if they are the same.",
        epilog="The orb's own button does the same, without digits. See orbtouch docs bluetooth.",
    )
    add = parser.add_argument
    add("--adapter", metavar="NAME", default="", help="hci1, or an address (default: the first)")
    text = "pair with the first host, without digits or a question"
    add("--yes", action="store_true", help=text)
    return parser


async def _pair(options: argparse.Namespace) -> int:
    """Open the pairing window until a host has paired or the time is up."""
    from controller.shared.bluetooth.pairing_agent import (
        NO_SCREEN,
        SCREEN,
        PairingAgent,
        Prompt,
        accept_all,
    )

    confirm: Confirm = accept_all if options.yes else Prompt().confirm
    with closing(await Bus.connect()) as bus:
        adapter = await bus.adapter(options.adapter)
        await bus.switch_on(adapter)
        agent = PairingAgent(bus, confirm)
        await agent.register(NO_SCREEN if options.yes else SCREEN)
        return await _wait(bus, adapter, agent, PAIRING_S)


async def _wait(bus: Bus, adapter: str, agent: PairingAgent, seconds: int) -> int:
    """Return when a host has bonded, or after the time."""
    bonds: asyncio.Queue[str] = asyncio.Queue()

    def note(path: str, interface: str, changes: Properties | None) -> None:
        ours = path.startswith(adapter + "/") and interface == DEVICE
        if ours and changes and (changes.get("Bonded") or changes.get("Paired")):
            bonds.put_nowait(path)

    bus.listen(note)
    await agent.open_window(adapter, seconds)
    name = await bus.get(adapter, ADAPTER, "Alias")
    address = await bus.get(adapter, ADAPTER, "Address")
    print(f"waiting for a host to pair, for {seconds} s: look for {name} ({address})", flush=True)
    try:
        path = await asyncio.wait_for(bonds.get(), seconds)
    except TimeoutError:
        print("no host paired", flush=True)
        return 1
    finally:
        await agent.close_window(adapter)
    await bus.set(path, DEVICE, "Trusted", "b", True)
    device = bluez.devices(await bus.objects()).get(path, {})
    host = named(device)
    print(f"paired with {host}" if bonded(device) else f"{host} paired without a bond", flush=True)
    return 0 if bonded(device) else 1
