"""A day of play on a virtual clock: nothing grows, and every event of the hand is accounted for.

    python -m tests.benchmarks.day [--hours N] [--preset NAME] [--seed N] [--json]

The device's own loop, pipeline and networks take 3,456,000 frames of one orb that drifts all day
while a hand plays on it, hour after hour; some hours have a fault, and the host goes away and comes
back. What became of each of the hand's events is asked stage by stage, from the skin to the host,
and the first stage that lost it has it on its account. The orb and the hand live in a process of
their own, so that the memory measured is the device's.
"""

import gc
import multiprocessing
import os
import time
from collections import Counter
from multiprocessing.connection import Connection
from typing import Any, Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from controller.bundles import bundle as bundles
from controller.bundles.inference.networks import Recognizer
from controller.links.base import Link
from controller.recognition.images.frames import Frame
from controller.recognition.pipeline import Pipeline, Step
from controller.runtime.device import Device
from controller.runtime.loop import Loop
from controller.sensors.base import Sensor
from controller.sensors.geometry import Geometry
from controller.shared.event_metric import TAIL_S, Event
from controller.shared.protocol.messages import Bye, Command, Hello, Message
from controller.simulator.dome.faults import Fault
from controller.simulator.hand.gesture_file import shipped
from controller.simulator.hand.performance import GESTURES
from controller.simulator.hand.session_script import SessionScript
from controller.simulator.hand.user_style import draw_mood, draw_style
from controller.simulator.orb import PRESETS, OrbSimulator
from tests.support.processes import memory_mib

from .results import Results, command_line, row, say

RATE_HZ: Final = 40.0
HOUR: Final = 144_000  # frames
CHUNK: Final = 600  # frames that come from the orb's process at once
WARM: Final = 1  # hours before memory is compared
# What is broken in which hour of the day.
FAULTS: Final = {5: "dead:1,3", 9: "leaky:2,2", 13: "open_row:4", 17: "air_leak", 21: "mains"}
# Minutes of the day, (from, to), without a host.
AWAY: Final = ((125.0, 126.0), (300.0, 310.0), (601.5, 602.0), (1100.0, 1130.0))
HELLO: Final = Hello(1, 1, "", "day", granted=False)
STAGES: Final = ("hit", "rest", "skin", "network", "debounce", "mapping", "link")


def orb(seed: int, preset: str, hours: int, out: Connection) -> None:
    """Play all day, and send (frames of a chunk) and, after each hour, its true events."""
    model = PRESETS[preset]
    body, people, plays = np.random.SeedSequence([seed]).spawn(3)
    simulator = OrbSimulator(body, RATE_HZ, model=model)
    style = draw_style(np.random.default_rng(people))
    grid = (model.rows, model.columns, model.pitch_mm)
    repertoire, steps = shipped(), simulator.steps_per_frame
    for hour, play in enumerate(plays.spawn(hours)):
        fault = [Fault.parse(FAULTS[hour])] if hour in FAULTS else []
        simulator.electronics.switch(fault)
        rng = np.random.default_rng(play)
        hand = SessionScript(
            HOUR * steps, RATE_HZ * steps, grid, draw_mood(style, rng), (0.0, 0.0), repertoire, rng
        )
        hand.stream(GESTURES)
        for start in range(0, HOUR * steps, CHUNK * steps):
            piece = slice(start, start + CHUNK * steps)
            out.send(
                simulator.advance(hand.point[piece], hand.depth_mm[piece], hand.radius_mm[piece])
            )
        out.send(hand.events)
        simulator.electronics.switch(fault, on=False)
    out.close()


class Skin(Sensor):
    """The sensor: frames from the orb's process, in order."""

    device_id = "virtual-day"
    rate_hz = RATE_HZ

    def __init__(self, source: Connection, geometry: Geometry) -> None:
        self.geometry = geometry
        self.events: list[Event] = []
        self._source = source
        self._chunk: NDArray[np.float32] = np.empty((0, 0, 0), np.float32)
        self._at = 0
        self._read = 0

    def read(self, t_s: float) -> Frame:
        if self._at == len(self._chunk):
            self._chunk, self._at = self._source.recv(), 0
        frame: Frame = self._chunk[self._at]
        self._at += 1
        self._read += 1
        if self._read % HOUR == 0:
            self.events = self._source.recv()
        return frame


class World(Link):
    """The clock, and a host that goes away and comes back."""

    dropped = 0
    connected = False

    def __init__(self) -> None:
        self.now_s = 0.0
        self.received: set[int] = set()  # frames whose command the host has

    def clock(self) -> float:
        return self.now_s

    def wait(self, timeout_s: float) -> None:
        self.now_s += timeout_s + 1e-9

    def close(self) -> None:
        """Nothing is open."""

    def poll(self) -> list[Message]:
        """Return the host's coming and going."""
        there = not any(start <= self.now_s / 60 < end for start, end in AWAY)
        if there == self.connected:
            return []
        self.connected = there
        return [HELLO if there else Bye("the laptop was closed")]

    def send(self, message: Message, t_ms: int) -> None:
        """Take what the device says."""
        if self.connected and isinstance(message, Command):
            self.received.add(message.frame)


