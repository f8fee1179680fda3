"""The loop: frames at their times, whoever owns the clock."""

import dataclasses

import numpy as np
import pytest

from controller.recognition.contact import ContactEstimate
from controller.recognition.images.frames import Frame
from controller.recognition.pipeline import Pipeline, Step
from controller.runtime.device import Device, telemetry
from controller.runtime.loop import Loop
from controller.shared.protocol.messages import (
    Bye,
    Command,
    Contacts,
    ContactState,
    Grant,
    Granted,
    GroundTruth,
    Health,
    Message,
    Perform,
    State,
    Telemetry,
)
from tests.support.loop_bench import FINGER, GRANTING, HELLO, SHIPPED, Bench, Certain, Slab, World


@pytest.mark.slow
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


class Measuring(Pipeline):
    """A pipeline that estimates the same contact wherever something deviates."""

    def step(self, frame: Frame, t_s: float, number: int | None = None) -> Step:
        step = super().step(frame, t_s, number)
        contact = ContactEstimate(0.1, 2.9, 0.05, 8.1, 0.4, 1, 0.98, 0.0, 0.0, 0.2, 0.3)
        touched = step.ready and not step.quiet
        return dataclasses.replace(step, contact=contact if touched else None)


def test_a_contact_is_sent_first_in_each_of_its_frames_and_once_when_it_has_ended() -> None:
    bench = Bench((3.0, FINGER), (3.3, Contacts(())), pipeline=Measuring).run(5.0)
    contact = ContactState(30, 0.1, 2.9, 0.05, 8.1, 0.4, 1, 0.98, 0.0, 0.0, 0.2, 0.3)
    sent = [(m, t) for m, t in bench.world.sent if isinstance(m, ContactState)]
    assert sent == [
        (contact, 3000),
        (dataclasses.replace(contact, frame=31), 3100),
        (dataclasses.replace(contact, frame=32), 3200),
        (ContactState(32), 3300),  # no fingers
    ]
    of_frame_30 = [type(m) for m, t in bench.world.sent if t == 3000]
    assert of_frame_30[0] is ContactState
    assert of_frame_30[-1] is Telemetry


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
    assert bench.messages(GroundTruth) == [GroundTruth(7, "pinch", 2000, 2500)]


def test_a_virtual_orb_waits_for_its_host_and_ends_without_one() -> None:
    bench = Bench((4.0, HELLO), await_host=True, orphan_s=10.0)
    bench.run(6.0)
    assert bench.sensors[0].reads[0][1] == pytest.approx(4.1)
    alone = Bench(await_host=True, orphan_s=10.0)
    alone.world.connected = False
    alone.run(60.0)
    assert 10.0 < alone.world.now_s - alone.world.start_s < 10.6
    assert not alone.sensors


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


@pytest.mark.parametrize(
    ("grants", "answers", "frames"),
    [
        ([500, 200], [500, 500], 5),  # what was granted already changes nothing
        ([150_000] * 3, [60_000, 120_000, 150_000], 1500),  # minute by minute
    ],
)
def test_every_grant_is_answered(grants: list[int], answers: list[int], frames: int) -> None:
    bench = granted(*map(Grant, grants))
    assert bench.messages(Granted) == list(map(Granted, answers))
    assert len(bench.messages(Telemetry)) == frames


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


def test_a_recording_keeps_its_times_loses_no_frame_and_ends() -> None:
    world = World()
    sensor = Slab(world, busy_s=0.15)  # even where frames come faster than they can be sent
    pipeline = Pipeline(SHIPPED.settings, Certain(), SHIPPED.mapping)
    schedule = [(4, 2.5), (5, 2.6), (7, 2.8), (8, 5.0)]
    device = Device(sensor, pipeline, world, schedule=iter(schedule))
    Loop(world, lambda: device, world.clock).run(world.after(60.0))
    assert [t_s for t_s, _ in sensor.reads] == [2.5, 2.6, 2.8, 5.0]
    assert [round(clock, 3) for _, clock in sensor.reads] == [0.0, 0.15, 0.3, 2.5]
    assert [t_ms for m, t_ms in world.sent if isinstance(m, Telemetry)] == [2500, 2600, 2800, 5000]
    assert sensor.closed


def test_telemetry_shows_what_the_membrane_feels_as_bytes() -> None:
    pipeline = Pipeline(SHIPPED.settings, Certain(), SHIPPED.mapping)
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


def test_what_is_wrong_with_the_sensor_is_told_once_and_to_every_new_host() -> None:
    bench = Bench((0.0, HELLO), (8.0, HELLO))
    read = Slab.read

    def cut(slab: Slab, t_s: float) -> Frame:
        """A row's lead is off after three seconds."""
        frame = read(slab, t_s)
        if t_s > 3.0:
            frame[1] = 0.5
        return frame

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Slab, "read", cut)
        bench.run(10.0)
    told = bench.messages(Health)
    assert told == [Health(("row 1: no signal, play goes on without; fasten the lead",))] * 2
