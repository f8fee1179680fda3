"""The host's side of the conversation in `controller.protocol.messages`: bytes in, news out.

Sans-IO: time comes in as an argument, bytes to send gather in `output`. One HostSession is one
attempt on one open link; whatever ends it, the next attempt is a new one, and `SessionHistory` is
what it knows of those before. Its states, and what leads from one to another, are the table
`controller.protocol.states.HOST`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from controller.protocol.auth import NONCE, FrameAuthenticator, seals
from controller.protocol.clock_sync import ClockSync, signed
from controller.protocol.link_events import Connected as Connected
from controller.protocol.link_events import Delivered as Delivered
from controller.protocol.link_events import Lost as Lost
from controller.protocol.link_events import Missed as Missed
from controller.protocol.link_events import Received as Received
from controller.protocol.link_events import Refused as Refused
from controller.protocol.link_events import Stale as Stale
from controller.protocol.messages import (
    DEADMAN_MS,
    HEARTBEAT_MS,
    LATE_MS,
    LOST_MS,
    SILENCE_MS,
    VERSION,
    Bye,
    Command,
    Grant,
    Granted,
    GroundTruth,
    Health,
    Heartbeat,
    Hello,
    HostHeartbeat,
    Join,
    LatencyReport,
    Message,
    NumberedCommand,
    Offer,
    PositionUncertainty,
    Refuse,
    State,
    Telemetry,
    UploadStatus,
    UserIdentified,
    Welcome,
)
from controller.protocol.packets import Decoder, Packet, encode, is_ahead
from controller.protocol.states import HOST, next_states

BACKOFF_S: Final = (0.25, 0.5, 1.0, 2.0)  # before the next attempt; the last one again and again
JITTER: Final = 0.25  # of a pause, more or less, so that many hosts do not knock in step
_NEXT: Final = next_states(HOST)


_NEWS = (
    State,
    Telemetry,
    GroundTruth,
    Granted,
    Health,
    UploadStatus,
    LatencyReport,
    UserIdentified,
    PositionUncertainty,
)
_FROM_DEVICE = (*_NEWS, NumberedCommand, Heartbeat, Bye)


@dataclass(slots=True)
class SessionHistory:
    """What a host knows of the sessions before, so that the next one goes on where they ended.

    Attributes:
        host_nonce: Drawn at the host's start, u32 and not 0.
        boot_nonce: Of the device that was there last; it draws another at each start.
        done: Number of the newest command of that device that was delivered, or missed.
        missed: How many were missed, since it was met first.
    """

    host_nonce: int = 1
    boot_nonce: int = 0
    done: int = 0
    missed: int = 0


def pause_s(failures: int, jitter: float) -> float:
    """Return how long to wait before the next attempt.

    Args:
        failures: Attempts that failed since the last connection.
        jitter: A random number from 0 to 1.
    """
    return BACKOFF_S[min(failures, len(BACKOFF_S) - 1)] * (1.0 + JITTER * (2.0 * jitter - 1.0))


class HostSession:
    """Talks to one device over one open link.

    Attributes:
        state: "greeting" until Offer, "joining" until Welcome, then "live" or "stale"; "over"
            after Lost or Refused, or when the owner has ended it.
        welcomed: Whether it ever was live.
        pressed: What is held, as far as we know; nothing after 300 ms of silence.
        output: Bytes to send; the owner of the link takes them.
        past: What the next session needs to know; kept up to date.
        echo: Round trip, and the offset of the device's link clock.
        late: Commands that came, but too late.
        ignored: Valid packets that had no business here.
    """

    def __init__(
        self,
        name: str,
        sequence: int,
        now_ms: int,
        *,
        token: str = "",
        granted: bool = False,
        key: bytes = b"",
        nonce: bytes = b"",
        past: SessionHistory | None = None,
    ) -> None:
        """Say Hello.

        Args:
            name: What the user calls the link.
            sequence: Number of the first packet, best a random u16.
            now_ms: The clock, as in every method.
            token: What the device wants to hear.
            granted: Whether we shall own the device's clock.
            key: What both sides know; b"": nothing.
            nonce: 16 random bytes, drawn for this session; b"" will do where there is neither a
                key nor a line that may double what is said.
            past: What sessions before this one have left; None: there was none.

        Raises:
            ValueError: There is a key, and no nonce.
        """
        if key and len(nonce) != NONCE:
            raise ValueError(f"a session with a key needs {NONCE} random bytes, not {len(nonce)}")
        self.state = _NEXT["over", "again"]
        self.welcomed = False
        self.late = 0
        self.ignored = 0
        self.past = SessionHistory() if past is None else past
        self.echo = ClockSync()
        self._name, self._token, self._granted = name, token, granted
        self._key, self._nonce = key, nonce.hex()
        self._decoder = Decoder()
        self._seal: FrameAuthenticator | None = None  # of what we send
        self._number = 0
        self._sequence = self._taken = sequence
        self._start_ms = self._heard_ms = self._beat_ms = now_ms
        self._joined_ms = now_ms  # when Join was sent
        self._skew_ms = 0  # from the device's link clock to the one that its messages carry
        self._pressed: tuple[str, ...] | None = None  # None: to be told anew
        self._owes = False  # a command came that is not acknowledged
        self._owed = 0  # Grants that are not answered yet
        self._foreign = 0  # version of a peer that we do not understand
        self._mute = True  # the peer has said nothing at all
        hello = Hello(VERSION, VERSION, self._nonce, "", False)
        self.output = bytearray(b"\0")  # ends what an earlier host may have left half
        self.output += encode(hello, session=0, sequence=sequence, t_ms=0)

    @property
    def over(self) -> bool:
        """Whether this attempt has ended."""
        return self.state == "over"

    @property
    def pressed(self) -> tuple[str, ...]:
        """What is held, as far as we know."""
        return self._pressed or ()

    @property
    def clock_offset_ms(self) -> int | None:
        """The device's time, as its messages carry it, minus ours; None: not known yet."""
        offset_ms = self.echo.offset_ms
        return None if offset_ms is None else signed(offset_ms + self._skew_ms)

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
            elif (
                packet.session == self._number
                and isinstance(packet.message, _FROM_DEVICE)
                and is_ahead(packet.sequence, self._taken)
            ):
                news += self._take(packet, now_ms, stalled)
            else:
                self.ignored += 1
            if self.over:
                break
        if self._owes and not self.over:
            self._owes = False
            self._beat(now_ms)
        return news

    def tick(self, now_ms: int) -> list[Received]:
        """Let time pass: heartbeats go out, and silence has its consequences."""
        silent_ms = now_ms - self._heard_ms
        if self.over:
            return []
        if self.state in ("greeting", "joining"):
            late = now_ms - self._start_ms >= SILENCE_MS
            return self._end("silence", Refused(self._no_answer())) if late else []
        if self._granted:
            if self._owed and silent_ms >= SILENCE_MS:
                return self._end("gone", Lost(f"{self._name}: a grant was not answered within 2 s"))
            return []
        if now_ms - self._beat_ms >= HEARTBEAT_MS:
            self._beat(now_ms)
        if silent_ms >= LOST_MS:
            return self._end("gone", Lost(f"{self._name}: nothing came for {LOST_MS / 1000:g} s"))
        if silent_ms >= DEADMAN_MS and self.state == "live":
            self.state = _NEXT["live", "quiet"]
            self._pressed = None
            return [Stale()]
        return []

    def wait_ms(self, now_ms: int) -> int:
        """Return how long `tick` can wait, if nothing comes."""
        if self.state in ("greeting", "joining"):
            return max(self._start_ms + SILENCE_MS - now_ms, 0)
        if self._owed:
            return max(self._heard_ms + SILENCE_MS - now_ms, 0)
        if self._granted:
            return SILENCE_MS // 2  # a Grant may follow at any time
        due_ms = self._beat_ms + HEARTBEAT_MS
        if self.state == "live":
            due_ms = min(due_ms, self._heard_ms + DEADMAN_MS)
        return max(due_ms - now_ms, 0)

    def send(self, message: Message, now_ms: int) -> bool:
        """Say something; return whether there is anybody to say it to.

        Raises:
            ProtocolError: The wire cannot carry it.
        """
        if self.state not in ("live", "stale"):
            return False
        self._say(message, now_ms)
        if isinstance(message, Grant):
            if not self._owed:
                self._heard_ms = now_ms  # the 2 s begin now; before, silence was allowed
            self._owed += 1
        return True

    def cut(self, reason: str) -> list[Received]:
        """End it because the port has gone; return what there is to tell."""
        if self.over:
            return []
        if self.welcomed:
            return self._end("cut", Lost(reason))
        early = f"{reason} before an OrbTouch answered; name the orb's own port with --link"
        return self._end("cut", Refused(early))

    def close(self, reason: str, now_ms: int) -> None:
        """End it because our own program ends: say Bye, if there is somebody."""
        if not self.over:
            self.send(Bye(reason), now_ms)
            self.state, self._pressed = _NEXT[self.state, "close"], None

    def _end(self, event: str, last: Lost | Refused) -> list[Received]:
        self.state, self._pressed = _NEXT[self.state, event], None
        return [last]

    def _say(self, message: Message, now_ms: int) -> None:
        sequence = (self._sequence + 1) & 0xFFFF
        t_ms = now_ms - self._start_ms
        self.output += encode(
            message, session=self._number, sequence=sequence, t_ms=t_ms, seal=self._seal
        )
        self._sequence = sequence

    def _beat(self, now_ms: int) -> None:
        """Say that we are there, and what we have."""
        self._beat_ms = now_ms
        self._say(HostHeartbeat(*self.echo.say(now_ms), self.past.done, self.past.missed), now_ms)

    # --- the handshake ---

    def _greeting(self, packet: Packet, now_ms: int) -> list[Received]:
        """Take the answer to Hello or Join; all else is the rest of somebody's conversation."""
        message = packet.message
        first = self.state == "greeting"
        answers = packet.sequence == self._taken if first else packet.session == self._number
        if answers and isinstance(message, Refuse):
            return self._end("refuse", Refused(f"{self._name}: {message.reason}"))
        if answers and first and isinstance(message, Offer) and message.version == VERSION:
            return self._join(packet, message, now_ms)
        if answers and not first:
            if isinstance(message, Welcome) and message.version == VERSION:
                return self._meet(packet, message, now_ms)
            if message is None and packet.version == VERSION:
                reason = f"{self._name} does not know our key; give both the same --key FILE"
                return self._end("forged", Refused(reason))
        if message is None and packet.version != VERSION:
            self._foreign = packet.version
        self.ignored += 1
        return []

    def _join(self, packet: Packet, offer: Offer, now_ms: int) -> list[Received]:
        """Say who we are, if both sides have a key or none."""
        self._number = packet.session
        if offer.keyed != bool(self._key):
            self._say(Bye(_WITHOUT[offer.keyed]), now_ms)
            return self._end("objection", Refused(f"{self._name}: {_OBJECTION[offer.keyed]}"))
        self.state = _NEXT[self.state, "offer"]
        if self._key:
            self._seal, self._decoder.seal = seals(
                self._key,
                versions=(VERSION, VERSION),
                host=self._nonce.encode(),
                device=offer.nonce,
                session=packet.session,
                sequence=packet.sequence,
            )
        past = self.past
        ours = past.host_nonce, past.boot_nonce, past.done
        self._say(Join(self._token, "host", self._granted, *ours), now_ms)
        self._joined_ms = now_ms
        return []

    def _meet(self, packet: Packet, welcome: Welcome, now_ms: int) -> list[Received]:
        """Begin with a device, or go on."""
        self.state, self.welcomed = _NEXT[self.state, "welcome"], True
        self._taken, self._heard_ms = packet.sequence, now_ms
        # The first command may be on our heels, and its age has to be known.
        self.echo.hear(packet.t_ms, self._joined_ms & 0xFFFFFFFF, 0, now_ms)
        past = self.past
        if not (welcome.resumed and welcome.boot_nonce == past.boot_nonce):
            past.boot_nonce, past.done, past.missed = welcome.boot_nonce, welcome.done, 0
        self._owes = not self._granted
        return [Connected(welcome), *self._give_up(welcome.done)]

    # --- a live session ---

    def _take(self, packet: Packet, now_ms: int, stalled: bool) -> list[Received]:
        """Take one packet of this session."""
        self.state = _NEXT[self.state, "packet" if not isinstance(packet.message, Bye) else "bye"]
        self._taken, self._heard_ms = packet.sequence, now_ms
        message = packet.message
        match message:
            case Bye():
                self._pressed = None
                return [Lost(f"{self._name}: {message.reason}")]
            case NumberedCommand():
                return self._command(message, packet.t_ms, now_ms, stalled)
            case Heartbeat():
                self.echo.hear(message.sent_ms, message.echo_ms, message.held_ms, now_ms)
                self._skew_ms = signed(packet.t_ms - message.sent_ms)
                return [*self._give_up(message.done), *self._hold(message.pressed, packet.t_ms)]
            case State():
                return self._hold(message.pressed, packet.t_ms)
            case Granted() if self._owed:
                self._owed -= 1
        return [Delivered(message, packet.t_ms)] if message is not None else []

    def _command(
        self, message: NumberedCommand, t_ms: int, now_ms: int, stalled: bool
    ) -> list[Received]:
        """Deliver a command if it is the next one, and not too late."""
        self._owes = not self._granted
        news = self._give_up(message.done)
        if message.number != self.past.done + 1:
            return news  # we have it already; or one before it is missing, and both will come again
        self.past.done += 1
        age_ms = self.echo.age_ms(message.sent_ms, now_ms) or 0
        if stalled or (age_ms > LATE_MS and not self._granted):
            self.past.missed += 1
            self.late += 1
            return [*news, Missed(1)]
        command = Command(
            message.name, message.label, message.probability, message.touch, message.frame
        )
        return [*news, Delivered(command, t_ms)]

    def _give_up(self, done: int) -> list[Received]:
        """Take note that nobody will send the commands up to `done` again."""
        count = done - self.past.done
        if count <= 0:
            return []
        self.past.done, self.past.missed = done, (self.past.missed + count) & 0xFFFFFFFF
        return [Missed(count)]

    def _hold(self, pressed: tuple[str, ...], t_ms: int) -> list[Received]:
        """Take a snapshot of what is held, and tell it if it is new."""
        if pressed == self._pressed:
            return []
        self._pressed = pressed
        return [Delivered(State(pressed), t_ms)]

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


# By whether the orb asks for a key: what we tell the user, and what we tell the orb.
_OBJECTION = {
    True: "the orb wants a key; add --key FILE, with the file that it was started with",
    False: "the orb asks for no key, so nothing proves that it is ours; start it with the same "
    "--key FILE, or leave --key out here",
}
_WITHOUT = {True: "the host has no key", False: "the host wants a key, and the orb has none"}
