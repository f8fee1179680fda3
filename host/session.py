"""The host's side of the conversation in `controller.protocol`: bytes in, news out.

Sans-IO: time comes in as an argument, bytes to send gather in `output`. One HostSession is one
attempt on one open link; whatever ends it, the next attempt is a new one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from controller.protocol import (
    DEADMAN_MS,
    HEARTBEAT_MS,
    LOST_MS,
    SILENCE_MS,
    VERSION,
    Bye,
    Command,
    Decoder,
    Grant,
    Granted,
    Health,
    Heartbeat,
    Hello,
    Message,
    Packet,
    Refuse,
    State,
    Telemetry,
    Truth,
    Welcome,
    encode,
    is_ahead,
)


@dataclass(frozen=True, slots=True)
class Connected:
    """A device has welcomed us; everything before is over."""

    welcome: Welcome


@dataclass(frozen=True, slots=True)
class Delivered:
    """A message of the device, in order, each once."""

    message: Message  # Command, State, Telemetry, Truth, Granted or Health
    t_ms: int  # the device's time


@dataclass(frozen=True, slots=True)
class Stale:
    """Nothing has come for 300 ms: release everything and pause. The next message revives."""


@dataclass(frozen=True, slots=True)
class Lost:
    """The connection is over: release everything. The next one begins with Connected."""

    reason: str


@dataclass(frozen=True, slots=True)
class Refused:
    """There is no connection, and this is why, in one sentence; we keep trying."""

    reason: str


Received = Connected | Delivered | Stale | Lost | Refused
_NEWS = (Command, State, Telemetry, Truth, Granted, Health)


class HostSession:
    """Talks to one device over one open link.

    Attributes:
        state: "greeting" until Welcome, then "live" or "stale"; "over" after Lost or Refused.
        welcomed: Whether it ever was live.
        output: Bytes to send; the owner of the link takes them.
        late: Commands dropped because they came out of a stall.
        ignored: Valid packets that had no business here.
    """

    def __init__(
        self, name: str, sequence: int, now_ms: int, *, token: str = "", granted: bool = False
    ) -> None:
        """Say Hello.

        Args:
            name: What the user calls the link.
            sequence: Number of the first packet, best a random u16.
            now_ms: The clock, as in every method.
            token: What the device wants to hear.
            granted: Whether we shall own the device's clock.
        """
        self.state: Literal["greeting", "live", "stale", "over"] = "greeting"
        self.welcomed = False
        self.late = 0
        self.ignored = 0
        self._name, self._granted = name, granted
        self._decoder = Decoder()
        self._number = 0
        self._sequence = self._taken = sequence
        self._start_ms = self._heard_ms = self._beat_ms = now_ms
        self._echo_ms = 0
        self._deadman_ms = DEADMAN_MS
        self._owed = 0  # Grants that are not answered yet
        self._foreign = 0  # version of a peer that we do not understand
        self._mute = True  # the peer has said nothing at all
        hello = Hello(VERSION, VERSION, token, "host", granted)
        self.output = bytearray(b"\0")  # ends what an earlier host may have left half
        self.output += encode(hello, session=0, sequence=sequence, t_ms=0)

    @property
    def over(self) -> bool:
        """Whether this attempt has ended."""
        return self.state == "over"

    def receive(self, data: bytes, now_ms: int) -> list[Received]:
        """Return what these bytes tell."""
        news = self.tick(now_ms)  # what comes too late cannot undo that it was late
        self._mute = self._mute and not data
        if self.over:
            return news
        stalled = self.state == "stale"
        for packet in self._decoder.feed(data):
            if not self.welcomed:
                news += self._greeting(packet, now_ms)
            elif packet.session == self._number and is_ahead(packet.sequence, self._taken):
                news += self._take(packet, now_ms, stalled)
            else:
                self.ignored += 1
            if self.over:
                break
        return news

    def tick(self, now_ms: int) -> list[Received]:
        """Let time pass: heartbeats go out, and silence has its consequences."""
        silent_ms = now_ms - self._heard_ms
        if self.over:
            return []
        if self.state == "greeting":
            return self._over(Refused(self._no_answer())) if silent_ms >= SILENCE_MS else []
        if self._granted:
            if self._owed and silent_ms >= SILENCE_MS:
                return self._over(Lost(f"{self._name}: a grant was not answered within 2 s"))
            return []
        if now_ms - self._beat_ms >= HEARTBEAT_MS:
            self._beat_ms = now_ms
            self.send(Heartbeat(self._echo_ms), now_ms)
        if silent_ms >= LOST_MS:
            return self._over(Lost(f"{self._name}: nothing came for {LOST_MS / 1000:g} s"))
        if silent_ms >= self._deadman_ms and self.state == "live":
            self.state = "stale"
            return [Stale()]
        return []

    def wait_ms(self, now_ms: int) -> int:
        """Return how long `tick` can wait, if nothing comes."""
        if self.state == "greeting" or self._owed:
            return max(self._heard_ms + SILENCE_MS - now_ms, 0)
        if self._granted:
            return SILENCE_MS // 2  # a Grant may follow at any time
        due_ms = self._beat_ms + HEARTBEAT_MS
        if self.state == "live":
            due_ms = min(due_ms, self._heard_ms + self._deadman_ms)
        return max(due_ms - now_ms, 0)

    def send(self, message: Message, now_ms: int) -> bool:
        """Say something; return whether there is anybody to say it to.

        Raises:
            ProtocolError: The wire cannot carry it.
        """
        if self.state not in ("live", "stale"):
            return False
        sequence = (self._sequence + 1) & 0xFFFF
        t_ms = now_ms - self._start_ms
        self.output += encode(message, session=self._number, sequence=sequence, t_ms=t_ms)
        self._sequence = sequence
        if isinstance(message, Grant):
            if not self._owed:
                self._heard_ms = now_ms  # the 2 s begin now; before, silence was allowed
            self._owed += 1
        return True

    def _over(self, last: Lost | Refused) -> list[Received]:
        self.state = "over"
        return [last]

    def _greeting(self, packet: Packet, now_ms: int) -> list[Received]:
        """Take the answer to Hello; everything else is the rest of somebody's conversation."""
        message = packet.message
        if packet.sequence == self._taken:
            if isinstance(message, Refuse):
                return self._over(Refused(f"{self._name}: {message.reason}"))
            if isinstance(message, Welcome) and message.version == VERSION:
                self.state, self.welcomed = "live", True
                self._number, self._heard_ms = packet.session, now_ms
                self._deadman_ms = min(message.deadman_ms, LOST_MS)
                return [Connected(message)]
        if message is None:
            self._foreign = packet.version
        self.ignored += 1
        return []

    def _take(self, packet: Packet, now_ms: int, stalled: bool) -> list[Received]:
        """Take one packet of this session."""
        self._taken, self._heard_ms, self._echo_ms = packet.sequence, now_ms, packet.t_ms
        self.state = "live"
        message = packet.message
        if isinstance(message, Bye):
            return self._over(Lost(f"{self._name}: {message.reason}"))
        if isinstance(message, Command) and stalled:
            self.late += 1  # a late drop is worse than none
        elif isinstance(message, _NEWS):
            if isinstance(message, Granted) and self._owed:
                self._owed -= 1
            return [Delivered(message, packet.t_ms)]
        elif not isinstance(message, Heartbeat):
            self.ignored += 1
        return []

    def _no_answer(self) -> str:
        """Return what 2 s without Welcome tell about the other side."""
        if self._foreign:
            side = "host" if self._foreign > VERSION else "orb's controller"
            return (
                f"{self._name} speaks protocol version {self._foreign}, this host version "
                f"{VERSION}; update the {side}"
            )
        if not self._mute:
            return (
                f"{self._name} says something, but not what an OrbTouch says; "
                "name the orb's own port with --link"
            )
        return (
            f"opened {self._name}, but no OrbTouch answered within 2 s; switch the orb on, or name "
            "its own port with --link"
        )
