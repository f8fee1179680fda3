"""Orbs: events as they come, the state to look at, and a panel to draw into a game."""

import math
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.errors import UserError
from controller.shared.protocol import psk
from controller.shared.protocol.messages import Command as CommandMessage
from controller.shared.protocol.messages import Contact as Finger
from controller.shared.protocol.messages import Contacts, ContactState, Telemetry
from host.connection.receiver import Delivered, Received, Receiver, ever_connected
from host.connection.transport import open_transport
from host.connection.virtual_orb import VirtualOrbProcess
from host.ui.orb_state import LinkState, OrbState
from orbtouch import checks
from orbtouch.networks import Command
from orbtouch.recordings import Recording, load_recording

if TYPE_CHECKING:
    import pygame

VIRTUAL: Final = "virtual"
_VIRTUAL: Final = ("bundle", "fault", "mapping", "preset", "seed")  # keywords of `connect`
_SENSOR: Final = ("label", "sensor", "session", "user")  # and of `record`
Option = str | int | Path  # value of a keyword
_WAIT_S: Final = 0.2  # between looks whether the link is still wanted
_RADIUS_MM: Final = 7.0  # of a finger


@dataclass(frozen=True, slots=True)
class Contact:
    """What touches in one frame, with standard deviations.

    Attributes:
        t: Seconds of the orb's clock, as everywhere.
        position: (x, y), grid units, (0, 0) at the near left taxel: the middle of all fingers.
        position_sigma: Of x and of y.
        depth_mm: Of the deepest finger.
        depth_sigma: mm.
        fingers: 1, 2, or 3 for more.
        fingers_probability: Probability of that number.
        angle_deg: Rotation since the fingers landed, counter-clockwise positive.
        angle_sigma: Degrees.
        rise_mm: Depth above its mean in the .2 s before.
        rise_sigma: mm.
    """

    t: float
    position: tuple[float, float]
    position_sigma: float
    depth_mm: float
    depth_sigma: float
    fingers: int
    fingers_probability: float
    angle_deg: float
    angle_sigma: float
    rise_mm: float
    rise_sigma: float


@dataclass(frozen=True, slots=True)
class Press:
    """The begin of a contact at `t`."""

    t: float
    contact: Contact


@dataclass(frozen=True, slots=True)
class Release:
    """The end of a contact at `t`; `contact` is its last frame."""

    t: float
    contact: Contact


@dataclass(frozen=True, slots=True)
class Frame:
    """A scan: its number, its end at `t`, and `image`, see `Orb.image`."""

    number: int
    t: float
    image: NDArray[np.float32]


class Orb(AbstractContextManager["Orb"]):
    """A connected orb; made by `connect`, and closed by `close` or at the end of a `with` block.

    Iterating over it yields commands, and waits for the next, until it is closed. A lost link is
    connected again by itself.
    """

    def __init__(self, receiver: Receiver, end: Callable[[], None] = lambda: None) -> None:
        """Take over a link of the implementation; use `connect` instead."""
        self._receiver, self._end = receiver, end  # of a device of its own
        self._state = OrbState()
        self._connected = self._closed = False
        self._contact: Contact | None = None
        self._scan = 0, 0.0  # number and time of the latest frame
        self._panel: object = None  # made at the first drawing, which needs pygame

    @property
    def link(self) -> LinkState:
        """The link: "connecting", "live", "stale" (silent for 0.3 s) or "lost"."""
        return self._state.link

    @property
    def classes(self) -> tuple[str, ...]:
        """Gestures of the orb, "null" first; () before it is connected."""
        return self._state.labels

    @property
    def image(self) -> NDArray[np.float32]:
        """What is felt, (rows, columns): relative change of each taxel, 0 untouched."""
        return self._state.felt.copy()

    @property
    def frame(self) -> Frame | None:
        """The latest frame; None before the first one."""
        number, t_s = self._scan
        return Frame(number, t_s, self.image) if number else None

    @property
    def contact(self) -> Contact | None:
        """What touches; None if nothing does, or the orb's bundle does not estimate it."""
        return self._contact

    @property
    def held(self) -> str:
        """The gesture that is held; "" if none."""
        return self._state.gesture

    @property
    def probabilities(self) -> dict[str, float]:
        """Present probability of each gesture; {} before it is connected."""
        return dict(zip(self.classes, self._state.probabilities.tolist(), strict=False))

    def commands(self) -> list[Command]:
        """Return the commands of `events`, and leave out the others."""
        return [event for event in self.events() if isinstance(event, Command)]

    def events(self) -> list[Press | Release | Command]:
        """Return what has happened since the last call, oldest first, without waiting.

        It also brings all attributes up to date: call it, or `commands`, once a picture. A contact
        ends with the link, too. Error if the first connection failed.
        """
        received = self._receiver.poll()
        self._connected = ever_connected(received, self._connected)
        now_s = time.monotonic()
        events = [event for item in received for event in self._take(item, now_s)]
        self._state.advance(now_s)
        return events

    def _take(self, item: Received, now_s: float) -> Iterator[Press | Release | Command]:
        """Yield the events of what arrived."""
        self._state.observe(item, now_s)
        before = self._contact
        match item:
            case Delivered(CommandMessage() as one, t_ms):
                yield Command(t_ms / 1000, one.name, one.label, one.probability, one.touch)
            case Delivered(Telemetry(frame=number), t_ms):
                self._scan = number, t_ms / 1000
            case Delivered(ContactState() as state, t_ms) if state.fingers:
                x, y, *others = (getattr(state, name) for name in state.__match_args__[1:-1])
                self._contact = Contact(t_ms / 1000, (x, y), *others)
                if before is None:
                    yield Press(t_ms / 1000, self._contact)
        if before is not None and self._state.contact is None:
            self._contact = None
            yield Release(item.t_ms / 1000 if isinstance(item, Delivered) else before.t, before)

    def touch(self, *fingers: tuple[float, float], depth_mm: float = 9.0) -> None:
        """Put fingers on a virtual orb at (x, y), grid units, 0 to 4; none lifts all.

        Repeat it at least five times a second while they stay down: silence lifts them.
        """
        touching = (Finger(n, x, y, depth_mm, _RADIUS_MM) for n, (x, y) in enumerate(fingers))
        self._receiver.send(Contacts(tuple(touching)))

    def draw(self, surface: "pygame.Surface", rect: "pygame.Rect | None" = None) -> None:
        """Draw the dome, its gestures and its link into a pygame surface; by default all of it."""
        from host.ui.panel.panel import Panel
        from host.ui.pointer_input import DomeArea
        from tetris.kit.settings import Look

        if not isinstance(self._panel, Panel):
            self._panel = Panel()
        welcome = self._state.welcome
        area = DomeArea(welcome.rows, welcome.columns, welcome.pitch_mm) if welcome else DomeArea()
        self._panel.place(rect or surface.get_rect(), area, gestures=len(self.classes[1:]))
        self._panel.draw(surface, self._state, time.monotonic(), Look())

    def close(self) -> None:
        """Say goodbye, and end a virtual orb; iteration ends."""
        self._closed = True
        self._receiver.close()
        self._end()

    def __iter__(self) -> Iterator[Command]:
        while not self._closed:
            yield from self.commands()
            self._receiver.wait(_WAIT_S)

    def __exit__(self, *problem: object) -> None:
        self.close()


