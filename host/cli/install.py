"""`host install FILE`: send the orb a new bundle over its link."""

from __future__ import annotations

import argparse
import contextlib
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from controller import console
from controller.console import TROUBLE
from controller.errors import UserError, reason
from controller.files import read_bytes
from controller.protocol import psk
from controller.protocol.link_events import Connected, Received, Refused
from host.connection.bundle_upload import BundleUpload
from host.connection.device_store import DeviceStore
from host.connection.receiver import Receiver
from host.connection.transport import LinkError, open_transport
from host.discovery.seek import DevicePort
from host.window_loop import WakeupReceiver

MOST: Final = 64 << 20  # bytes; an orb takes no more
TURN_S: Final = 0.05  # the longest that the courier waits for news


class FileError(UserError, ValueError):
    """The file cannot be sent; the message says why, in one sentence."""


def main(argv: list[str]) -> int:
    """Deliver a bundle; return 0 when it is in use, 1 if that fails, 2 for wrong usage."""
    return console.run("host", lambda: _install(_parser().parse_args(argv)))


def _install(options: argparse.Namespace) -> int:
    """Deliver a bundle; return the exit status."""
    courier = load(options.file)
    try:
        receiver = _receiver(options)
        receiver.start()
        try:
            deliver(courier, receiver, _Progress())
        finally:
            receiver.close()
    except KeyboardInterrupt:
        _warn("interrupted; the orb keeps what it has, and the same command goes on from there")
        return console.INTERRUPTED
    if courier.stage == "declined":
        return console.complain("host", _declined(courier), TROUBLE)
    print(courier.told)
    return 0


def _receiver(options: argparse.Namespace) -> Receiver:
    """Return the link to the orb that the user names, by its port or by itself."""
    path, opening = options.key, lambda: open_transport(options.link)
    if options.device is not None:
        memory = DeviceStore(warn=_warn)
        seeker = DevicePort(options.device, memory, "" if path is None else str(path.resolve()))
        [known] = memory.named(seeker.device_id)
        path = Path(known.key) if path is None and known.key else path
        opening = seeker.open
    return Receiver(opening, key=b"" if path is None else psk.read(path))


def load(path: Path) -> BundleUpload:
    """Return a courier for a file.

    Raises:
        FileError: It cannot be read, or is no bundle by its size.
    """
    try:
        data = read_bytes(path, MOST)
    except OSError as error:
        raise FileError(f"{path} cannot be read: {reason(error)}; name a bundle") from None
    if not data:
        raise FileError(f"{path} is empty; name a bundle")
    return BundleUpload(path.name, data)


def deliver(
    courier: BundleUpload,
    orb: WakeupReceiver,
    tell: Callable[[BundleUpload], object],
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Turn until the bundle is delivered, or declined.

    Args:
        courier: Who delivers.
        orb: The link.
        tell: Is shown the courier after every turn.
        clock: Seconds that never go back.

    Raises:
        LinkError: The first connection failed; later ones are tried again and again.
    """
    met = False
    while not courier.over:
        orb.wait(TURN_S)
        news = orb.poll()
        for item in news:
            if isinstance(item, Refused) and not met:
                raise LinkError(item.reason)
            met = met or isinstance(item, Connected)
        courier.turn(news, clock(), orb.send)
        tell(courier)


class InstallProgress:
    """A delivery beside a game: it hears what the game hears, and tells in a line how it goes."""

    def __init__(
        self,
        courier: BundleUpload,
        send: Callable[..., object],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Deliver through `send` whenever there is news."""
        self._courier, self._send, self._clock = courier, send, clock
        self._tell = _Progress()

    def hear(self, news: Sequence[Received]) -> None:
        """Take what is new, and go on."""
        if self._courier.over:
            return
        self._courier.turn(news, self._clock(), self._send)
        self._tell(self._courier)
        if self._courier.over:
            declined = self._courier.stage == "declined"
            _warn(_declined(self._courier) if declined else self._courier.told)


class _Progress:
    """A line on the terminal that is written over; a log gets one for each stage."""

    def __init__(self) -> None:
        self._last = ""

    def __call__(self, courier: BundleUpload) -> None:
        words: str = courier.stage
        with contextlib.suppress(OSError, ValueError):  # it is for people only; none may be there
            terminal = sys.stderr.isatty()
            if courier.stage == "sending" and terminal:
                words = f"sending {100 * courier.offset // courier.size:3d} %"
            if words != self._last:
                self._last = words
                end = "" if terminal and not courier.over else "\n"
                print(f"\r{words:16}", end=end, file=sys.stderr, flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="host install",
        description="Send an orb a new bundle. It proves it on itself, while whoever plays goes "
        "on playing, and then takes it into use; `controller rollback` on the orb goes back. Only "
        "a link that proves who is there takes any: one with a key, or paired over Bluetooth.",
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="the bundle, NAME.orb")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--link", metavar="URL", help="where the orb is, as for host")
    where.add_argument("--device", metavar="NAME", help="the orb of this identity or name")
    parser.add_argument("--key", metavar="FILE", type=Path, help="the key that the orb has")
    return parser


def _declined(courier: BundleUpload) -> str:
    return f"the orb does not take it: {courier.told}"


def _warn(words: str) -> None:
    console.complain("host", words, TROUBLE)
