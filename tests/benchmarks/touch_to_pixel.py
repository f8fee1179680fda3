"""From the mouse's contact to the picture in which the piece has moved, in real time, by hop.

    python -m tests.benchmarks.touch_to_pixel [--touches N] [--seed N] [--bundle FILE] [--json]

The window's own loop at 60 pictures a second, a virtual orb in a process of its own and a TCP link
between them. A mouse presses left and right in turn, pinches and twists, on the panel's own input
code; pictures are drawn by SDL's dummy driver, which shows them nowhere. `ghost` is a press by Aim:
the piece goes to the touched column, and its ghost with it. The hops of a touch:

- `decide`: from the contact message to the frame that decides: finger, frames and debouncing;
- `link`: from that frame to the tick that plays it, the network's step included;
- `draw`: from there to the end of the picture.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np
import pygame

from controller.shared.protocol.messages import Command, Contacts, ContactState, Message
from host import window_loop
from host.app.application import OrbApp
from host.connection.receiver import Delivered, Received, Receiver
from host.connection.virtual_orb import VirtualOrbProcess
from tetris.window.app import Start

from .results import Results, command_line
from .tapping import RIM, SIDES, TURN_DEG

READY_S: Final = 3.0  # the orb has its rest image
EVERY_S: Final = 1.5  # from one touch to the next
DWELL_S: Final = {"press": 0.1, "pinch": 0.25, "twist": 0.4, "ghost": 0.4}
GOALS: Final = {"press": 220.0, "ghost": 100.0}  # ms, median of the whole
HOPS: Final = ("decide", "link", "draw", "total")
CALM: Final = "zen"  # the mode in which nothing falls


@dataclass(slots=True)
class Touch:
    """One touch and its times, seconds of the loop's clock."""

    gesture: str
    sent_s: float = 0.0
    taken_s: float | None = None  # the tick that played its command
    decided_s: float | None = None  # end of the frame that decided, by the orb's clock
    shown_s: float | None = None


class Clicking(OrbApp):
    """The application, and a mouse that touches the orb at its own times."""

    def __init__(self, seed: int, gestures: Sequence[str], receiver: Receiver) -> None:
        super().__init__(Start(CALM, seed), sound=False)
        aims = "ghost" in gestures
        control = "aim" if aims else "buttons"
        self.stage.settings = replace(self.stage.settings, control=control)
        self._decides = ContactState if aims else Command
        self.touches: list[Touch] = []
        self.done = False
        self._receiver = receiver
        self._script = self._scripted(gestures, np.random.default_rng(seed))
        self._due_s = 0.0

    def tick(self, now_s: float, received: Sequence[Received] = ()) -> None:
        """Play what came, and let the mouse go on."""
        before = self._shape()
        super().tick(now_s, received)
        deciding = (
            item for item in received
            if isinstance(item, Delivered) and isinstance(item.message, self._decides)
        )  # fmt: skip
        for item in deciding:
            if self.touches and self.touches[-1].taken_s is None and self._shape() != before:
                offset = self._receiver.clock_offset_ms
                late_s = 0.0 if offset is None else time.monotonic() - (item.t_ms - offset) / 1000
                self.touches[-1].taken_s = now_s
                self.touches[-1].decided_s = now_s - late_s
        if self.orb.link == "live" and now_s >= max(READY_S, self._due_s):
            self._due_s = next(self._script, -1.0)
            self.done = self._due_s < 0.0

    def outgoing(self, now_s: float) -> list[Message]:
        """Return the messages for the orb; the first contact of a touch begins its time."""
        sent = super().outgoing(now_s)
        down = any(isinstance(one, Contacts) and one.contacts for one in sent)
        if down and self.touches and not self.touches[-1].sent_s:
            self.touches[-1].sent_s = now_s
        return sent

    def drawn(self, now_s: float) -> None:
        """Note that a picture is complete."""
        if self.touches and self.touches[-1].taken_s and self.touches[-1].shown_s is None:
            self.touches[-1].shown_s = now_s

    def _shape(self) -> tuple[object, ...]:
        game = self.game.game
        return (game.piece.x, game.piece.turn, game.pieces_placed) if game else ()

    def _scripted(self, gestures: Sequence[str], rng: np.random.Generator) -> Iterator[float]:
        """Move the mouse, and yield when to go on."""
        side = "left"
        for gesture in gestures:
            begin_s = self._now_s
            x, y = SIDES[side] if gesture in ("press", "ghost") else (2.0, 2.0)
            side = {"left": "right", "right": "left"}[side]
            angle, way = rng.uniform(0.0, 2 * np.pi), np.radians(TURN_DEG)
            self.touches.append(Touch(gesture))
            if gesture == "twist":
                x, y = 2.0 + RIM * np.cos(angle), 2.0 + RIM * np.sin(angle)
            self.touch.press(x, y, begin_s, pinch=gesture == "pinch")
            while (held_s := self._now_s - begin_s) < DWELL_S[gesture]:
                if gesture == "twist":
                    turned = angle + way * min(1.0, held_s / (0.9 * DWELL_S["twist"]))
                    self.touch.move(2.0 + RIM * np.cos(turned), 2.0 + RIM * np.sin(turned))
                yield 0.01
            self.touch.release()
            yield begin_s + EVERY_S + rng.uniform(0.0, 1 / 40)


