"""Quick touches over the real link: which are understood exactly once, by dwell and rate.

    python -m tests.benchmarks.tapping [--taps N] [--seeds N] [--bundle FILE] [--preset NAME]

A mouse clicks on the panel's own input code (`host.ui.pointer_input`), and fingers of different
depth, size and aim touch the dome; both reach a virtual orb through a real TCP link and the same
device that plays. Time is granted tick by tick, so that a run is the same on every machine. The
orbs' seeds belong to no training. A touch counts if exactly one command answers it, the right one:
presses alternate between two sides, or stay at one.

Latency is from the contact message that puts the finger down to the tick in which the command is
there. A dwell is the time from that message to the one that lifts the finger. The virtual finger
takes as long to rise as it took to sink, so it touches the skin for longer: `contact_s`.
"""

import itertools
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from controller.shared.event_metric import Answer, Event, attach
from controller.shared.protocol.messages import (
    Command,
    Contact,
    Contacts,
    Grant,
    Granted,
    Message,
)
from controller.simulator.hand.pointer import SINK_MM_S
from host.connection.receiver import Connected, Delivered, Lost, Received, Receiver, Refused
from host.connection.virtual_orb import VirtualOrbProcess
from host.demo.demo import until_ms
from host.ui.pointer_input import TWIST_RING_MM, DomeArea, PointerInput

from .results import Results, command_line, say

TICK_S: Final = 1 / 60
READY_S: Final = 2.5  # the rest image is found
ANSWER_S: Final = 20.0
SIDES: Final = {"left": (0.8, 2.7), "right": (3.2, 2.7)}
COMMANDS: Final = {"pinch": "drop", "twist_cw": "rotate_cw", "twist_ccw": "rotate_ccw"}
DWELLS_S: Final = (0.03, 0.06, 0.08, 0.10, 0.15, 0.25)
RATES_HZ: Final = (1, 2, 3, 4, 5)
LONGER_S: Final = {"pinch": (0.15, 0.25, 0.35), "twist": (0.25, 0.35, 0.5)}
TURN_DEG: Final = 75.0  # of a twist with the mouse
RIM: Final = 3.7  # grid units from the middle: outside of the taxels, on the dome
SEED: Final = 910_000


@dataclass(frozen=True, slots=True)
class Cell:
    """One kind of touch."""

    hand: str  # "mouse" or "finger"
    gesture: str  # "press", "pinch" or "twist"
    dwell_s: float
    rate_hz: float
    where: str = "middle"  # of presses: "alternating" or "same"


@dataclass(slots=True)
class Tally:
    """What became of the touches of a cell."""

    touches: int = 0
    once: int = 0  # exactly one answer, the right one
    twice: int = 0  # more than one answer
    wrong: int = 0  # one answer, another command
    strangers: int = 0  # answers that no touch asked for
    latencies_s: list[float] = field(default_factory=list)
    contacts_s: list[float] = field(default_factory=list)  # a finger on the skin, of each touch

    def add(self, other: "Tally") -> None:
        """Pool another orb's touches into these."""
        self.touches += other.touches
        self.once += other.once
        self.twice += other.twice
        self.wrong += other.wrong
        self.strangers += other.strangers
        self.latencies_s += other.latencies_s
        self.contacts_s += other.contacts_s


class Orb:
    """A virtual orb over TCP, whose time is granted tick by tick."""

    def __init__(self, seed: int, options: Sequence[str]) -> None:
        self._device = VirtualOrbProcess(seed, options)
        self._link = Receiver(self._device.open, token=self._device.token, granted=True)
        self._link.connect()
        self.tick = 0
        self.welcome = False
        self.commands: list[Answer] = []
        while self.now_s < READY_S:
            self.step(None)

    @property
    def now_s(self) -> float:
        """Granted time."""
        return until_ms(self.tick) / 1000

    def step(self, message: Message | None) -> None:
        """Send a message, grant a tick, and keep its commands."""
        if message is not None:
            self._link.send(message)
        self.tick += 1
        until = until_ms(self.tick)
        self._link.send(Grant(until))
        for item in self._answers(until):
            if isinstance(item, Delivered) and isinstance(item.message, Command):
                self.commands.append(Answer(until / 1000, item.message.name))

    def close(self) -> None:
        """End link and orb."""
        self._link.close()
        self._device.close()

    def _answers(self, until: int) -> Iterator[Received]:
        deadline = time.monotonic() + ANSWER_S
        while time.monotonic() < deadline:
            for item in self._link.poll():
                if isinstance(item, Lost | Refused):
                    raise RuntimeError(f"the virtual orb was lost: {item.reason}")
                self.welcome |= isinstance(item, Connected)
                if isinstance(item, Delivered) and isinstance(item.message, Granted):
                    if item.message.until_ms == until:
                        return
                    continue
                yield item
            self._link.wait(deadline - time.monotonic())
        raise RuntimeError("the virtual orb does not answer")


