"""The device's side of the conversation in `controller.protocol.messages`: bytes in, requests out.

Sans-IO: time comes in as an argument, bytes to send gather in `output`. Whoever owns the link
reads and writes. Its states, and what leads from one to another, are the table
`controller.protocol.states.DEVICE`. Commands that no host has acknowledged outlive a session in an
`RetransmitQueue`, which the sessions of a device share.
"""

from __future__ import annotations

import dataclasses
import hmac
import secrets
from collections.abc import Callable
from typing import Final

from controller.protocol.auth import NONCE, FrameAuthenticator, seals
from controller.protocol.clock_sync import ClockSync
from controller.protocol.messages import (
    RESEND_MS,
    SILENCE_MS,
    VERSION,
    Bye,
    Command,
    Contacts,
    Correction,
    Grant,
    Heartbeat,
    Hello,
    HostHeartbeat,
    Join,
    Message,
    NumberedCommand,
    Offer,
    Perform,
    Refuse,
    State,
    UploadChunk,
    UploadOffer,
    Welcome,
)
from controller.protocol.packets import Decoder, Packet, encode, is_ahead
from controller.protocol.retransmit import PendingCommand, RetransmitQueue
from controller.protocol.states import DEVICE, next_states

BACKLOG = 16 * 1024  # bytes that wait for a slow host, about 8 s; what comes on top is dropped
GRANTED_BACKLOG = 4 * 1024 * 1024  # the same for granted time, where nothing may be missing
WRONG_KEY: Final = "the host has another key than the orb, or none; give both the same --key FILE"
_NEXT: Final = next_states(DEVICE)
_FROM_HOST: Final = (
    HostHeartbeat,
    Contacts,
    Perform,
    Grant,
    UploadOffer,
    UploadChunk,
    Correction,
    Bye,
)


