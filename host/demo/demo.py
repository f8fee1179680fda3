"""Closed-loop demo: a player, the virtual orb's own hand, and the whole path between them.

The host owns the clock: it grants the device one tick after another, so that a game is the
same for its seed at every speed. What the hand truly did comes back with the telemetry, and
judges what was recognised.
"""

import json
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import pygame

from controller.shared.errors import TroubleError, count
from controller.shared.protocol.messages import Grant, Granted, GroundTruth, Perform
from host.connection.receiver import Connected, Delivered, Lost, Received, Receiver, Refused
from host.connection.transport import open_transport
from host.connection.virtual_orb import VirtualOrbProcess
from host.demo.autoplayer import Autoplayer, shipped_gestures
from host.demo.game import DemoGame
from host.demo.record import DemoRecord
from host.window_loop import save, window

TICKS_PER_S: Final = 60
QUICK: Final = ("--sensor", "virtual:quick=1")  # a nominal orb understands the quickest hand
_CHOSEN: Final = ("--sensor", "--preset", "--bundle", "--rate")  # by the user: the hand is calm
DRAW_EVERY: Final = 4  # ticks per picture when time is not real
ANSWER_S: Final = 5.0  # an orb that takes longer for a tick has died


class DemoError(TroubleError, RuntimeError):
    """The demo cannot go on; the message is one sentence."""


class Demo:
    """A demo game, tick by tick: the granted clock, the player, the game, the record."""

    def __init__(
        self, seed: int, seconds: float, orb_options: Sequence[str] = (), link: str | None = None
    ) -> None:
        self.target = DemoGame(seed)
        self.record = DemoRecord()
        self.seed, self.seconds = seed, seconds
        self.tick_number = 0
        self._player = Autoplayer(seed, seconds)
        chosen = any(word.partition("=")[0] in _CHOSEN for word in orb_options)
        self._device = VirtualOrbProcess(seed, orb_options if chosen else (*QUICK, *orb_options))
        opened = self._device.open if link is None else lambda: open_transport(link)
        self._receiver = Receiver(opened, token=self._device.token, granted=True)

    def __enter__(self) -> "Demo":
        """Start the orb and connect.

        Raises:
            LinkError: The orb does not start.
        """
        try:
            self._receiver.connect()
        except BaseException:
            self._device.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._receiver.close()
        self._device.close()

    @property
    def now_s(self) -> float:
        """Granted time."""
        return until_ms(self.tick_number) / 1000

    @property
    def over(self) -> bool:
        """Whether the time is up."""
        return self.now_s >= self.seconds

    def tick(self) -> None:
        """Let the player decide, grant one tick, and play what comes back.

        Raises:
            DemoError: The orb is gone or stays silent.
        """
        decision = self._player.decide(self.target.game, self.now_s)
        if decision is not None:
            performance, command = decision
            self._perform(performance, command)
        self.tick_number += 1
        until = until_ms(self.tick_number)
        self._receiver.send(Grant(until))
        received = self._answer(until)
        self.record.take(received, until)
        self.record.watch(self.target.tick(until / 1000, received))
        for item in received:
            if isinstance(item, Connected):
                self._player.meet(item.welcome)
                for gesture in shipped_gestures():
                    self.target.orb.described(gesture)
            elif isinstance(item, Delivered) and isinstance(item.message, GroundTruth):
                self._player.left(item.message.number, until / 1000)

    def verdict(self) -> dict[str, Any]:
        """Return the figures so far."""
        link = self._receiver
        return self.record.verdict(self.seed, self.now_s, link.bytes_received, link.bytes_sent)

    def _perform(self, performance: Perform, command: str) -> None:
        self.record.meant[performance.number] = command
        self._receiver.send(performance)

    def _answer(self, until: int) -> list[Received]:
        """Return all messages of the device up to `until`."""
        received: list[Received] = []
        deadline = time.monotonic() + ANSWER_S
        while True:
            for item in self._receiver.poll():
                if isinstance(item, Lost | Refused):
                    raise DemoError(
                        f"the virtual orb was lost at {self.now_s:.1f} s: {item.reason}"
                    )
                if isinstance(item, Delivered) and isinstance(item.message, Granted):
                    if item.message.until_ms == until:
                        return received
                    continue
                received.append(item)
            if time.monotonic() > deadline:
                raise DemoError(f"the virtual orb does not answer at {self.now_s:.1f} s")
            self._receiver.wait(deadline - time.monotonic())


def until_ms(tick: int) -> int:
    """Return when tick number `tick` ends, whole milliseconds of granted time."""
    return round(tick * 1000 / TICKS_PER_S)


def run(
    *,
    seed: int,
    seconds: float,
    speed: float,
    headless: bool,
    as_json: bool,
    screenshot: Path | None = None,
    orb_options: Sequence[str] = (),
    link: str | None = None,
    shutdown: Sequence[str] = (),
) -> None:
    """Play a demo of some granted time, and print how it went.

    Speed 1 is real time, 0 as fast as it goes; without a link the orb is one of our own, with
    further options of `controller`. It ends early when `shutdown` has a reason.

    Raises:
        LinkError, DemoError: The orb cannot be reached, or is gone or silent.
        WindowError, PictureError: There is no display, or the picture cannot be saved.
    """
    surface = None if headless and screenshot is None else window(headless=headless)
    with Demo(seed, seconds, orb_options, link) as demo:
        _play(demo, speed, surface, shutdown)
        verdict = demo.verdict()
    if shutdown:
        return
    if surface is not None and screenshot is not None:
        save(surface, screenshot)
    print(json.dumps(verdict) if as_json else summary(verdict))


def summary(verdict: dict[str, Any]) -> str:
    """Return the verdict in a few lines for people."""
    share = verdict["hits"] / verdict["intended"] if verdict["intended"] else math.nan
    alarms, duplicates = verdict["false_alarms"], verdict["duplicates"]
    return (
        f"{verdict['seconds']:.0f} s: {count(verdict['pieces'], 'piece')}, "
        f"{count(verdict['lines'], 'line')}; "
        f"{verdict['hits']} of {count(verdict['intended'], 'gesture')} understood ({share:.1%}), "
        f"{verdict['wrong']} wrong, {count(alarms, 'false alarm')}, "
        f"{count(duplicates, 'duplicate')}; "
        f"{_shown(verdict['latency_s']['p50'])} s from touch to action (median)"
    )


def _shown(seconds: float | None) -> str:
    """Return seconds for people; "-" if nothing was measured."""
    return "-" if seconds is None else f"{seconds:.2f}"


def _play(
    demo: Demo, speed: float, surface: pygame.Surface | None, shutdown: Sequence[str]
) -> None:
    start = time.monotonic()
    while not (demo.over or shutdown):
        if speed > 0:
            due = start + until_ms(demo.tick_number + 1) / 1000 / speed
            time.sleep(max(0.0, due - time.monotonic()))
        demo.tick()
        if surface is None or demo.tick_number % (DRAW_EVERY if speed != 1 else 1):
            continue
        demo.target.draw(surface)
        pygame.display.flip()
        if pygame.event.get(pygame.QUIT):
            return