class Mouse:
    """A mouse on the panel, by the panel's own code."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._input = PointerInput(DomeArea())
        self._rng = rng
        self._turn = (0.0, 0.0)  # first angle and signed way, radians
        self._since_s = 0.0

    def down(self, cell: Cell, command: str, now_s: float) -> None:
        """Press the button of a touch."""
        self._since_s = now_s
        if cell.gesture == "twist":
            sign = -1.0 if command == "rotate_cw" else 1.0
            self._turn = self._rng.uniform(0.0, 2 * np.pi), sign * np.radians(TURN_DEG)
            self._input.press(*self._rim(0.0), now_s)
        else:
            x, y = SIDES.get(command, (2.0, 2.0))
            x, y = self._rng.normal((x, y), 0.2)
            self._input.press(x, y, now_s, pinch=cell.gesture == "pinch")

    def hold(self, cell: Cell, now_s: float) -> None:
        """Move while the button is down."""
        if cell.gesture == "twist":
            share = min(1.0, (now_s - self._since_s) / (0.9 * cell.dwell_s))
            self._input.move(*self._rim(share))

    def up(self) -> None:
        """Release the button."""
        self._input.release()

    def message(self, now_s: float) -> Contacts | None:
        """Return what the panel sends in this tick."""
        return self._input.update(now_s)

    def _rim(self, share: float) -> tuple[float, float]:
        angle = self._turn[0] + share * self._turn[1]
        return 2.0 + RIM * np.cos(angle), 2.0 + RIM * np.sin(angle)


class Fingers:
    """Fingers of somebody's hand; each has its own depth, size and aim."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._depth_mm, self._radius_mm = rng.uniform(6.5, 12.0), rng.uniform(6.0, 8.5)
        self._contacts: tuple[Contact, ...] = ()
        self._sent: tuple[Contact, ...] = ()
        self._middle, self._angle, self._way = (2.0, 2.0), 0.0, 0.0
        self._since_s = 0.0
        self._depths: list[float] = []

    def down(self, cell: Cell, command: str, now_s: float) -> None:
        """Put the fingers of a touch down."""
        rng = self._rng
        count = {"press": 1, "pinch": 2, "twist": 4}[cell.gesture]
        x, y = rng.normal(SIDES.get(command, (2.0, 2.0)), 0.2)
        self._middle, self._since_s = (float(x), float(y)), now_s
        usual = self._depth_mm if count == 1 else 0.75 * self._depth_mm
        self._depths = [float(usual * np.exp(rng.normal(0.0, 0.1))) for _ in range(count)]
        self._angle = rng.uniform(0.0, np.pi if cell.gesture == "pinch" else 2 * np.pi)
        sign = {"rotate_cw": -1.0, "rotate_ccw": 1.0}.get(command, 0.0)
        self._way = sign * np.radians(rng.uniform(45.0, 80.0))
        self.hold(cell, now_s)

    def hold(self, cell: Cell, now_s: float) -> None:
        """Move the fingers."""
        share = min(1.0, (now_s - self._since_s) / (0.8 * cell.dwell_s))
        if cell.gesture == "press":
            reach, angles = 0.0, [0.0]
        elif cell.gesture == "pinch":
            reach = 1.7 - 0.9 * min(1.0, (now_s - self._since_s) / 0.12)
            angles = [self._angle, self._angle + np.pi]
        else:
            reach = TWIST_RING_MM / 10.0
            turned = self._angle + share * self._way
            angles = [turned + np.radians(one) for one in (180.0, -30.0, 0.0, 30.0)]
        x, y = self._middle
        self._contacts = tuple(
            Contact(
                number, float(x + reach * np.cos(angle)), float(y + reach * np.sin(angle)),
                depth, self._radius_mm,
            )
            for number, (angle, depth) in enumerate(zip(angles, self._depths, strict=True))
        )  # fmt: skip

    def up(self) -> None:
        """Lift them."""
        self._contacts = ()

    def message(self, now_s: float) -> Contacts | None:
        """Return the contacts, if they changed."""
        if self._contacts == self._sent:
            return None
        self._sent = self._contacts
        return Contacts(self._contacts)


