"""The session, both ends: a wire that does anything, and peers that say anything at any time.

Each input is a story: bytes and packets of our own or of nobody, cut, lost, doubled and mixed up,
while the clock runs. Where every packet on the wire was said by one of the two sides, a command
reaches the host at most once, in order, and only if the device gave it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from controller.protocol import (
    MAX_FRAME,
    Bye,
    Command,
    Contacts,
    Grant,
    Heartbeat,
    Message,
    Perform,
    State,
    Telemetry,
    Truth,
    Welcome,
    encode,
)
from controller.session import BACKLOG, GRANTED_BACKLOG, DeviceSession
from host.session import Delivered, HostSession, Received

from .choices import Choices
from .decoder import MESSAGES

STATES: Final = ("greeting", "live", "stale", "over")
DICTIONARY: tuple[bytes, ...] = ()
_WELCOME: Final = next(message for message in MESSAGES if isinstance(message, Welcome))
_KEPT: Final = 4 * MAX_FRAME  # bytes that a session remembers, what is to be sent left out


class Story:
    """Two sessions, and the wire between them.

    Attributes:
        honest: Whether everything on the wire was said by one of the two.
    """

    def __init__(self) -> None:
        self.honest = True
        self._now_ms = 1000
        self._device = DeviceSession(_WELCOME)
        self._host = HostSession("the wire", 1, self._now_ms)
        self._lost = b""  # what was taken from the wire last, in either direction
        self._given = 0  # frames of the commands that the device gave
        self._taken = 0  # frame of the newest command that the host took

    def step(self, choices: Choices) -> None:
        """Let the next thing happen."""
        what = choices.number() % len(_HAPPENINGS)
        _HAPPENINGS[what](self, choices)
        assert self._host.state in STATES
        assert len(self._device.output) <= max(BACKLOG, GRANTED_BACKLOG) + MAX_FRAME + 1
        for session in (self._host, self._device):
            assert _remembers(session) <= _KEPT

    # -- what can happen ---------------------------------------------------------------

    def _wait(self, choices: Choices) -> None:
        self._now_ms += choices.number(2) % 3000
        self._device.tick(self._now_ms)
        self._hear(self._host.tick(self._now_ms))
        assert self._host.wait_ms(self._now_ms) >= 0

    def _to_host(self, choices: Choices) -> None:
        self._lost = _cut(self._device.output, choices)
        self._hear(self._host.receive(self._lost, self._now_ms))

    def _to_device(self, choices: Choices) -> None:
        self._lost = _cut(self._host.output, choices)
        self._device.receive(self._lost, self._now_ms)

    def _lose(self, choices: Choices) -> None:
        output = choices.one_of((self._device.output, self._host.output))
        self._lost = _cut(output, choices)

    def _again_to_host(self, choices: Choices) -> None:
        self._hear(self._host.receive(self._lost, self._now_ms))

    def _again_to_device(self, choices: Choices) -> None:
        self._device.receive(self._lost, self._now_ms)

    def _noise(self, choices: Choices) -> None:
        host, data = choices.number() % 2, choices.octets(choices.number())
        if host:
            self._hear(self._host.receive(data, self._now_ms))
        else:
            self._device.receive(data, self._now_ms)

    def _forged(self, choices: Choices) -> None:
        host, message = choices.number() % 2, choices.one_of(MESSAGES)
        session, sequence = choices.number(2), choices.number(2)
        data = encode(message, session=session, sequence=sequence, t_ms=choices.number(2))
        self.honest = False
        if host:
            self._hear(self._host.receive(data, self._now_ms))
        else:
            self._device.receive(data, self._now_ms)

    def _device_says(self, choices: Choices) -> None:
        self._device.send(choices.one_of(_OF_DEVICE), self._now_ms, self._now_ms)

    def _command(self, choices: Choices) -> None:
        self._given += 1
        command = Command("drop", "pinch", 0.9, None, self._given)
        self._device.send(command, self._now_ms, self._now_ms)

    def _host_says(self, choices: Choices) -> None:
        self._host.send(choices.one_of(_OF_HOST), self._now_ms)

    def _reconnect(self, choices: Choices) -> None:
        sequence, granted = choices.number(2), bool(choices.number() % 2)
        self._host = HostSession("the wire", sequence, self._now_ms, granted=granted)

    def _restart(self, choices: Choices) -> None:
        self._device = DeviceSession(_WELCOME, number=choices.number(2))

    # -- what must hold ----------------------------------------------------------------

    def _hear(self, news: list[Received]) -> None:
        for item in news:
            if isinstance(item, Delivered) and isinstance(item.message, Command) and self.honest:
                assert self._taken < item.message.frame <= self._given
                self._taken = item.message.frame


_HAPPENINGS: Final = (
    Story._wait, Story._to_host, Story._to_device, Story._command, Story._device_says,
    Story._host_says, Story._lose, Story._again_to_host, Story._again_to_device, Story._noise,
    Story._forged, Story._reconnect, Story._restart,
)  # fmt: skip
_OF_HOST: Final = tuple(m for m in MESSAGES if isinstance(m, Contacts | Perform | Grant | Bye))
_OF_DEVICE: Final[tuple[Message, ...]] = (
    *(m for m in MESSAGES if isinstance(m, State | Telemetry | Truth | Heartbeat)),
    State(()),
)


def seeds() -> Iterable[bytes]:
    """Return inputs to begin with: a greeting, a command, a cut, a connection anew."""
    greeting = bytes([2, 255, 1, 255])
    yield greeting + bytes([3, 1, 255, 0, 100, 0, 3, 3, 1, 20, 7, 1, 255])
    yield greeting + bytes([5, 3, 2, 255, 0, 0, 2, 11, 5, 0, 0, 2, 255, 1, 255, 3, 1, 255])
    yield greeting + bytes([10, 1, 4, 8, 0, 2, 0, 0, 0, 9, 1, 3, 65, 66, 0, 12, 3, 0])


def one(data: bytes) -> None:
    """Tell the story that the bytes choose.

    Raises:
        AssertionError: A command was invented, doubled or out of order; or memory grew.
    """
    choices, story = Choices(data), Story()
    while choices.left:
        story.step(choices)


def _cut(output: bytearray, choices: Choices) -> bytes:
    """Take bytes from the front of what waits to be sent: all of it, or fewer."""
    count = choices.number()
    count = len(output) if count == 255 else count
    taken = bytes(output[:count])
    del output[:count]
    return taken


def _remembers(session: object) -> int:
    """Return how many bytes and things a session keeps, what is to be sent left out."""
    total, waiting = 0, [session]
    while waiting:
        for name, value in vars(waiting.pop()).items():
            if isinstance(value, bytes | bytearray | list | tuple | dict | set):
                total += 0 if name == "output" else len(value)
            elif type(value).__module__.startswith(("controller.", "host.")) and hasattr(
                value, "__dict__"
            ):
                waiting.append(value)
    return total
