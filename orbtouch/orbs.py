"""Orbs: commands as they come, the state to look at, and a panel to draw into a game."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.errors import UserError
from controller.shared.protocol import psk
from controller.shared.protocol.messages import Command as CommandMessage
from controller.shared.protocol.messages import Contact, Contacts
from host.connection.receiver import Delivered, Received, Receiver, ever_connected
from host.connection.transport import open_transport
from host.connection.virtual_orb import VirtualOrbProcess
from host.ui.orb_state import LinkState, OrbState
from orbtouch.networks import Command
from orbtouch.recordings import Recording, load

if TYPE_CHECKING:
    import pygame

VIRTUAL: Final = "virtual"
_WAIT_S: Final = 0.2  # between looks whether the link is still wanted
_FINGER: Final = (9.0, 7.0)  # depth and radius of a finger, mm


class Orb:
    """A connected orb; made by `connect`, and closed by `close` or at the end of a `with` block.

    Iterating over it yields commands, and waits for the next, until it is closed. A lost link is
    connected again by itself.
    """

    def __init__(self, receiver: Receiver, process: VirtualOrbProcess | None = None) -> None:
        """Take over a link of the implementation; use `connect` instead."""
        self._receiver, self._process = receiver, process
        self._state = OrbState()
        self._connected = self._closed = False
        self._panel: object = None  # made at the first drawing, which needs pygame

    @property
    def link(self) -> LinkState:
        """The link: "connecting", "live", "stale" (silent for 0.3 s) or "lost"."""
        return self._state.link

    @property
    def labels(self) -> tuple[str, ...]:
        """Gestures of the orb, "null" first; () before it is connected."""
        return self._state.labels

    @property
    def image(self) -> NDArray[np.float32]:
        """What is felt, (rows, columns): relative change of each taxel, 0 untouched."""
        return self._state.felt.copy()

    @property
    def probabilities(self) -> dict[str, float]:
        """Present probability of each gesture; {} before it is connected."""
        return dict(zip(self.labels, self._state.probabilities.tolist(), strict=False))

    def commands(self) -> list[Command]:
        """Return the commands since the last call, oldest first, without waiting.

        It also brings `link`, `image` and `probabilities` up to date: call it once a picture.

        Raises:
            Error: The first connection failed.
        """
        received = self._receiver.poll()
        self._connected = ever_connected(received, self._connected)
        now_s = time.monotonic()
        for item in received:
            self._state.observe(item, now_s)
        self._state.advance(now_s)
        return [found for item in received if (found := _command(item)) is not None]

    def touch(self, *fingers: tuple[float, float]) -> None:
        """Put fingers on a virtual orb at (x, y), grid units, 0 to 4; none lifts all.

        Repeat it at least five times a second while they stay down: silence lifts them.
        """
        contacts = (Contact(n, x, y, *_FINGER) for n, (x, y) in enumerate(fingers))
        self._receiver.send(Contacts(tuple(contacts)))

    def draw(self, surface: "pygame.Surface", rect: "pygame.Rect | None" = None) -> None:
        """Draw the dome, its gestures and its link into a pygame surface; by default all of it."""
        from host.ui.panel.panel import Panel
        from host.ui.pointer_input import DomeArea
        from tetris.kit.settings import Look

        if not isinstance(self._panel, Panel):
            self._panel = Panel()
        welcome = self._state.welcome
        area = DomeArea(welcome.rows, welcome.columns, welcome.pitch_mm) if welcome else DomeArea()
        self._panel.place(rect or surface.get_rect(), area, gestures=len(self.labels[1:]))
        self._panel.draw(surface, self._state, time.monotonic(), Look())

    def close(self) -> None:
        """Say goodbye, and end a virtual orb; iteration ends."""
        self._closed = True
        self._receiver.close()
        if self._process is not None:
            self._process.close()

    def __iter__(self) -> Iterator[Command]:
        while not self._closed:
            yield from self.commands()
            self._receiver.wait(_WAIT_S)

    def __enter__(self) -> "Orb":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def connect(
    link: str = VIRTUAL, *, key: Path | str | None = None, options: Sequence[str] = ()
) -> Orb:
    """Return an orb, and connect to it in the background.

    Args:
        link: "virtual" starts a simulated orb in a process of its own; else a port (/dev/rfcomm0,
            COM3) or a URL (rfcomm://ADDRESS, socket://127.0.0.1:PORT).
        key: File of the key that the orb and this computer share (docs/link.md).
        options: Further ones of `controller` for a virtual orb, such as ("--seed", "7").

    Raises:
        Error: The key cannot be read.
    """
    secret = b"" if key is None else psk.read(Path(key))
    process = VirtualOrbProcess(1, options) if link == VIRTUAL else None
    if process is not None:
        receiver = Receiver(process.open, token=process.token)
    else:
        receiver = Receiver(lambda: open_transport(link), key=secret)
    receiver.start()
    return Orb(receiver, process)


def record(path: Path | str, seconds: float, *options: str) -> Recording:
    """Record a sensor on this machine into a new file, in real time; return the recording.

    Args:
        path: File to make, NAME.npz.
        seconds: How long, from the sensor's start.
        options: Those of `controller`, such as "--sensor", "orb", "--label", "press"; by default a
            virtual orb that nobody touches.

    Raises:
        Error: The sensor cannot be read, or the file is there already; the message says why.
    """
    command = [sys.executable, "-m", "controller", "--record", str(path), "--link", "-", *options]
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            message = process.communicate(timeout=seconds)[1]
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGTERM)
            message = process.communicate()[1]
    if process.returncode:
        raise UserError(message.strip().removeprefix("controller: ") or "nothing was recorded")
    return load(path)


def _command(item: Received) -> Command | None:
    """Return what arrived as a command; None if it is something else."""
    match item:
        case Delivered(CommandMessage() as one, t_ms):
            return Command(t_ms / 1000, one.name, one.label, one.probability, one.touch)
    return None
