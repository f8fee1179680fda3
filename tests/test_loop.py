"""The loop: frames at their times, whoever owns the clock."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from controller import bundle
from controller.loop import Device, Loop, steady, telemetry
from controller.pipeline import Pipeline
from controller.preprocess import Frame, Image, Window
from controller.protocol import (
    Bye,
    Command,
    Contact,
    Contacts,
    Grant,
    Granted,
    Hello,
    Message,
    Perform,
    State,
    Telemetry,
    Truth,
)
from controller.recordings import reader
from controller.recordings.recorder import Recorder
from controller.recordings.recording import Origin
from controller.sensors import Geometry, SensorError, VirtualSensor

SHIPPED = bundle.read(bundle.default_path())
HELLO = Hello(1, 1, "", "test", granted=False)
GRANTING = dataclasses.replace(HELLO, granted=True)
FINGER = Contacts((Contact(1, 0.0, 3.0, 8.0, 7.0),))


class World:
    """A clock that only waiting moves, and a host whose requests come at their times."""

    def __init__(self, *requests: tuple[float, Message]) -> None:
        self.now_s = 100.0
        self.start_s = self.now_s
        self.requests = sorted(requests, key=lambda request: request[0])
        self.sent: list[tuple[Message, int]] = []
        self.connected = True

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


class Slab:
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
        self.ended: list[Truth] = []
        self.closed = False

    def read(self, t_s: float) -> Frame:
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
        self.ended.append(Truth(number, label, round(t_s * 1000), round(t_s * 1000) + 500))

    def truths(self) -> list[Truth]:
        ended, self.ended = self.ended, []
        return ended

    def label(self, t_s: float) -> str:
        return "press" if self.touches and self.touches[-1][1] else "null"

    def close(self) -> None:
        self.closed = True


class Certain:
    """Networks that are sure of a press wherever something deviates."""

    def probabilities(self, window: Window) -> NDArray[np.float32]:
        pressed = float(np.abs(window[-1] - 1.0).max()) > 0.1
        return np.array([1 - pressed, pressed, 0, 0, 0], dtype=np.float32)

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
    ) -> None:
        self.world = World(*requests)
        self.sensors: list[Slab] = []
        self.busy_s = busy_s
        self.record = record
        self.loop = Loop(
            self.world, self.open, self.world.clock, await_host=await_host, orphan_s=orphan_s
        )

    def open(self) -> Device:
        sensor = Slab(self.world, busy_s=self.busy_s)
        self.sensors.append(sensor)
        pipeline = Pipeline(SHIPPED, Certain(), SHIPPED.mapping)
        recorder = None
        if self.record is not None:
            origin = Origin("x", 5, 5, 10.0, 10.0, SHIPPED.labels, SHIPPED.hash, "none", "0")
            recorder = Recorder(self.record, origin, pipeline.state())
        return Device(sensor, pipeline, self.world, steady(10.0), recorder=recorder)

    def run(self, seconds: float) -> "Bench":
        self.loop.run(self.world.after(seconds))
        return self

    def messages(self, *kinds: type[Message]) -> list[Message]:
        return [message for message, _ in self.world.sent if isinstance(message, kinds)]


def test_the_bench_s_sensor_is_a_virtual_sensor() -> None:
    assert isinstance(Slab(World()), VirtualSensor)


# --- paced by the clock ---------------------------------------------------------------------------


def test_frame_k_is_scanned_at_k_tenths_of_a_second_for_hours() -> None:
    bench = Bench(busy_s=0.03).run(3600.0)
    reads = bench.sensors[0].reads
    assert len(reads) == 36_000 - 1
    assert max(abs(clock - t_s) for t_s, clock in reads) < 1e-6  # never drifts
    assert bench.loop.missed == 0


def test_frames_whose_time_is_over_are_skipped_and_counted() -> None:
    bench = Bench().run(1.0)
    assert bench.loop.missed == 0
    slow = Bench(busy_s=0.25).run(10.0)
    reads = slow.sensors[0].reads
    assert 30 <= len(reads) <= 45
    assert slow.loop.missed >= 50
    assert all(clock - t_s < 0.1 + 1e-6 for t_s, clock in reads)  # none is older than a period
    frames = [m.frame for m in slow.messages(Telemetry) if isinstance(m, Telemetry)]
    assert [round(t_s * 10) for t_s, _ in reads] == frames  # numbers tell what was missed


def test_each_frame_is_told_with_its_time_and_the_measured_rate() -> None:
    bench = Bench().run(2.05)
    sent = [(m, t) for m, t in bench.world.sent if isinstance(m, Telemetry)]
    assert [t for _, t in sent] == [k * 100 for k in range(1, 21)]
    assert sent[-1][0].rate_hz == pytest.approx(10.0)
    assert len(sent[0][0].image) == 25
    assert not sent[0][0].ready
    assert sent[-1][0].ready


def test_a_touch_gives_one_command_and_is_held_until_it_is_lifted() -> None:
    bench = Bench((3.0, FINGER), (5.0, Contacts(()))).run(8.0)
    told = bench.messages(Command, State)
    assert [type(m) for m in told] == [Command, State, State]
    command, pressed, released = told
    assert isinstance(command, Command)
    assert (command.name, command.label, command.touch) == ("left", "press", (0.0, 3.0))
    assert (pressed, released) == (State(("left",)), State(()))
    assert bench.sensors[0].touches[0][0] == pytest.approx(3.0)  # at the time it was asked for


def test_a_host_that_comes_back_is_not_told_that_the_old_command_is_held() -> None:
    bench = Bench((3.0, FINGER), (5.0, HELLO)).run(8.0)
    assert len(bench.sensors) == 1  # the same session of sensing goes on
    assert bench.messages(Command, State)[1:] == [State(("left",))]


@pytest.mark.parametrize("change", [Bye("the host was silent for 2 s"), HELLO])
def test_fingers_of_a_host_leave_the_orb_with_it(change: Message) -> None:
    bench = Bench((3.0, FINGER), (4.0, change)).run(6.0)
    (_, finger), (lifted_s, none) = bench.sensors[0].touches
    assert (finger, none) == (FINGER.contacts, ())
    assert lifted_s == pytest.approx(4.0)


def test_a_performance_is_done_and_its_truth_reported() -> None:
    perform = Perform(7, "pinch", 2.0, 2.0)
    bench = Bench((2.0, perform), (3.0, dataclasses.replace(perform, label="juggle"))).run(4.0)
    ((t_s, label),) = bench.sensors[0].performances
    assert (round(t_s, 6), label) == (2.0, "pinch")
    assert bench.messages(Truth) == [Truth(7, "pinch", 2000, 2500)]


def test_a_virtual_orb_waits_for_its_host_and_ends_without_one() -> None:
    bench = Bench((4.0, HELLO), await_host=True, orphan_s=10.0)
    bench.run(6.0)
    assert bench.sensors[0].reads[0][1] == pytest.approx(4.1)
    alone = Bench(await_host=True, orphan_s=10.0)
    alone.world.connected = False
    alone.run(60.0)
    assert 10.0 < alone.world.now_s - alone.world.start_s < 10.6
    assert not alone.sensors


def test_the_end_closes_the_sensor_and_seals_the_recording(tmp_path: Path) -> None:
    path = tmp_path / "one.npz"
    bench = Bench((3.0, FINGER), (5.0, Contacts(())), record=path).run(6.05)
    assert bench.sensors[0].closed
    loaded = reader.load(path)
    assert loaded.t.tolist() == [k / 10 for k in range(1, 61)]
    assert [(c.command, c.frame) for c in loaded.commands] == [
        (m.name, m.frame) for m in bench.messages(Command) if isinstance(m, Command)
    ]
    assert loaded.label[10] == 0
    assert loaded.label[40] == 1


# --- granted by the host --------------------------------------------------------------------------


def granted(*requests: Message) -> Bench:
    """A session in which all requests are there at once."""
    bench = Bench(*((0.0, m) for m in (GRANTING, *requests)), await_host=True)
    return bench.run(1.0)


def test_granted_time_is_stepped_exactly_and_answered_after_everything_else() -> None:
    bench = granted(Grant(250), Grant(300), Grant(1000))
    kinds = [
        message.until_ms if isinstance(message, Granted) else message.frame
        for message, _ in bench.world.sent
        if isinstance(message, Granted | Telemetry)
    ]
    assert kinds == [1, 2, 250, 3, 300, *range(4, 11), 1000]
    last = bench.messages(Telemetry)[-1]
    assert isinstance(last, Telemetry)
    assert last.rate_hz == 10.0  # granted time has no jitter


def test_time_that_was_granted_already_is_answered_and_changes_nothing() -> None:
    bench = granted(Grant(500), Grant(200))
    assert bench.messages(Granted) == [Granted(500), Granted(500)]
    assert len(bench.messages(Telemetry)) == 5


def test_a_grant_that_reaches_far_is_answered_minute_by_minute() -> None:
    bench = granted(Grant(150_000), Grant(150_000), Grant(150_000))
    assert bench.messages(Granted) == [Granted(60_000), Granted(120_000), Granted(150_000)]
    assert len(bench.messages(Telemetry)) == 1500


def test_requests_between_grants_happen_at_the_granted_time() -> None:
    bench = granted(Grant(2050), FINGER, Perform(1, "pinch", 2.0, 2.0), Grant(3000))
    assert bench.sensors[0].touches[0][0] == 2.05
    assert bench.sensors[0].performances == [(2.05, "pinch")]
    (command,) = (m for m in bench.messages(Command) if isinstance(m, Command))
    assert command.name == "left"
    assert 21 <= command.frame <= 30


def test_a_new_session_of_granted_time_begins_at_nothing() -> None:
    bench = granted(Grant(700), GRANTING, Grant(300))
    assert [len(sensor.reads) for sensor in bench.sensors] == [7, 3]
    assert bench.sensors[0].closed
    assert bench.sensors[1].reads[0][0] == 0.1


def test_granted_time_and_paced_time_give_the_same_frames_and_commands() -> None:
    paced = Bench((3.01, FINGER), (5.01, Contacts(()))).run(7.0)
    steps = granted(Grant(3000), FINGER, Grant(5000), Contacts(()), Grant(6900))
    kinds = (Command, Telemetry)
    assert len(paced.messages(*kinds)) > 60
    for one, other in zip(paced.messages(*kinds), steps.messages(*kinds), strict=True):
        if isinstance(one, Telemetry) and isinstance(other, Telemetry):
            one = dataclasses.replace(one, rate_hz=other.rate_hz)
        assert one == other


# --- a recording ----------------------------------------------------------------------------------


def test_a_recording_keeps_its_times_loses_no_frame_and_ends() -> None:
    world = World()
    sensor = Slab(world, busy_s=0.15)  # even where frames come faster than they can be sent
    pipeline = Pipeline(SHIPPED, Certain(), SHIPPED.mapping)
    schedule = [(4, 2.5), (5, 2.6), (7, 2.8), (8, 5.0)]
    device = Device(sensor, pipeline, world, iter(schedule), live=False)
    Loop(world, lambda: device, world.clock).run(world.after(60.0))
    assert [t_s for t_s, _ in sensor.reads] == [2.5, 2.6, 2.8, 5.0]
    assert [round(clock, 3) for _, clock in sensor.reads] == [0.0, 0.15, 0.3, 2.5]
    assert [t_ms for m, t_ms in world.sent if isinstance(m, Telemetry)] == [2500, 2600, 2800, 5000]
    assert sensor.closed


# --- one frame ------------------------------------------------------------------------------------


def test_telemetry_shows_what_the_membrane_feels_as_bytes() -> None:
    pipeline = Pipeline(SHIPPED, Certain(), SHIPPED.mapping)
    rest = np.full((5, 5), 40.0, dtype=np.float32)
    for k in range(20):
        pipeline.step(rest, k / 10)
    thin = rest.copy()
    thin[0, 4] *= 0.5  # the upper right taxel
    told = telemetry(pipeline.step(thin, 2.0), 10.0)
    assert told.image[4] == 28  # 128 + (0.5 - 1) * 200
    assert set(told.image[:4]) == {128}
    assert told.probabilities == (0.0, 1.0, 0.0, 0.0, 0.0)
    assert told.touch == (4.0, 4.0)
