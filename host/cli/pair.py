"""`host pair`: find an orb that waits to be paired, pair with it, and print what to run next."""

from __future__ import annotations

import argparse
import asyncio
import logging
import sys
from collections.abc import Sequence
from functools import partial

from controller.shared.arguments import Parser
from controller.shared.bluetooth import bluez
from controller.shared.bluetooth.bluez import BluetoothError
from controller.shared.errors import TROUBLE, complain, how_to_install
from host.connection import rfcomm
from host.connection.pairing import BY_SYSTEM, pair


def main(argv: Sequence[str]) -> int:
    """Return 0 when paired, 1 for trouble, 2 for wrong usage."""
    options = _parser().parse_args(argv)
    logging.basicConfig(format="%(message)s", level=logging.WARNING, stream=sys.stderr)
    if sys.platform in BY_SYSTEM:
        print(BY_SYSTEM[sys.platform])
        return 0
    if not bluez.available():
        needed = f"pairing needs dbus-fast; {how_to_install('bluetooth')}"
        return complain("host", needed, TROUBLE)
    try:
        url = asyncio.run(_pair(options))
    except BluetoothError as error:
        return complain("host", error, TROUBLE)
    print(f"play: host --link {url}")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="host pair",
        allow_abbrev=False,
        description="Find an orb that waits to be paired (controller pair, or its button) and pair "
        "with it. Both show six digits; confirm them here if they are the same.",
        epilog="On Windows and macOS it prints what to click: their own settings pair.",
    )
    add = parser.add_argument
    add("address", metavar="ADDRESS", nargs="?", type=_address, help="the orb's (default: look)")
    add("--adapter", metavar="NAME", default="", help="hci1, or an address (default: the first)")
    add("--yes", action="store_true", help="pair without comparing digits")
    return parser


def _address(words: str) -> str:
    if not rfcomm.ADDRESS.fullmatch(words):
        raise argparse.ArgumentTypeError(f"{words} is no address like 00:11:22:33:44:55")
    return words.upper()


async def _pair(options: argparse.Namespace) -> str:
    from controller.shared.bluetooth.pairing_agent import Prompt

    confirm = None if options.yes else Prompt().confirm  # a prompt needs the running loop
    tell = partial(print, flush=True)
    return await pair(tell, confirm, adapter=options.adapter, address=options.address)