# What the stages said of one frame: its number, two flags, two labels (-1: none), a flag.
SEEN: Final = np.dtype("i8, ?, ?, i1, i1, ?")
SEEN.names = ("frame", "ready", "quiet", "best", "fired", "sent")


class Witness(Device):
    """A device that keeps what each stage said during the latest hour, in memory of one size."""

    def __init__(self, *parts: Any, **more: Any) -> None:
        super().__init__(*parts, **more)
        self.seen = np.zeros(HOUR, SEEN)

    def advance(self, rate_hz: float, late_s: float = 0.0) -> Step | None:
        """Take the frame that is due, and remember what the stages said."""
        step = super().advance(rate_hz, late_s)
        if step is not None:
            best = int(np.argmax(step.probabilities))
            fired = self.pipeline.labels.index(step.gesture) if step.gesture else -1
            said = (step.frame, step.ready, step.quiet, best, fired, step.command is not None)
            self.seen[step.frame % HOUR] = said
        return step


def stage(event: Event, start_s: float, end_s: float, device: Witness, world: World) -> str:
    """Return which stage lost an event, "hit" if none did."""
    first = int(np.ceil((start_s + event.onset_s) * RATE_HZ - 1e-6))
    last = int(np.floor(min(start_s + event.release_s + TAIL_S, end_s) * RATE_HZ + 1e-6))
    numbers = np.arange(first, last + 1)
    seen = device.seen[numbers % HOUR]
    seen = seen[seen["frame"] == numbers]
    kind = device.pipeline.labels.index(event.kind)
    fired = seen[seen["fired"] == kind]
    sent = fired["frame"][fired["sent"]]
    if any(n in world.received for n in sent.tolist()):
        return "hit"
    if sent.size:
        return "link"
    if fired.size:
        return "mapping"
    if (seen["best"] == kind).any():
        return "debounce"
    if not seen["ready"].all():
        return "rest"
    return "skin" if seen["quiet"].all() else "network"


def measure(seed: int, preset: str, hours: int) -> tuple[list[Counter[str]], list[float], float]:
    """Return stages by hour, memory after each hour, and the CPU seconds of the device."""
    shipped_bundle = bundles.read(bundles.default_path())
    here, there = multiprocessing.Pipe(duplex=False)
    worker = multiprocessing.get_context("spawn").Process(
        target=orb, args=(seed, preset, hours, there), daemon=True
    )
    worker.start()
    there.close()
    geometry = Geometry(shipped_bundle.rows, shipped_bundle.columns, shipped_bundle.pitch_mm)
    skin, world = Skin(here, geometry), World()
    pipeline = Pipeline(shipped_bundle.settings, Recognizer(shipped_bundle), shipped_bundle.mapping)
    device = Witness(skin, pipeline, world)
    loop = Loop(world, lambda: device, world.clock)
    tallies: list[Counter[str]] = []
    memory: list[float] = []
    begun = time.process_time()

    def stopped() -> bool:
        done = len(tallies)
        if device.now_s * RATE_HZ + 0.5 < (done + 1) * HOUR:
            return False
        start_s = done * HOUR / RATE_HZ
        ends = [start_s + event.onset_s for event in skin.events[1:]] + [start_s + 3600.0]
        tallies.append(
            Counter(
                stage(event, start_s, end_s, device, world)
                for event, end_s in zip(skin.events, ends, strict=True)
            )
        )
        world.received.clear()
        skin.events = []
        gc.collect()
        memory.append(memory_mib())
        say(f"hour {len(tallies)} of {hours}: {memory[-1]:.1f} MB")
        return len(tallies) == hours

    loop.run(stopped)
    worker.join()
    return tallies, memory, time.process_time() - begun


def main() -> None:
    parser = command_line(__doc__, hours=24, seed=1)
    parser.add_argument("--preset", default="nominal", choices=list(PRESETS))
    arguments = parser.parse_args()
    tallies, memory, cpu_s = measure(arguments.seed, arguments.preset, arguments.hours)
    print(f"{'hour':>4}  {'fault':12}" + "".join(f"{name:>10}" for name in STAGES) + f"{'MB':>9}")
    for hour, (tally, used) in enumerate(zip(tallies, memory, strict=True)):
        cells = "".join(f"{tally[name] or '':>10}" for name in STAGES)
        print(f"{hour:>4}  {FAULTS.get(hour, ''):12}{cells}{used:9.2f}")
    total = sum(tallies, Counter[str]())
    events = total.total()
    shares = "".join(f"{total[name] / events:>10.3%}" for name in STAGES)
    print(f"{'all':>4}  {f'{events} events':12}{shares}")
    assert sum(total[name] for name in STAGES) == events
    grown = max(memory[WARM:], default=memory[-1]) - memory[min(WARM, len(memory) - 1)]
    frames = arguments.hours * HOUR
    print(f"{frames} frames, {cpu_s / frames * 1e6:.0f} µs of CPU time each")
    results, preset = Results("day"), arguments.preset
    results.rows = [row(f"day_{name}", total[name] / events, preset=preset) for name in STAGES]
    results.note("day_memory_growth_mb", grown, "MB", preset=preset, goal=1.0)
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
