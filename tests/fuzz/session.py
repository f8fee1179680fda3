"""The session, both ends: a wire that does anything, and peers that say anything at any time.

Each input is a story: bytes and packets of our own or of nobody, cut, lost, doubled and mixed up,
while the clock runs. As long as every packet on the wire was said by one of the two sides, a
command reaches the host at most once, in order, and only if the device gave it; with a key, however
much is forged and played again.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Final

from controller.protocol.device_session import BACKLOG, GRANTED_BACKLOG, DeviceSession
from controller.protocol.host_session import HostSession
from controller.protocol.link_events import Delivered, Missed, Received
from controller.protocol.messages import (
    Bye,
    Command,
    Contacts,
    Grant,
    GroundTruth,
    Message,
    Perform,
    State,
    Telemetry,
    Welcome,
)
from controller.protocol.packets import MAX_FRAME, encode
from controller.protocol.retransmit import RetransmitQueue, SessionHistory

from .choices import Choices
from .decoder import MESSAGES

STATES: Final = ("greeting", "joining", "live", "stale", "over")
DICTIONARY: tuple[bytes, ...] = ()
_WELCOME: Final = next(message for message in MESSAGES if isinstance(message, Welcome))
_KEPT: Final = 4 * MAX_FRAME  # bytes that a session remembers, what is to be sent left out
_SHORTEST: Final = 15  # bytes of a frame: fewer cannot be forged into one
_KEY: Final = b"a key that both sides know"


class Story:
    """Two sessions, and the wire between them.

    Attributes:
        honest: Whether nothing on the wire can count but what one of the two said.
        given: Commands that the device gave; their frames count from 1.
        taken: Frame of the newest command that the host took.
        missed: Commands of which the host was told that they are lost.
    """

    def __init__(self, keyed: bool) -> None:
        self.honest = True
        self._key = _KEY if keyed else b""
        self._now_ms = 1000
        self._drawn = 0  # nonces
        self._boots = 0
        self._outbox = RetransmitQueue()
        self._welcome = _WELCOME
        self._device = DeviceSession(
            self._welcome, key=self._key, outbox=self._outbox, draw=self._draw
        )
        self._past = SessionHistory(host_nonce=5)
        self._host = self._new_host(1, granted=False)
        self._lost = b""  # what was taken from the wire last, in either direction
        self.given = self.taken = self.missed = 0
        self._delivered = 0

    def step(self, choices: Choices) -> None:
        """Let the next thing happen."""
        what = choices.number() % len(_HAPPENINGS)
        _HAPPENINGS[what](self, choices)
        assert self._host.state in STATES
        assert len(self._device.output) <= max(BACKLOG, GRANTED_BACKLOG) + MAX_FRAME + 1
        for session in (self._host, self._device):
            assert _remembers(session) <= _KEPT

    def _draw(self, size: int) -> bytes:
        self._drawn += 1
        return self._drawn.to_bytes(size, "little")

    def _new_host(self, sequence: int, *, granted: bool) -> HostSession:
        return HostSession(
            *("the wire", sequence, self._now_ms),
            granted=granted,
            key=self._key,
            nonce=self._draw(16),
            past=self._past,
        )

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
        self.honest = self.honest and (bool(self._key) or len(data) < _SHORTEST)
        if host:
            self._hear(self._host.receive(data, self._now_ms))
        else:
            self._device.receive(data, self._now_ms)

    def _forged(self, choices: Choices) -> None:
        host, message = choices.number() % 2, choices.one_of(MESSAGES)
        session, sequence = choices.number(2), choices.number(2)
        data = encode(message, session=session, sequence=sequence, t_ms=choices.number(2))
        self.honest = self.honest and bool(self._key)
        if host:
            self._hear(self._host.receive(data, self._now_ms))
        else:
            self._device.receive(data, self._now_ms)

    def _device_says(self, choices: Choices) -> None:
        self._device.send(choices.one_of(_OF_DEVICE), self._now_ms, self._now_ms)

    def _command(self, choices: Choices) -> None:
        self.given += 1
        command = Command("drop", "pinch", 0.9, None, self.given)
        self._device.send(command, self._now_ms, self._now_ms)

    def _host_says(self, choices: Choices) -> None:
        self._host.send(choices.one_of(_OF_HOST), self._now_ms)

    def _reconnect(self, choices: Choices) -> None:
        sequence, granted = choices.number(2), bool(choices.number() % 2)
        self._host = self._new_host(sequence, granted=granted)

    def _new_line(self, choices: Choices) -> None:
        self._device = DeviceSession(
            self._welcome,
            key=self._key,
            number=self._device.number,
            outbox=self._outbox,
            draw=self._draw,
        )

    def _restart(self, choices: Choices) -> None:
        self._boots += 1
        self._outbox = RetransmitQueue()
        self._welcome = dataclasses.replace(_WELCOME, boot_nonce=1000 + self._boots)
        self._device = DeviceSession(
            self._welcome,
            key=self._key,
            number=self._device.number,
            outbox=self._outbox,
            draw=self._draw,
        )

    def _cut(self, choices: Choices) -> None:
        self._hear(self._host.cut("it was pulled"))
        self._device.end("it was pulled")

    # -- what must hold ----------------------------------------------------------------

    def _hear(self, news: list[Received]) -> None:
        for item in news:
            if isinstance(item, Delivered) and isinstance(item.message, Command) and self.honest:
                assert self.taken < item.message.frame <= self.given
                self.taken = item.message.frame
                self._delivered += 1
            elif isinstance(item, Missed) and self.honest:
                assert item.count > 0
                self.missed += item.count
        if self.honest:
            assert self._delivered + self.missed <= self.given


_HAPPENINGS: Final = (
    Story._wait, Story._to_host, Story._to_device, Story._command, Story._device_says,
    Story._host_says, Story._lose, Story._again_to_host, Story._again_to_device, Story._noise,
    Story._forged, Story._reconnect, Story._restart, Story._new_line, Story._cut,
)  # fmt: skip
_OF_HOST: Final = tuple(m for m in MESSAGES if isinstance(m, Contacts | Perform | Grant | Bye))
_OF_DEVICE: Final[tuple[Message, ...]] = (
    *(m for m in MESSAGES if isinstance(m, State | Telemetry | GroundTruth)),
    State(()),
)


def _does(happening: object, *numbers: int) -> bytes:
    """Return the bytes that choose one thing to happen."""
    return bytes([_HAPPENINGS.index(happening), *numbers])


ALL: Final = 255  # bytes of the wire
TO_HOST: Final = _does(Story._to_host, ALL)
TO_DEVICE: Final = _does(Story._to_device, ALL)
GREETING: Final = TO_DEVICE + TO_HOST + TO_DEVICE + TO_HOST
COMMAND: Final = _does(Story._command)
LOSE: Final = _does(Story._lose, 0, ALL)
ANEW: Final = _does(Story._cut) + _does(Story._reconnect, 5, 0, 0) + GREETING


def wait(ms: int) -> bytes:
    """Return the bytes that let time pass."""
    return _does(Story._wait, *ms.to_bytes(2, "little"))


def seeds() -> Iterable[bytes]:
    """Return stories to begin with, without a key and with one."""
    for keyed in (b"\0", b"\1"):
        begun = keyed + GREETING + TO_DEVICE
        # A command, and the same bytes again.
        yield begun + COMMAND + wait(100) + TO_HOST + _does(Story._again_to_host) + TO_DEVICE
        # A second one that is lost with the line, and sent again on the next.
        yield begun + COMMAND + TO_HOST + COMMAND + LOSE + wait(50) + ANEW + TO_DEVICE
        # One that is too old by then.
        yield begun + COMMAND + LOSE + wait(400) + ANEW + TO_DEVICE + wait(100) + TO_HOST
        # A packet of nobody, noise, and a device that starts anew.
        forged = _does(Story._forged, 1, 8, 1, 0, 9, 0, 0, 0)
        yield begun + forged + _does(Story._noise, 1, 3, 65, 0, 66) + _does(Story._restart) + ANEW


def one(data: bytes) -> None:
    """Tell the story that the bytes choose.

    Raises:
        AssertionError: A command was invented, doubled or out of order; or memory grew.
    """
    choices = Choices(data)
    story = Story(keyed=bool(choices.number() % 2))
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
