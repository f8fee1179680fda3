"""The window's loop in real time: events and messages in, pictures and contacts out."""

import io
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import pygame

from controller.errors import TroubleError, reason
from controller.files import atomic_write
from controller.protocol.messages import Message, Welcome
from host.connection.receiver import Connected, Received, Refused
from host.connection.transport import LinkError
from host.targets import Target
from tetris.window.display import DisplayError, open_window

FRAMES_PER_S = 60
TICK_S = 0.01  # without a window, what comes over the link is taken at once
SIZE = (1280, 720)  # the window's first; it can be resized


class PictureError(TroubleError, OSError):
    """A picture of the window cannot be saved; the message is one sentence for the user."""


class WindowError(TroubleError, RuntimeError):
    """No window can be opened; the message is one sentence for the user."""


class Orb(Protocol):
    """What the loop needs of a `host.connection.receiver.Receiver`."""

    def poll(self) -> list[Received]:
        """Return what is new, oldest first, without waiting."""

    def send(self, message: Message) -> object:
        """Send without waiting."""


Observer = Callable[[Sequence[Received]], object]  # takes events, oldest first, without waiting


class WakeupReceiver(Orb, Protocol):
    """One that also tells when there is something to poll."""

    def wait(self, timeout_s: float) -> None:
        """Return when there is, or after the timeout."""


def play(
    target: Target,
    orb: Orb,
    surface: pygame.Surface,
    *,
    accept: Callable[[Welcome], object] | None = None,
    observers: Sequence[Observer] = (),
    seconds: float | None = None,
    screenshot: Path | None = None,
    drawn: Callable[[], object] = lambda: None,
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Play until the window is closed, or for some seconds.

    Args:
        target: What is played.
        orb: The link.
        surface: The window's surface.
        accept: Called with each device that connects; raises LinkError for a wrong one.
        observers: Called with each poll's events, after the target.
        seconds: When to stop by itself; None plays on.
        screenshot: Where to save the last picture.
        drawn: Called when a picture is on the screen.
        clock: Seconds that never turn back.

    Raises:
        LinkError: The first connection failed; later ones are tried again and again.
        PictureError: The picture cannot be saved.
    """
    pace = pygame.time.Clock()
    began_s = clock()
    playing, connected = True, False
    while playing:
        now_s = clock() - began_s
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                playing = False
            elif event.type == pygame.KEYDOWN and event.key == pygame.K_F11:
                surface = _toggle_fullscreen()
            else:
                target.handle(event, now_s)
        received = orb.poll()
        connected = _connected(received, connected, accept)
        target.tick(now_s, received)
        _observe(received, observers)
        for message in target.outgoing(now_s):
            orb.send(message)
        target.draw(surface)
        pygame.display.flip()
        drawn()
        pace.tick(FRAMES_PER_S)
        playing = playing and (seconds is None or now_s < seconds)
    if screenshot is not None:
        save(surface, screenshot)


def serve(
    target: Target,
    orb: WakeupReceiver,
    *,
    accept: Callable[[Welcome], object] | None = None,
    observers: Sequence[Observer] = (),
    seconds: float | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Let a target act without a window, for some seconds or until the program is ended.

    Raises:
        LinkError: The first connection failed; later ones are tried again and again.
    """
    began_s = clock()
    now_s, connected = 0.0, False
    while seconds is None or now_s < seconds:
        orb.wait(TICK_S)
        now_s = clock() - began_s
        received = orb.poll()
        connected = _connected(received, connected, accept)
        target.tick(now_s, received)
        _observe(received, observers)
        for message in target.outgoing(now_s):
            orb.send(message)


def _connected(
    received: Sequence[Received], before: bool, accept: Callable[[Welcome], object] | None
) -> bool:
    """Return whether there ever was a connection; raise if the first one failed."""
    for item in received:
        if isinstance(item, Refused) and not before:
            raise LinkError(item.reason)
        if isinstance(item, Connected):
            before = True
            if accept is not None:
                accept(item.welcome)
    return before


def _observe(received: Sequence[Received], observers: Sequence[Observer]) -> None:
    if received:
        for observer in observers:
            observer(received)


def _toggle_fullscreen() -> pygame.Surface:
    """Fill the screen, or go back to a window; pygame's own toggle does nothing on Wayland."""
    if pygame.display.is_fullscreen():
        return pygame.display.set_mode(SIZE, pygame.RESIZABLE)
    return pygame.display.set_mode((0, 0), pygame.FULLSCREEN)


def window(*, headless: bool = False, size: tuple[int, int] = SIZE) -> pygame.Surface:
    """Open the window; headless, a surface of the same size that nobody sees.

    Raises:
        WindowError: There is no display; the sentence says what to do.
    """
    if headless:
        os.environ["SDL_VIDEODRIVER"] = "dummy"
    try:
        return open_window(size, "OrbTouch")
    except DisplayError as error:
        raise WindowError(
            f"{error}; to let the demo play without a window, add --demo --headless"
        ) from error


def save(surface: pygame.Surface, path: Path) -> None:
    """Save a picture of the window; the name says the format, as in play.png.

    Raises:
        PictureError: It cannot be saved.
    """
    try:
        # In memory first: pygame does not see that a disk is full.
        picture = io.BytesIO()
        pygame.image.save(surface, picture, path.name)
        atomic_write(path, picture.getvalue())
    except OSError as error:
        raise PictureError(f"cannot save the picture {path}: {reason(error)}") from error
    except pygame.error as error:
        raise PictureError(f"cannot save the picture {path}: {error}") from error
