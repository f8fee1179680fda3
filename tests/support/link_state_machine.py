"""The bad wire as a hypothesis state machine: anything, at any moment, in any order."""

from __future__ import annotations

from collections import Counter
from typing import ClassVar

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from controller.shared.protocol.messages import (
    Bye,
    ContactState,
    Heartbeat,
    Hello,
    Message,
    NumberedCommand,
    State,
)
from controller.shared.protocol.packets import encode
from tests.support.fake_device import welcome
from tests.support.link_simulator import CHANGES, Wire, World

DIRECTIONS = st.sampled_from(("to_host", "to_device"))
PAUSES = st.integers(0, 200)
SHORTEST = 15  # bytes of a frame: fewer cannot be forged into one
FORGED = (
    Hello(2, 2, "", "host", False), welcome(), Bye("closed"), Heartbeat(9, 9, 9, 0, ("down",)),
    NumberedCommand("drop", "pinch", 0.9, None, 1, 1, 0, 0), State(("down",)),
    ContactState(1, fingers=1),
)  # fmt: skip


class BadWire(RuleBasedStateMachine):
    """What can happen between an orb and its host."""

    total: ClassVar[Counter[str]] = Counter()  # what has happened in all examples together
    oldest_ms: ClassVar[int] = 0

    def __init__(self) -> None:
        super().__init__()
        self.world = World(serial=False, keyed=False, device_ms=0)

    @initialize(
        serial=st.booleans(),
        keyed=st.booleans(),
        device_ms=st.sampled_from((0, 1_000_000, 2**32 - 2_000, 2**32 + 5)),
    )
    def begin(self, serial: bool, keyed: bool, device_ms: int) -> None:
        self.world = World(serial=serial, keyed=keyed, device_ms=device_ms)
        self.world.wait(100)

    @rule(pass_ms=st.integers(1, 500))
    def wait(self, pass_ms: int) -> None:
        self.step("waits")
        self.world.wait(pass_ms)

    @rule(count=st.integers(1, 3), pause_ms=PAUSES)
    def command(self, count: int, pause_ms: int) -> None:
        self.step("gestures")
        for _ in range(count):
            self.world.command()
            self.world.wait(pause_ms)

    @rule(pressed=st.sampled_from(((), ("down",), ("down", "left"))), pause_ms=PAUSES)
    def hold(self, pressed: tuple[str, ...], pause_ms: int) -> None:
        self.step("holds")
        self.world.hold(pressed)
        self.world.wait(pause_ms)

    @rule(pause_ms=PAUSES)
    def feel(self, pause_ms: int) -> None:
        self.step("frames")
        self.world.feel()
        self.world.wait(pause_ms)

    @rule(frames=st.integers(0, 5), gesture=st.booleans(), pause_ms=PAUSES)
    def touch(self, frames: int, gesture: bool, pause_ms: int) -> None:
        self.step("touches")
        self.world.touch(frames)
        if gesture:
            self.world.command()
        self.world.wait(pause_ms)

    @rule(for_ms=st.integers(1, 1500))
    def clog(self, for_ms: int) -> None:
        self.step("clogs")
        self.world.clog(for_ms)

    @rule(for_ms=st.integers(1, 3000), pause_ms=PAUSES)
    def hang(self, for_ms: int, pause_ms: int) -> None:
        self.step("hangs")
        self.world.hang(for_ms)
        self.world.wait(pause_ms)

    @rule(direction=DIRECTIONS, for_ms=st.integers(1, 1500), pause_ms=PAUSES)
    def stall(self, direction: str, for_ms: int, pause_ms: int) -> None:
        self.step("stalls")
        wire: Wire = getattr(self.world, direction)
        wire.stall(self.world.now_ms + for_ms)
        self.world.wait(pause_ms)

    @rule(direction=DIRECTIONS, how=st.sampled_from(CHANGES), at=st.integers(0, 10_000))
    def change(self, direction: str, how: str, at: int) -> None:
        self.step("changes")
        self.world.wait(1)  # something is to be on its way
        self.world.change(getattr(self.world, direction), how, at)

    @rule(direction=DIRECTIONS, how=st.sampled_from(CHANGES), at=st.integers(0, 10_000))
    def change_a_command(self, direction: str, how: str, at: int) -> None:
        self.step("changes of commands")
        self.world.command()
        self.change(direction, how, at)

    @rule(direction=DIRECTIONS, noise=st.binary(max_size=255))
    def disturb(self, direction: str, noise: bytes) -> None:
        self.step("noises")
        data = noise if self.world.keyed else noise[: SHORTEST - 1]
        getattr(self.world, direction).put(data, self.world.now_ms)

    @rule(direction=DIRECTIONS, message=st.sampled_from(FORGED), number=st.integers(0, 999))
    def forge(self, direction: str, message: Message, number: int) -> None:
        self.step("forgeries")
        if self.world.keyed:  # without a key the link believes all that is well-formed
            data = encode(message, session=number % 8, sequence=number, t_ms=number)
            getattr(self.world, direction).put(data, self.world.now_ms)

    @rule(
        kind=st.sampled_from(("cut", "cut", "cut", "device", "host", "end")),
        host_knows=st.booleans(),
        device_knows=st.booleans(),
        for_ms=st.integers(0, 3000),
        pause_ms=PAUSES,
    )
    def end(
        self, kind: str, host_knows: bool, device_knows: bool, for_ms: int, pause_ms: int
    ) -> None:
        self.step("ends")
        if kind == "cut":
            self.world.cut(for_ms, host_knows=host_knows, device_knows=device_knows)
        elif kind == "device":
            self.world.restart_device()
        elif kind == "host":
            self.world.restart_host()
        else:
            self.world.end_host()
        self.world.wait(pause_ms)

    def step(self, name: str) -> None:
        type(self).total["step " + name] += 1

    def teardown(self) -> None:
        self.world.settle()
        total = type(self).total
        total.update(self.world.happened)
        total["virtual seconds"] += self.world.now_ms // 1000
        type(self).oldest_ms = max(type(self).oldest_ms, self.world.oldest_ms)