def cells() -> Iterator[Cell]:
    """Yield every kind of touch; a touch lasts at most four fifths of its time."""
    for hand in ("mouse", "finger"):
        for rate in RATES_HZ:
            for dwell in DWELLS_S:
                if dwell <= 0.8 / rate:
                    yield Cell(hand, "press", dwell, rate, "alternating")
                    yield Cell(hand, "press", dwell, rate, "same")
        for gesture, dwells in LONGER_S.items():
            for dwell, rate in itertools.product(dwells, (1, 2)):
                if dwell <= 0.8 / rate:
                    yield Cell(hand, gesture, dwell, rate)


def play(orb: Orb, cell: Cell, touches: int, rng: np.random.Generator) -> Tally:
    """Touch an orb, and count."""
    hand = Mouse(rng) if cell.hand == "mouse" else Fingers(rng)
    side = str(rng.choice(list(SIDES)))
    events: list[Event] = []
    contacts_s = []
    before = len(orb.commands)
    begin = orb.now_s + 0.5
    due = [begin + number / cell.rate_hz + rng.uniform(0.0, TICK_S) for number in range(touches)]
    for at in due:
        command = side if cell.gesture == "press" else COMMANDS.get(cell.gesture, "")
        if cell.gesture == "twist":
            command = str(rng.choice(["rotate_cw", "rotate_ccw"]))
        if cell.where == "alternating":
            side = "left" if side == "right" else "right"
        while orb.now_s + TICK_S / 2 < at:
            orb.step(hand.message(orb.now_s))
        hand.down(cell, command, orb.now_s)
        down, depth_mm = orb.now_s, 0.0
        while orb.now_s + TICK_S / 2 < down + cell.dwell_s:
            hand.hold(cell, orb.now_s)
            if (message := hand.message(orb.now_s)) is not None:
                depth_mm = max([depth_mm, *(one.depth_mm for one in message.contacts)])
            orb.step(message)
        hand.up()
        events.append(Event(down, orb.now_s, command))
        dwell_s = orb.now_s - down
        contacts_s.append(dwell_s + min(depth_mm / SINK_MM_S, dwell_s))
    end = orb.now_s + 1.0
    while orb.now_s < end:
        orb.step(hand.message(orb.now_s))
    tally = judged(events, orb.commands[before:])
    tally.contacts_s = contacts_s
    return tally


def judged(events: Sequence[Event], answers: Sequence[Answer]) -> Tally:
    """Return which touches were answered exactly once, and rightly."""
    owners = attach(events, answers)
    tally = Tally(touches=len(events), strangers=owners.count(-1))
    for number, event in enumerate(events):
        own = [a for a, owner in zip(answers, owners, strict=True) if owner == number]
        tally.twice += len(own) > 1
        tally.wrong += len(own) == 1 and own[0].kind != event.kind
        if len(own) == 1 and own[0].kind == event.kind:
            tally.once += 1
            tally.latencies_s.append(own[0].time_s - event.onset_s)
    return tally


def measure(
    preset: str, bundle: Path | None, touches: int, seeds: int, wanted: Sequence[Cell]
) -> dict[Cell, Tally]:
    """Return the tallies of one preset, by kind of touch."""
    found: dict[Cell, Tally] = {cell: Tally() for cell in wanted}
    options = ["--preset", preset, *(["--bundle", str(bundle)] if bundle else [])]
    for number in range(seeds):
        orb = Orb(SEED + number, options)
        try:
            for place, cell in enumerate(wanted):
                rng = np.random.default_rng([SEED, number, place])
                found[cell].add(play(orb, cell, touches, rng))
        finally:
            orb.close()
        say(f"{preset}: orb {number + 1} of {seeds}")
    return found


def main() -> None:
    """Print the share of touches understood exactly once, for each kind of touch."""
    parser = command_line(__doc__, taps=20, seeds=5, bundle=Path(), preset="")
    arguments = parser.parse_args()
    bundle = None if arguments.bundle == Path() else arguments.bundle
    results = Results("tapping")
    for preset in [arguments.preset] if arguments.preset else ["nominal", "paper-snr"]:
        found = measure(preset, bundle, arguments.taps, arguments.seeds, list(cells()))
        for cell, tally in found.items():
            name = f"{cell.hand}_{cell.gesture}_{cell.where}"
            name += f"_{cell.dwell_s * 1000:.0f}ms_{cell.rate_hz:g}hz"
            median = float(np.median(tally.latencies_s)) if tally.latencies_s else None
            results.note(
                name, tally.once / tally.touches, "1", preset=preset, touches=tally.touches,
                twice=tally.twice, wrong=tally.wrong, strangers=tally.strangers, latency_s=median,
                hand=cell.hand, gesture=cell.gesture, dwell_s=cell.dwell_s, rate_hz=cell.rate_hz,
                contact_s=round(float(np.mean(tally.contacts_s)), 3),
            )  # fmt: skip
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