def _words(options: Mapping[str, object], known: Sequence[str]) -> list[str]:
    """Return keywords as words of a command line; Error if one is not known."""
    checks.options(options, known)
    return [word for name, value in options.items() for word in (f"--{name}", str(value))]


def connect(link: str = VIRTUAL, *, key: Path | str | None = None, **options: Option) -> Orb:
    """Return an orb, and connect to it in the background.

    Args:
        link: "virtual" starts a simulated orb in a process of its own; else a port (/dev/rfcomm0,
            COM3) or a URL (rfcomm://ADDRESS, socket://127.0.0.1:PORT).
        key: File of the key that the orb and this computer share (docs/link.md).
        options: Of a virtual orb: seed=7, preset="paper-snr", fault="dead:2,3", bundle="my.orb" or
            mapping="my.toml", as of `controller` (docs/running.md).

    Raises:
        Error: The key cannot be read, or there is no such option.
    """
    if not isinstance(link, str):
        raise UserError(f"link = {link!r}; expected is a port or a URL, such as /dev/rfcomm0")
    secret = b"" if key is None else psk.read(checks.path(key))
    words = _words(options, _VIRTUAL)
    if link == VIRTUAL:
        process = VirtualOrbProcess(1, words)
        orb = Orb(Receiver(process.open, token=process.token), process.close)
    elif words:
        raise UserError(f"options are those of a virtual orb; leave them out with {link}")
    else:
        orb = Orb(Receiver(lambda: open_transport(link), key=secret))
    orb._receiver.start()
    return orb


def record(path: Path | str, duration: float, **options: Option) -> Recording:
    """Record a sensor on this machine into a new file, in real time; return the recording.

    Args:
        path: File to make, NAME.npz.
        duration: Time of the last frame, seconds, more than 1; frame k has the time k / rate.
        options: sensor="orb", user="ada", session="1" and label="press", as of `controller`, and
            those of `connect`; by default a virtual orb whose simulated hand shows every gesture.

    Raises:
        Error: The sensor cannot be read, there is no such option, or the file is there already;
            the message says why.
    """
    checks.number(duration, "duration", 1.0, math.inf)
    path = checks.path(path)
    if path.is_dir():
        raise UserError(f"{path} is a folder; name a file to make, NAME.npz")
    command = [sys.executable, "-m", "controller", "--record", str(path), "--link", "-"]
    command += ["--seconds", f"{duration:g}", *_words(options, (*_VIRTUAL, *_SENSOR))]
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode or not path.exists():
        message = done.stderr.strip().rpartition("controller: ")[2] if done.returncode else ""
        nothing = f"nothing was recorded in {duration:g} s; a second or more is kept"
        raise UserError(message or nothing)
    return load_recording(path)
