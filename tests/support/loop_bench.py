"""A bench for the loop: a clock that only waiting moves, a sensor, a host, certain networks."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controller.bundles import bundle
from controller.capture.labels import Labeller
from controller.capture.session_recorder import SessionRecorder
from controller.links.base import Link
from controller.recognition.images.frames import Frame, Image, Window
from controller.recognition.pipeline import Networks, Pipeline
from controller.recordings.recorder import Recorder
from controller.recordings.recording import Provenance
from controller.runtime.device import Device, TimedPerform, VirtualHand
from controller.runtime.loop import Loop
from controller.sensors.base import Sensor
from controller.sensors.geometry import Geometry, SensorError
from controller.shared.cues import Cue, CueSession, Phase
from controller.shared.protocol.messages import (
    Contact,
    Contacts,
    GroundTruth,
    Hello,
    Message,
    Perform,
)

SHIPPED = bundle.read(bundle.default_path(10.0))
HELLO = Hello(2, 2, "", "test", granted=False)
GRANTING = dataclasses.replace(HELLO, granted=True)
FINGER = Contacts((Contact(1, 0.0, 3.0, 8.0, 7.0),))


class MessageLog(Link):
    """A link that keeps what is sent, and has no requests."""

    dropped = 0
    connected = True

    def __init__(self) -> None:
        self.sent: list[Message] = []

    def send(self, message: Message, t_ms: int) -> None:
        self.sent.append(message)

    def wait(self, timeout_s: float) -> None:
        raise AssertionError("nothing waits for this link")

    def close(self) -> None:
        """Nothing is open."""


class World(Link):
    """A clock that only waiting moves, and a host whose requests come at their times."""

    dropped = 0
    connected = True

    def __init__(self, *requests: tuple[float, Message]) -> None:
        self.now_s = 100.0
        self.start_s = self.now_s
        self.requests = sorted(requests, key=lambda request: request[0])
        self.sent: list[tuple[Message, int]] = []

    def close(self) -> None:
        """Nothing is open."""

    def clock(self) -> float:
        return self.now_s

    def send(self, message: Message, t_ms: int) -> None:
        self.sent.append((message, t_ms))

    def poll(self) -> list[Message]:
        due = [m for t, m in self.requests if t <= self.now_s - self.start_s + 1e-9]
        self.requests = self.requests[len(due) :]
        return due

    def wait(self, timeout_s: float) -> None:
        until = self.now_s + timeout_s + 1e-9  # waiting is never quite exact
        if self.requests:
            until = min(until, self.start_s + self.requests[0][0] + 1e-9)
        self.now_s = max(self.now_s, until)

    def after(self, seconds: float) -> Callable[[], bool]:
        return lambda: self.now_s - self.start_s >= seconds - 1e-9


class Slab(Sensor):
    """A sensor that a finger makes thinner where it lies; nothing else happens."""

    virtual = True
    geometry = Geometry(5, 5, 10.0)
    device_id = "virtual-slab"

    def __init__(self, world: World, rate_hz: float = 10.0, busy_s: float = 0.0) -> None:
        self.world = world
        self.rate_hz = rate_hz
        self.busy_s = busy_s  # how long a scan takes
        self.reads: list[tuple[float, float]] = []  # (asked for, the clock)
        self.touches: list[tuple[float, tuple[Contact, ...]]] = []
        self.performances: list[tuple[float, str]] = []
        self.ended: list[GroundTruth] = []
        self.closed = False
        self.lost_s = float("inf")  # when it is unplugged

    def read(self, t_s: float) -> Frame:
        if t_s >= self.lost_s:
            raise SensorError("the slab was unplugged; plug it in again")
        self.reads.append((t_s, self.world.now_s - self.world.start_s))
        self.world.now_s += self.busy_s
        frame = np.full((5, 5), 40.0, dtype=np.float32)
        for contact in self.touches[-1][1] if self.touches else ():
            frame[4 - round(contact.y), round(contact.x)] *= 0.4
        return frame

    def touch(self, contacts: Sequence[Contact], t_s: float) -> None:
        self.touches.append((t_s, tuple(contacts)))

    def perform(self, number: int, label: str, x: float, y: float, t_s: float) -> None:
        if label == "juggle":
            raise SensorError("the hand cannot juggle")
        self.performances.append((t_s, label))
        self.ended.append(GroundTruth(number, label, round(t_s * 1000), round(t_s * 1000) + 500))

    def truths(self) -> list[GroundTruth]:
        ended, self.ended = self.ended, []
        return ended

    def label(self, t_s: float) -> str:
        return "press" if self.touches and self.touches[-1][1] else "null"

    def button(self, t_s: float) -> str:
        return self.label(t_s)

    def close(self) -> None:
        self.closed = True


class Certain(Networks):
    """Networks that are sure of one gesture wherever something deviates."""

    def __init__(self, label: str = "press") -> None:
        self.label = SHIPPED.labels.index(label)

    def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
        touched = float(np.abs(window[-1] - 1.0).max()) > 0.1
        probabilities = np.zeros(len(SHIPPED.labels), dtype=np.float32)
        probabilities[self.label if touched else 0] = 1.0
        return probabilities

    def touch(self, image: Image) -> tuple[float, float]:
        row, column = np.unravel_index(np.abs(image - 1.0).argmax(), image.shape)
        return float(column), float(4 - row)


class Bench:
    """A loop on a bench: the world, and every sensor that was opened."""

    def __init__(
        self,
        *requests: tuple[float, Message],
        busy_s: float = 0.0,
        await_host: bool = False,
        orphan_s: float | None = None,
        record: Path | None = None,
        cues: CueSession | None = None,
        lost_s: float = float("inf"),
        pipeline: type[Pipeline] = Pipeline,
    ) -> None:
        self.world = World(*requests)
        self.sensors: list[Slab] = []
        self.busy_s, self.lost_s = busy_s, lost_s
        self.record, self.cues, self.pipeline = record, cues, pipeline
        self.loop = Loop(
            self.world, self.open, self.world.clock, await_host=await_host, orphan_s=orphan_s
        )

    def open(self) -> Device:
        sensor = Slab(self.world, busy_s=self.busy_s)
        sensor.lost_s = self.lost_s
        self.sensors.append(sensor)
        pipeline = self.pipeline(SHIPPED.settings, Certain(), SHIPPED.mapping)
        hand = None if self.cues is None else VirtualHand(respond=obey)
        device = Device(sensor, pipeline, self.world, hand=hand)
        if self.record is not None:
            device.recorder = self.tape(self.record, pipeline)
        return device

    def tape(self, path: Path, pipeline: Pipeline) -> SessionRecorder:
        origin = Provenance("x", 5, 5, 10.0, 10.0, SHIPPED.labels, SHIPPED.hash, "none", "0")

        labeller = Labeller(SHIPPED.labels, cues=self.cues)
        return SessionRecorder(lambda state: Recorder(path, origin, state), pipeline, labeller)

    def run(self, seconds: float) -> "Bench":
        self.loop.run(self.world.after(seconds))
        return self

    def messages(self, *kinds: type[Message]) -> list[Message]:
        return [message for message, _ in self.world.sent if isinstance(message, kinds)]


def obey(cue: Cue, t_s: float) -> TimedPerform | None:
    """Do at once what the cue says."""
    return (t_s, Perform(1, cue.label, 2.0, 2.0)) if cue.phase is Phase.GO else None
