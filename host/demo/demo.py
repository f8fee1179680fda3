"""Demo without a window: the virtual orb's own hand plays in granted time, and is judged.

The host owns the clock: it grants the device one tick after another, as fast as both can go, so
that a game is the same for its seed. What the hand truly did comes back with the telemetry, and
judges what was recognised. In the window the demo is `host.app.screens.watch`, in real time.
"""

import math
import time
from collections.abc import Sequence
from typing import Any, Final

from controller.shared.errors import TroubleError, count
from controller.shared.protocol.messages import (
    Command,
    Grant,
    Granted,
    GroundTruth,
    Perform,
    State,
)
from host.actions import ACTIONS, HeldGestures
from host.connection.receiver import Connected, Delivered, Lost, Received, Receiver, Refused
from host.connection.transport import open_transport
from host.connection.virtual_orb import VirtualOrbProcess
from host.demo.autoplayer import Autoplayer, DemoRecord
from tetris.engine.game import Action, Config, Event, Game, Phase
from tetris.kit.settings import Settings

TICKS_PER_S: Final = 60
# An orb gives about one command a second, and a placement needs up to eight: at level 3 a
# piece falls for 12 s, and what has landed can still be moved by one more gesture.
PACE: Final = Config(gravity_cap=3, lock_delay_s=1.0)
AGAIN_S: Final = 1.0  # a drop meant for the last piece does not start the next game
ANSWER_S: Final = 5.0  # an orb that takes longer for a tick has died
_QUICK: Final = ("--sensor", "virtual:quick=1")  # a nominal orb understands the quickest hand
_CHOSEN: Final = ("--sensor", "--preset", "--bundle", "--rate")  # by the user: the hand is calm


def quick(orb_options: Sequence[str]) -> Sequence[str]:
    """Return options of a virtual orb whose hand is quick, unless they choose another orb."""
    chosen = any(word.partition("=")[0] in _CHOSEN for word in orb_options)
    return orb_options if chosen else (*_QUICK, *orb_options)


class DemoGame:
    """A game that the orb's commands play; `game` is the engine."""

    def __init__(self, seed: int) -> None:
        self.game = Game(seed, PACE)
        self._gestures = HeldGestures(Settings())
        self._running_s = 0.0  # when a game was last running or paused

    def tick(self, now_s: float, received: Sequence[Received]) -> list[Event]:
        """Advance to the present time and play received events, oldest first.

        Return the events of the game. The time is never earlier than before.
        """
        events: list[Event] = []
        for item in received:
            action = self._take(item, now_s)
            events += self._update(now_s, [action] if action else [])
        events += self._update(now_s, self._gestures.poll(now_s))
        if self.game.phase is not Phase.OVER:
            self._running_s = now_s
        return events

    def _update(self, now_s: float, actions: list[Action]) -> list[Event]:
        return self.game.update(now_s, actions, soft_drop=self._gestures.soft_drop(now_s))

    def _take(self, item: Received, now_s: float) -> Action | None:
        match item:
            case Connected(welcome=welcome):
                self._gestures = HeldGestures(Settings(), welcome.rate_hz)
            case Delivered(message=State(pressed=pressed)):
                self._gestures.hold(pressed, now_s)
            case Delivered(message=Command(name="drop")) if self.game.phase is Phase.OVER:
                return Action.RESTART if now_s - self._running_s >= AGAIN_S else None
            case Delivered(message=Command(name=name)):
                return ACTIONS.get(name)
        return None


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
        self._device = VirtualOrbProcess(seed, quick(orb_options))
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
            TroubleError: The orb is gone or stays silent.
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
                    raise TroubleError(
                        f"the virtual orb was lost at {self.now_s:.1f} s: {item.reason}"
                    )
                if isinstance(item, Delivered) and isinstance(item.message, Granted):
                    if item.message.until_ms == until:
                        return received
                    continue
                received.append(item)
            if time.monotonic() > deadline:
                raise TroubleError(f"the virtual orb does not answer at {self.now_s:.1f} s")
            self._receiver.wait(deadline - time.monotonic())


def until_ms(tick: int) -> int:
    """Return when tick number `tick` ends, whole milliseconds of granted time."""
    return round(tick * 1000 / TICKS_PER_S)


def summary(verdict: dict[str, Any]) -> str:
    """Return the verdict in a few lines for people."""
    share = verdict["hits"] / verdict["intended"] if verdict["intended"] else math.nan
    alarms, duplicates = verdict["false_alarms"], verdict["duplicates"]
    median_s = verdict["latency_s"]["p50"]
    return (
        f"{verdict['seconds']:.0f} s: {count(verdict['pieces'], 'piece')}, "
        f"{count(verdict['lines'], 'line')}; "
        f"{verdict['hits']} of {count(verdict['intended'], 'gesture')} understood ({share:.1%}), "
        f"{verdict['wrong']} wrong, {count(alarms, 'false alarm')}, "
        f"{count(duplicates, 'duplicate')}; "
        f"{'-' if median_s is None else f'{median_s:.2f}'} s from touch to action (median)"
    )