@dataclass(slots=True)
class Spans:
    """Time of each hop of the answered touches of a gesture, ms."""

    touches: int = 0
    hops: dict[str, list[float]] = field(default_factory=lambda: {hop: [] for hop in HOPS})


def measure(gestures: Sequence[str], seed: int, options: Sequence[str]) -> dict[str, Spans]:
    """Return the hops of each gesture."""
    surface = window_loop.window(headless=True)
    pygame.event.clear()  # the end of a measurement before this one
    orb = VirtualOrbProcess(seed, options)
    receiver = Receiver(orb.open, token=orb.token)
    target = Clicking(seed, gestures, receiver)
    began_s: list[float] = []

    def clock() -> float:
        began_s.append(time.monotonic())
        return began_s[-1]

    def drawn() -> None:
        target.drawn(time.monotonic() - began_s[0])
        if target.done:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    receiver.start()
    try:
        window_loop.play(target, receiver, surface, drawn=drawn, clock=clock)
    finally:
        receiver.close()
        orb.close()
    return _spans(target.touches)


def _spans(touches: Sequence[Touch]) -> dict[str, Spans]:
    found: dict[str, Spans] = {}
    for one in touches:
        spans = found.setdefault(one.gesture, Spans())
        spans.touches += 1
        if one.taken_s is None or one.decided_s is None or one.shown_s is None:
            continue
        times = one.sent_s, one.decided_s, one.taken_s, one.shown_s
        for hop, first, last in zip(HOPS, (0, 1, 2, 0), (1, 2, 3, 3), strict=True):
            spans.hops[hop].append(1e3 * (times[last] - times[first]))
    return found


def main() -> None:
    """Print median and p99 of each hop, for each gesture."""
    parser = command_line(__doc__, touches=200, seed=920_001, bundle=Path())
    arguments = parser.parse_args()
    options = [] if arguments.bundle == Path() else ["--bundle", str(arguments.bundle)]
    few = max(1, arguments.touches // 4)
    gestures = ["press"] * arguments.touches + ["pinch"] * few + ["twist"] * few
    results = Results("touch_to_pixel")
    found = measure(gestures, arguments.seed, options)
    found |= measure(["ghost"] * arguments.touches, arguments.seed, options)
    for gesture, spans in found.items():
        answered = len(spans.hops["total"])
        results.note(f"{gesture}_answered", answered / spans.touches, "1")
        for hop, times in spans.hops.items():
            for share in (50.0, 99.0) if times else ():
                goal = GOALS.get(gesture) if (hop, share) == ("total", 50.0) else None
                value = float(np.percentile(times, share))
                results.note(f"{gesture}_{hop}_p{share:g}_ms", value, "ms", goal=goal)
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
