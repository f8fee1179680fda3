"""Window loop in real time: events and messages in, pictures and contacts out."""

import math
import os
import time
from collections.abc import Callable, Sequence

import pygame
from pygame import Surface as Surface

from controller.shared.errors import TroubleError
from host.connection.receiver import Receiver, ever_connected
from host.targets import SIZE, Target
from host.ui import dome
from tetris.kit import theme
from tetris.kit.display import DisplayError, open_window, set_fullscreen, show_icon

FRAMES_PER_S = 60
_EARLY_S = 0.5 / FRAMES_PER_S  # the loop's own steps are too coarse to wait any longer
TICK_S = 0.01  # without a window, what comes over the link is taken at once
_TICKS = 5  # for each picture of an idle page: messages are taken, and events seen
_ICON = 56  # radius of the dome that is the window's icon, pixels


def play(
    target: Target,
    orb: Receiver,
    surface: pygame.Surface,
    stopped: Sequence[str] = (),
    *,
    seconds: float | None = None,
    drawn: Callable[[], object] = lambda: None,
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Play until the window is closed, or for some seconds.

    It also ends when `stopped` has a reason. `drawn` is called when a picture is on the screen; the
    clock never turns back.

    Raises:
        LinkError: The first connection failed; later ones are tried again and again.
    """
    pace = pygame.time.Clock()
    began_s = clock()
    playing, connected = True, False
    fullscreen = pygame.display.is_fullscreen()
    drawn_s = -math.inf
    while playing:
        now_s = clock() - began_s
        events = pygame.event.get()
        for event in events:
            if event.type == pygame.QUIT:
                playing = False
            elif event.type == pygame.KEYDOWN and event.key == pygame.K_F11:
                target.fullscreen = not target.fullscreen
            else:
                target.handle(event, now_s)
        connected = _exchange(target, orb, now_s, connected)
        if target.fullscreen is not fullscreen:
            fullscreen = target.fullscreen
            surface = set_fullscreen(fullscreen, target.size)
        if events or now_s - drawn_s >= 1 / target.frames_hz - _EARLY_S:
            drawn_s = now_s
            target.draw(surface)
            pygame.display.flip()
            drawn()
        pace.tick(min(FRAMES_PER_S, _TICKS * target.frames_hz))
        over = target.closed or bool(stopped) or (seconds is not None and now_s >= seconds)
        playing = playing and not over


def serve(
    target: Target,
    orb: Receiver,
    stopped: Sequence[str] = (),
    *,
    seconds: float | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Let a target act without a window, for some seconds or until `stopped` has a reason.

    LinkError if the first connection failed; later ones are tried again and again.
    """
    began_s = clock()
    now_s, connected = 0.0, False
    while not stopped and (seconds is None or now_s < seconds):
        orb.wait(TICK_S)
        now_s = clock() - began_s
        connected = _exchange(target, orb, now_s, connected)


def _exchange(target: Target, orb: Receiver, now_s: float, connected: bool) -> bool:
    """Pass messages between target and link; return whether there ever was a connection."""
    received = orb.poll()
    connected = ever_connected(received, connected)
    target.tick(now_s, received)
    for message in target.outgoing(now_s):
        orb.send(message)
    return connected


def window(*, headless: bool = False, size: tuple[int, int] = SIZE) -> pygame.Surface:
    """Open the window, or TroubleError; headless, an invisible surface of the same size."""
    if headless:
        os.environ["SDL_VIDEODRIVER"] = "dummy"
    try:
        surface = open_window(size, "OrbTouch")
    except DisplayError as error:
        raise TroubleError(
            f"{error}; to let the demo play without a window, add --demo --headless"
        ) from error
    if not headless:
        show_icon(surface, dome.balloon(_ICON, theme.DARK.raised, theme.DARK.line))
    return surface
