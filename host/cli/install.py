"""`host install FILE`: send the orb a new bundle over its link."""

from __future__ import annotations

import argparse
import contextlib
import sys
import time
from pathlib import Path
from typing import Final

from controller.shared import errors
from controller.shared.arguments import Parser
from controller.shared.errors import TROUBLE
from controller.shared.protocol import psk
from host.cli import warn
from host.connection.bundle_upload import BundleUpload, load, outcome
from host.connection.device_store import DeviceStore
from host.connection.discovery import DevicePort
from host.connection.receiver import Receiver, ever_connected
from host.connection.transport import open_transport

TURN_S: Final = 0.05  # the longest wait for messages


def main(argv: list[str]) -> int:
    """Deliver a bundle; return 0 when it is in use, 1 if that fails, 2 for wrong usage."""
    return errors.run("host", lambda: _install(_parser().parse_args(argv)))


def _install(options: argparse.Namespace) -> int:
    upload = load(options.file)
    try:
        receiver = _receiver(options)
        receiver.start()
        try:
            _deliver(upload, receiver)
        finally:
            receiver.close()
    except KeyboardInterrupt:
        warn("interrupted; the orb keeps what it has, and the same command goes on from there")
        return errors.INTERRUPTED
    if upload.stage == "declined":
        return errors.complain("host", outcome(upload), TROUBLE)
    print(outcome(upload))
    return 0


def _deliver(upload: BundleUpload, link: Receiver) -> None:
    """Run the link until the upload is over; LinkError if the first connection failed."""
    connected, shown = False, ""
    while not upload.over:
        link.wait(TURN_S)
        received = link.poll()
        connected = ever_connected(received, connected)
        upload.turn(received, time.monotonic(), link.send)
        with contextlib.suppress(OSError, ValueError):  # standard error may be closed
            shown = _show(upload, shown)


def _show(upload: BundleUpload, before: str) -> str:
    """Print the state if it has changed: on a terminal over the last one, in a log one a line."""
    terminal, words = sys.stderr.isatty(), str(upload.stage)
    if upload.stage == "sending" and terminal:
        words = f"sending {100 * upload.offset // upload.size:3d} %"
    if words != before:
        end = "" if terminal and not upload.over else "\n"
        print(f"\r{words:16}", end=end, file=sys.stderr, flush=True)
    return words


def _receiver(options: argparse.Namespace) -> Receiver:
    """Return the link to the orb that the user names, by its port or by itself."""
    path, opening = options.key, lambda: open_transport(options.link)
    if options.device is not None:
        memory = DeviceStore(warn=warn)
        seeker = DevicePort(options.device, memory, "" if path is None else str(path.resolve()))
        [known] = memory.named(seeker.device_id)
        path = Path(known.key) if path is None and known.key else path
        opening = seeker.open
    return Receiver(opening, key=b"" if path is None else psk.read(path))


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="host install",
        description="Send an orb a new bundle. The orb tests it while play goes "
        "on, and then takes it into use; `controller install` on the orb goes back. Only "
        "an authenticated link takes any: one with a key, or paired over Bluetooth.",
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="the bundle, NAME.orb")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--link", metavar="URL", help="where the orb is, as for host")
    where.add_argument("--device", metavar="NAME", help="the orb of this identity or name")
    parser.add_argument("--key", metavar="FILE", type=Path, help="the key that the orb has")
    return parser
