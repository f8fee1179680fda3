"""Session at the device's end: bytes in, requests of the host out.

Sans-IO: time is an argument, bytes to send gather in `output`; the owner of the link reads and
writes. Its states are the table `controller.shared.protocol.states.DEVICE`. Unacknowledged commands
outlive a session in a `RetransmitQueue`, which the sessions of a device share.
"""

import dataclasses
import hmac
import secrets
from collections.abc import Callable
from typing import Final

from controller.shared.protocol.auth import NONCE, seals
from controller.shared.protocol.messages import (
    HUNG_MS,
    SILENCE_MS,
    UPDATE,
    VERSION,
    Bye,
    Command,
    Contacts,
    ContactState,
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
    Request,
    State,
    Welcome,
    hold_ms,
)
from controller.shared.protocol.packets import ClockSync, Packet, SessionEnd, encode, is_ahead
from controller.shared.protocol.retransmit import RESEND_MS, PendingCommand, RetransmitQueue
from controller.shared.protocol.states import DEVICE
from controller.shared.protocol.teaching import InjectFault

BACKLOG: Final = 16 * 1024  # bytes that wait for a slow host, about 8 s; more are dropped
GRANTED_BACKLOG: Final = 4 * 1024 * 1024  # the same in granted time, where nothing may be lost
WRONG_KEY: Final = "the host has another key than the orb, or none; give both the same --key FILE"