class DeviceSession:
    """Answers one host, whoever that is by and by.

    Attributes:
        state: "waiting", "offered" from Hello to Join, "live".
        number: The session's number; it stays when the session has ended.
        granted: Whether the present host owns the clock.
        resumed: Whether the present host was the one before as well.
        taken_by: Set from outside: the host_nonce of a host on another line, who has the device;
            only that one may come here instead. 0: nobody.
        output: Bytes to send; the owner of the link takes them from the front.
        outbox: Commands that are not acknowledged.
        echo: Round trip and clock offset.
        dropped: Messages that were not sent: no session, or the host reads too slowly.
        ignored: Valid packets that had no business here.
        refused: Why a host was turned away last; for the log, which may clear it.
    """

    def __init__(
        self,
        welcome: Welcome,
        *,
        token: str = "",
        key: bytes = b"",
        number: int = 0,
        outbox: RetransmitQueue | None = None,
        draw: Callable[[int], bytes] = secrets.token_bytes,
    ) -> None:
        """Wait for a host.

        Args:
            welcome: What this device says of itself.
            token: What a host must say in Join; "" lets everyone in.
            key: What every frame has to be sealed with; b"" needs none.
            number: The session before the first one.
            outbox: What sessions before this one have left; None: nothing.
            draw: Returns so many random bytes.
        """
        self.state = "waiting"
        self.number = number & 0xFFFF
        self.granted = False
        self.resumed = False
        self.taken_by = 0
        self.output = bytearray()
        self.outbox = RetransmitQueue() if outbox is None else outbox
        self.echo = ClockSync()
        self.dropped = 0
        self.ignored = 0
        self.refused = ""
        self._welcome = welcome
        self._token, self._key, self._draw = token.encode(), key, draw
        self._decoder = Decoder()
        self._seal: FrameAuthenticator | None = None  # of what we send
        self._greeted = Hello(0, 0, "", "", False), 0  # the newest Hello, and its sequence
        self._sequence = 0  # of the newest packet sent
        self._taken = 0  # sequence of the newest packet taken
        self._heard_ms = 0
        self._beat_ms = 0
        self._skew_ms = 0  # from the link's clock to the one that messages carry
        self._pressed: tuple[str, ...] = ()  # what is held, as State said last

    @property
    def live(self) -> bool:
        """Whether a host was welcomed and is still there."""
        return self.state == "live"

    def receive(self, data: bytes, now_ms: int) -> list[Message]:
        """Return the requests in these bytes: Hello (welcomed), all that the host asks, Bye.

        Args:
            data: What came over the link, cut anywhere.
            now_ms: The link's clock.
        """
        requests: list[Message] = []
        for packet in self._decoder.feed(data):
            if isinstance(packet.message, Hello):
                requests += self._greet(packet, packet.message, now_ms)
            elif self.state == "waiting" or packet.session != self.number:
                self.ignored += 1
            elif packet.message is None and packet.version == VERSION and self.state == "offered":
                self._refuse("forged", WRONG_KEY)
            elif not is_ahead(packet.sequence, self._taken):
                self.ignored += 1
            elif isinstance(packet.message, Join) and self.state == "offered":
                requests += self._join(packet, packet.message, now_ms)
            elif isinstance(packet.message, _FROM_HOST):
                requests += self._take(packet, now_ms)
            else:
                self.ignored += 1
        return requests

    def send(self, message: Message, t_ms: int, now_ms: int) -> None:
        """Say something to the host; without one it is dropped, but a command waits for a moment.

        Args:
            message: What to say.
            t_ms: The device's time that it belongs to.
            now_ms: The link's clock.

        Raises:
            ProtocolError: The wire cannot carry it.
        """
        if isinstance(message, Command):
            self._post(message, t_ms, now_ms)
            return
        if isinstance(message, State) and self.live:
            self._pressed = message.pressed
        self._say(message, t_ms, now_ms)

    def tick(self, now_ms: int) -> list[Message]:
        """Send what is due; return Bye if the host has been silent for too long.

        Granted time knows neither: the host may think for as long as it likes.
        """
        if self.state == "waiting" or (self.live and self.granted):
            return []
        if now_ms - self._heard_ms > SILENCE_MS:
            return self.end(f"the host was silent for {SILENCE_MS / 1000:g} s", "silence")
        if not self.live:
            return []
        self._send_again(now_ms)
        if now_ms - self._beat_ms >= self._welcome.heartbeat_ms:
            # On the beat, not one pause after the last one, unless that is long ago.
            late_ms = (now_ms - self._beat_ms) % self._welcome.heartbeat_ms
            self._beat_ms = now_ms - late_ms
            beat = Heartbeat(*self.echo.say(now_ms), self.outbox.done, self._pressed)
            self._say(beat, now_ms + self._skew_ms, now_ms)
        return []

    def end(self, reason: str, event: str = "cut") -> list[Message]:
        """End the session from this side, without a word; return it as the host's Bye, if live."""
        if self.state == "waiting":
            return []
        was_live, self.state = self.live, _NEXT[self.state, event]
        self.output.clear()
        return [Bye(reason)] if was_live else []

    def renew(self, welcome: Welcome, reason: str, now_ms: int) -> list[Message]:
        """Be another device from now on: a host hears Bye, and may come back at once."""
        if self.live:
            self._say(Bye(reason), now_ms + self._skew_ms, now_ms)
        said = bytes(self.output)
        ended = self.end(reason)
        self.output += said
        self._welcome = welcome
        return ended

    # --- the handshake ---

    def _greet(self, packet: Packet, hello: Hello, now_ms: int) -> list[Message]:
        """Answer Hello with Offer, or with Refuse."""
        if self.state != "waiting" and (hello, packet.sequence) == self._greeted:
            self.ignored += 1  # the line has doubled what is answered already
            return []
        ended: list[Message] = [Bye("the host started anew")] if self.live else []
        self.output[:] = b"\0"  # ends a frame that an earlier session got half of
        self._sequence = self._taken = packet.sequence
        self._heard_ms = self._beat_ms = now_ms
        self._decoder.seal = self._seal = None
        self._greeted = hello, packet.sequence
        if not hello.version_min <= VERSION <= hello.version_max:
            self.number = 0  # Refuse is in no session
            side = "host" if hello.version_max < VERSION else "orb's controller"
            self._refuse(
                "foreign",
                f"the orb speaks protocol version {VERSION}, the host {_versions(hello)}; "
                f"update the {side}",
                sequence=packet.sequence,
            )
            return ended
        self.state = _NEXT[self.state, "hello"]
        self.number = self.number % 0xFFFF + 1  # never 0
        nonce = self._draw(NONCE)
        offer = Offer(VERSION, nonce, bool(self._key))
        self.output += encode(offer, session=self.number, sequence=packet.sequence, t_ms=0)
        if self._key:
            self._decoder.seal, self._seal = seals(
                self._key,
                versions=(hello.version_min, hello.version_max),
                host=hello.token.encode(),
                device=nonce,
                session=self.number,
                sequence=packet.sequence,
            )
        return ended

    def _join(self, packet: Packet, join: Join, now_ms: int) -> list[Message]:
        """Answer Join with Welcome and State, and what may still be obeyed; or with Refuse."""
        self._taken = packet.sequence
        reason = self._objection(join)
        if reason:
            self._refuse("objection", reason)
            return []
        self.state = _NEXT[self.state, "join"]
        self._heard_ms = self._beat_ms = now_ms
        self.granted, self.echo = join.granted, ClockSync()
        self._skew_ms, self._pressed = 0, ()
        box = self.outbox
        before = box.host, self._welcome.boot_nonce
        # Granted time begins anew with each host, and what was before it has no place in it.
        self.resumed = (join.host_nonce, join.boot_nonce) == before and not join.granted
        if self.resumed:
            box.acknowledge(join.done)
            box.expire(now_ms)
        else:
            box.begin(join.host_nonce)
        told = dataclasses.replace(self._welcome, resumed=self.resumed, done=box.done)
        self._say(told, now_ms, now_ms)
        self._say(State(()), 0, now_ms)
        for posted in box.posted:
            self._deliver(posted, now_ms)
        hello, _ = self._greeted
        return [Hello(hello.version_min, hello.version_max, join.token, join.host, join.granted)]

    def _objection(self, join: Join) -> str:
        """Return why this host cannot be welcomed, or "" if it can."""
        if self._token and not hmac.compare_digest(self._token, join.token.encode()):
            return "this orb answers only to the program that started it; start one of your own"
        if join.granted and not self._welcome.virtual:
            return "only a virtual orb's time can be granted; connect in real time"
        if self.taken_by not in (0, join.host_nonce):
            return "already connected to another host; close that one first"
        return ""

    def _refuse(self, event: str, reason: str, *, sequence: int | None = None) -> None:
        """Turn the host away, unsealed if it is the key that is wrong."""
        self.state = _NEXT[self.state, event]
        self.refused = reason
        if sequence is None:
            sequence = self._sequence = (self._sequence + 1) & 0xFFFF
        seal = None if event == "forged" else self._seal
        self.output += encode(
            Refuse(reason), session=self.number, sequence=sequence, t_ms=0, seal=seal
        )

    # --- a live session ---

    def _take(self, packet: Packet, now_ms: int) -> list[Message]:
        """Take one packet of the session: the request in it, if it is one."""
        message = packet.message
        if isinstance(message, Bye):
            if not self.live:
                self.refused = message.reason  # it turned away from us
            return self.end(message.reason, "bye")
        if not self.live:
            self.ignored += 1
            return []
        self.state = _NEXT[self.state, "packet"]
        self._taken, self._heard_ms = packet.sequence, now_ms
        if isinstance(message, HostHeartbeat):
            self.echo.hear(message.sent_ms, message.echo_ms, message.held_ms, now_ms)
            self.outbox.acknowledge(message.done)
            self.outbox.missed = message.missed
            return []
        if isinstance(message, UploadOffer | UploadChunk | Correction):
            return [message]
        if self._welcome.virtual and (
            isinstance(message, Contacts | Perform) or (isinstance(message, Grant) and self.granted)
        ):
            return [message]
        self.ignored += 1
        return []

    def _post(self, command: Command, t_ms: int, now_ms: int) -> None:
        """Give a command its number and send it; who is not there has a moment to come back."""
        # What the wire cannot carry shall be found here, and not when it is sent again.
        encode(_numbered(command, 0, 0, 0), session=0, sequence=0, t_ms=0)
        posted = self.outbox.put(command, t_ms, now_ms)
        if self.live:
            self._deliver(posted, now_ms)
            if self.granted:
                self.outbox.acknowledge(posted.number)

    def _send_again(self, now_ms: int) -> None:
        """Send commands again that the host should have acknowledged by now, in order."""
        self.outbox.expire(now_ms)
        posted = self.outbox.posted
        pause_ms = max(RESEND_MS, 2 * (self.echo.rtt_ms or 0))
        if posted and (posted[0].sent_ms is None or now_ms - posted[0].sent_ms >= pause_ms):
            for item in posted:
                self._deliver(item, now_ms)

    def _deliver(self, posted: PendingCommand, now_ms: int) -> None:
        """Send a command, for the first time or again."""
        posted.sent_ms = now_ms
        done = posted.number - 1 if self.granted else self.outbox.done
        message = _numbered(posted.command, posted.number, done, posted.put_ms & 0xFFFFFFFF)
        self._say(message, posted.t_ms, now_ms)

    def _say(self, message: Message, t_ms: int, now_ms: int) -> None:
        """Put a packet behind the others that are to be sent."""
        if not self.live or len(self.output) > (GRANTED_BACKLOG if self.granted else BACKLOG):
            self.dropped += 1
            return
        if not isinstance(message, Welcome | Heartbeat | NumberedCommand):
            self._skew_ms = t_ms - now_ms
        sequence = (self._sequence + 1) & 0xFFFF
        self.output += encode(
            message, session=self.number, sequence=sequence, t_ms=t_ms, seal=self._seal
        )
        self._sequence = sequence


def _numbered(command: Command, number: int, done: int, sent_ms: int) -> NumberedCommand:
    c = command
    return NumberedCommand(c.name, c.label, c.probability, c.touch, c.frame, number, done, sent_ms)


def _versions(hello: Hello) -> str:
    if hello.version_min == hello.version_max:
        return f"version {hello.version_min}"
    return f"versions {hello.version_min} to {hello.version_max}"