class DeviceSession(SessionEnd):
    """The device's end of a link, for one host after the other.

    Attributes:
        state: "waiting", "offered" from Hello to Join, "live"; "stalled" and "hung" are live
            sessions of a control loop that gives no sign.
        number: The session's number; it stays when the session has ended.
        granted: Whether the present host grants time.
        resumed: Whether the session continues the one before, with the same host.
        taken_by: Set from outside: the host_nonce of the host connected on another link; only that
            one may connect here instead. 0: none.
        outbox: Unacknowledged commands.
        dropped: Messages that were not sent: no session, or the host reads too slowly.
        refused: Why a host was last refused; the owner may clear it.
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
            welcome: The device's description.
            token: Token expected in Join; "" accepts every host.
            key: Pre-shared key of all frames; b"": none.
            number: The session before the first one.
            outbox: Commands left by sessions before this one; None: none.
            draw: Returns a number of random bytes.
        """
        super().__init__(DEVICE, "waiting", number & 0xFFFF, key)
        self.granted = False
        self.resumed = False
        self.taken_by = 0
        self.outbox = RetransmitQueue() if outbox is None else outbox
        self.dropped = 0
        self.refused = ""
        self._welcome = welcome
        self._token, self._draw = token.encode(), draw
        self._greeted = Hello(0, 0, "", "", False), 0  # the newest Hello, and its sequence
        self._skew_ms = 0  # from the link's clock to that of the messages
        self._pressed: tuple[str, ...] = ()  # held commands of the last State
        self._touched: int | None = None  # frame of the last contact; None: it has ended
        self._unsent: tuple[ContactState, int] | None = None  # newest contact, and its time

    @property
    def live(self) -> bool:
        """Whether a session is live."""
        return self.state in ("live", "stalled", "hung")

    def release_ms(self, loop_ms: int) -> int:
        """Return when commands are no longer held, if the loop's latest sign was at `loop_ms`."""
        return loop_ms + hold_ms(self._welcome.rate_hz)

    def receive(self, data: bytes, now_ms: int) -> list[Message]:
        """Return the requests in bytes that are cut anywhere: Hello once welcomed, others, Bye."""
        requests: list[Message] = []
        for packet in self._decoder.feed(data):
            if isinstance(packet.message, Hello):
                requests += self._greet(packet, packet.message, now_ms)
            elif self.state == "waiting" or packet.session != self.number:
                continue
            elif packet.message is None and packet.version == VERSION and self.state == "offered":
                self._refuse("forged", WRONG_KEY)
            elif not is_ahead(packet.sequence, self._taken):
                continue
            elif isinstance(packet.message, Join) and self.state == "offered":
                requests += self._join(packet, packet.message, now_ms)
            elif isinstance(packet.message, Bye):
                if not self.live:
                    self.refused = packet.message.reason  # the host refused this device
                requests += self.end(packet.message.reason, "bye")
            elif isinstance(packet.message, Request) and self.live:
                requests += self._take(packet, packet.message, now_ms)
        return requests

    def send(self, message: Message, t_ms: int, now_ms: int) -> None:
        """Send a message of the device's time `t_ms`; without a host only a command waits, 250 ms.

        `now_ms` is the link's clock, as everywhere. ProtocolError if it does not fit the wire.
        """
        if isinstance(message, Command):
            self._post(message, t_ms, now_ms)
            return
        if isinstance(message, State) and self.live:
            self._pressed = message.pressed
        if isinstance(message, ContactState):
            self._unsent = None
            self._touched = message.frame if self.live and message.fingers else None
            if self._touched is not None and not self.granted:
                self._touch(message, t_ms, now_ms)
                return
        self._send(message, t_ms, now_ms)

    def tick(self, now_ms: int, loop_ms: int | None = None) -> list[Message]:
        """Send heartbeats and retransmissions; return Bye after too long a silence of the host.

        `loop_ms` is the latest sign of the control loop: without a newer one nothing stays held,
        and after HUNG_MS there is no heartbeat. None: the loop has not begun. In granted time there
        is nothing of this, as the host's clock may stand still.
        """
        if self.state == "waiting" or (self.live and self.granted):
            return []
        if now_ms - self._heard_ms > SILENCE_MS:
            return self.end(f"the host was silent for {SILENCE_MS / 1000:g} s", "silence")
        if not self.live:
            return []
        self._watch(now_ms, now_ms if loop_ms is None else loop_ms)
        if self.state == "hung":
            return []
        self._send_contact()
        self._send_again(now_ms)
        if now_ms - self._beat_ms >= self._welcome.heartbeat_ms:
            # In phase with earlier heartbeats, unless they are long ago.
            late_ms = (now_ms - self._beat_ms) % self._welcome.heartbeat_ms
            self._beat_ms = now_ms - late_ms
            beat = Heartbeat(*self.clock.stamps(now_ms), self.outbox.done, self._pressed)
            self._send(beat, now_ms + self._skew_ms, now_ms)
        return []

    def _watch(self, now_ms: int, loop_ms: int) -> None:
        """Follow the control loop, which gave its latest sign at `loop_ms`."""
        if now_ms < self.release_ms(loop_ms):
            if self.state != "live":
                self._go("sign")
            return
        if self.state == "live":
            self._go("pause")
            if self._pressed:
                self.send(State(()), now_ms + self._skew_ms, now_ms)
            if self._touched is not None:
                self.send(ContactState(self._touched), now_ms + self._skew_ms, now_ms)
        if self.state == "stalled" and now_ms - loop_ms >= HUNG_MS:
            self._go("hang")

    def end(self, reason: str, event: str = "cut") -> list[Message]:
        """End the session without a message; return it as the host's Bye, if it was live."""
        if self.state == "waiting":
            return []
        was_live = self.live
        self._go(event)
        self.output.clear()
        return [Bye(reason)] if was_live else []

    def renew(self, welcome: Welcome, reason: str, now_ms: int) -> list[Message]:
        """Replace the description of the device; with a reason, end the session by Bye."""
        self._welcome = welcome
        if not reason:
            return []
        if self.live:
            self._send(Bye(reason), now_ms + self._skew_ms, now_ms)
        unsent = bytes(self.output)
        ended = self.end(reason)
        self.output += unsent
        return ended

    # --- the handshake ---

    def _greet(self, packet: Packet, hello: Hello, now_ms: int) -> list[Message]:
        """Answer Hello with Offer, or with Refuse."""
        if self.state != "waiting" and (hello, packet.sequence) == self._greeted:
            return []  # a duplicate that was answered already
        ended: list[Message] = [Bye("the host started again")] if self.live else []
        self.output[:] = b"\0"  # ends an incomplete frame of an earlier session
        self._sequence = (packet.sequence - 1) & 0xFFFF  # the answer repeats the Hello's
        self._take_number(packet, now_ms)
        self._beat_ms = now_ms
        self._decoder.seal = self._seal = None
        self._greeted = hello, packet.sequence
        if not hello.version_min <= VERSION <= hello.version_max:
            self.number = 0  # Refuse is in no session
            self._refuse("foreign", _update(hello))
            return ended
        self._go("hello")
        self.number = self.number % 0xFFFF + 1  # never 0
        nonce = self._draw(NONCE)
        self._put(Offer(VERSION, nonce, bool(self._key)), 0)
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
        """Answer Join with Welcome, State and commands not too old; or with Refuse."""
        self._taken = packet.sequence
        if reason := self._objection(join):
            self._refuse("objection", reason)
            return []
        self._go("join")
        self._heard_ms = self._beat_ms = now_ms
        self.granted, self.clock = join.granted, ClockSync()
        self._skew_ms, self._pressed = 0, ()
        self._touched = self._unsent = None
        queue = self.outbox
        before = queue.host, self._welcome.boot_nonce
        # Granted time begins at 0 with each host, so nothing before it is resumed.
        self.resumed = (join.host_nonce, join.boot_nonce) == before and not join.granted
        if self.resumed:
            queue.acknowledge(join.done)
            queue.expire(now_ms)
        else:
            queue.begin(join.host_nonce)
        welcome = dataclasses.replace(self._welcome, resumed=self.resumed, done=queue.done)
        self._send(welcome, now_ms, now_ms)
        self._send(State(()), 0, now_ms)
        for posted in queue.posted:
            self._deliver(posted, now_ms)
        hello, _ = self._greeted
        return [Hello(hello.version_min, hello.version_max, join.token, join.host, join.granted)]

    def _objection(self, join: Join) -> str:
        """Return the reason to refuse this host, "" if there is none."""
        if self._token and not hmac.compare_digest(self._token, join.token.encode()):
            return "this orb accepts only the program that started it; start another orb"
        if join.granted and not self._welcome.virtual:
            return "only a virtual orb's time can be granted; connect in real time"
        if self.taken_by not in (0, join.host_nonce):
            return "already connected to another host; close that one first"
        return ""

    def _refuse(self, event: str, reason: str) -> None:
        """Send Refuse, without a tag if the key is wrong."""
        self._go(event)
        self.refused = reason
        if event == "forged":
            self._seal = None
        self._put(Refuse(reason), 0)

    # --- a live session ---

    def _take(self, packet: Packet, message: Request, now_ms: int) -> list[Message]:
        """Take one packet of the live session; return its request, if it has one."""
        self._take_number(packet, now_ms)
        if isinstance(message, HostHeartbeat):
            self.clock.take(message.sent_ms, message.echo_ms, message.held_ms, now_ms)
            self.outbox.acknowledge(message.done)
            self.outbox.missed = message.missed
            return []
        real = not self._welcome.virtual and isinstance(
            message, Contacts | Perform | Grant | InjectFault
        )
        return [] if real or (isinstance(message, Grant) and not self.granted) else [message]

    def _post(self, command: Command, t_ms: int, now_ms: int) -> None:
        """Number a command and send it; it waits for a host that is not connected."""
        # A command that does not fit the wire format is refused now, not at its retransmission.
        encode(_numbered(command, 0, 0, 0), session=0, sequence=0, t_ms=0)
        posted = self.outbox.put(command, t_ms, now_ms)
        self._unsent = None  # a contact of before is never sent behind a command
        if self.live:
            self._deliver(posted, now_ms)
            if self.granted:
                self.outbox.acknowledge(posted.number)

    def _touch(self, contact: ContactState, t_ms: int, now_ms: int) -> None:
        """Send a contact once the output is empty, unless something newer comes before."""
        stamped = dataclasses.replace(contact, sent_ms=now_ms & 0xFFFFFFFF)
        encode(stamped, session=0, sequence=0, t_ms=0)  # is refused now, not when it is sent
        self._unsent, self._skew_ms = (stamped, t_ms), t_ms - now_ms
        self._send_contact()

    def _send_contact(self) -> None:
        if self._unsent is not None and not self.output:
            self._put(*self._unsent)
            self._unsent = None

    def _send_again(self, now_ms: int) -> None:
        """Resend the unacknowledged commands in order, once they are due."""
        self.outbox.expire(now_ms)
        posted = self.outbox.posted
        pause_ms = max(RESEND_MS, 2 * (self.clock.rtt_ms or 0))
        if posted and (posted[0].sent_ms is None or now_ms - posted[0].sent_ms >= pause_ms):
            for item in posted:
                self._deliver(item, now_ms)

    def _deliver(self, posted: PendingCommand, now_ms: int) -> None:
        """Send a command for the first time, or resend it."""
        posted.sent_ms = now_ms
        done = posted.number - 1 if self.granted else self.outbox.done
        message = _numbered(posted.command, posted.number, done, posted.put_ms & 0xFFFFFFFF)
        self._send(message, posted.t_ms, now_ms)

    def _send(self, message: Message, t_ms: int, now_ms: int) -> None:
        """Append a packet to the output, if a session is live and the host reads fast enough."""
        if not self.live or len(self.output) > (GRANTED_BACKLOG if self.granted else BACKLOG):
            self.dropped += 1
            return
        if not isinstance(message, Welcome | Heartbeat | NumberedCommand):
            self._skew_ms = t_ms - now_ms
        self._put(message, t_ms)


def _numbered(command: Command, number: int, done: int, sent_ms: int) -> NumberedCommand:
    c = command
    return NumberedCommand(c.name, c.label, c.probability, c.touch, c.frame, number, done, sent_ms)


def _update(hello: Hello) -> str:
    """Return the reason to refuse a host that has other versions only."""
    low, high = hello.version_min, hello.version_max
    versions = f"version {low}" if low == high else f"versions {low} to {high}"
    side = "host" if high < VERSION else "orb"
    return f"the orb has protocol version {VERSION}, the host {versions}; {UPDATE.format(side)}"
