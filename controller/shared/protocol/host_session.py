"""Session at the host's end: bytes in, link events out.

Sans-IO: time is an argument, bytes to send gather in `output`. One HostSession is one attempt on
one open link; the next attempt is a new one, and `SessionHistory` carries the record of those
before. Its states are the table `controller.shared.protocol.states.HOST`.
"""

from controller.shared.protocol.auth import NONCE, seals
from controller.shared.protocol.link_events import (
    Connected,
    Delivered,
    Lost,
    Missed,
    Received,
    Refused,
    Stale,
    no_answer,
)
from controller.shared.protocol.messages import (
    DEADMAN_MS,
    HEARTBEAT_MS,
    LATE_MS,
    LOST_MS,
    SILENCE_MS,
    VERSION,
    Bye,
    Command,
    ContactState,
    Grant,
    Granted,
    Heartbeat,
    Hello,
    HostHeartbeat,
    Join,
    Message,
    NumberedCommand,
    Offer,
    Refuse,
    Report,
    State,
    Welcome,
    hold_ms,
)
from controller.shared.protocol.packets import Packet, SessionEnd, is_ahead, signed
from controller.shared.protocol.retransmit import SessionHistory
from controller.shared.protocol.states import HOST


class HostSession(SessionEnd):
    """The host's end of one open link.

    Attributes:
        state: "greeting" until Offer, "joining" until Welcome, then "live" or "stale"; "over"
            after Lost or Refused, or when the owner has ended it.
        welcomed: Whether the session was ever live.
        pressed: Held commands as last reported; none after 300 ms of silence.
        past: Record for the next session; kept up to date.
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
        """Begin with Hello.

        Args:
            name: Of the link, for sentences.
            sequence: Number of the first packet, best a random u16.
            now_ms: The clock, as in every method.
            token: The token that the device expects in Join.
            granted: Whether this host grants time.
            key: Pre-shared key; b"": none.
            nonce: 16 random bytes for this session, which a key needs; else they tell duplicates.
            past: Record of earlier sessions; None: there was none.
        """
        if key and len(nonce) != NONCE:
            raise ValueError(f"a session with a key needs {NONCE} random bytes, not {len(nonce)}")
        super().__init__(HOST, "over", 0, key)
        self._go("again")
        self.welcomed = False
        self.past = SessionHistory() if past is None else past
        self._name, self._token, self._granted = name, token, granted
        self._nonce = nonce.hex()
        self._sequence, self._taken = sequence - 1, sequence  # Hello is the first packet
        self._start_ms = self._heard_ms = self._beat_ms = now_ms
        self._joined_ms = now_ms  # when Join was sent
        self._skew_ms = 0  # from the device's link clock to that of its messages
        self._pressed: tuple[str, ...] | None = None  # None: to be reported again
        self._contact: tuple[int, int, int] | None = None  # frame, its time, ours; None: no touch
        self._hold_ms = DEADMAN_MS  # a contact without a newer one has ended
        self._owes = False  # a command is to be acknowledged
        self._owed = 0  # unanswered Grants
        self._foreign = 0  # protocol version of a peer, if it is another
        self._mute = True  # no byte was received
        self.output += b"\0"  # ends an incomplete frame of an earlier host
        self._put(Hello(VERSION, VERSION, self._nonce, "", False), 0)

    @property
    def over(self) -> bool:
        """Whether this attempt has ended."""
        return self.state == "over"

    @property
    def pressed(self) -> tuple[str, ...]:
        """Held commands as last reported."""
        return self._pressed or ()

    @property
    def clock_offset_ms(self) -> int | None:
        """The device's message time minus our clock; None: not known yet."""
        offset_ms = self.clock.offset_ms
        return None if offset_ms is None else signed(offset_ms + self._skew_ms)

    def receive(self, data: bytes, now_ms: int) -> list[Received]:
        """Return the events in these bytes."""
        events = self.tick(now_ms)  # a timeout comes before the bytes that were late
        self._mute = self._mute and not data
        if self.over:
            return events
        stalled = self.state == "stale"
        for packet in self._decoder.feed(data):
            if not self.welcomed:
                events += self._greeting(packet, now_ms)
            elif (
                packet.session == self.number
                and isinstance(packet.message, Report | Bye)
                and is_ahead(packet.sequence, self._taken)
            ):
                events += self._take(packet, now_ms, stalled)
            if self.over:
                break
        if self._owes and not self.over:
            self._owes = False
            self._beat(now_ms)
        return events

    def tick(self, now_ms: int) -> list[Received]:
        """Advance to `now_ms`: send a heartbeat if due; return the events of a silent device."""
        silent_ms = now_ms - self._heard_ms
        if self.over:
            return []
        if self.state in ("greeting", "joining"):
            late = now_ms - self._start_ms >= SILENCE_MS
            return (
                self._end("silence", Refused(no_answer(self._name, self._foreign, mute=self._mute)))
                if late
                else []
            )
        if self._granted:
            if self._owed and silent_ms >= SILENCE_MS:
                return self._end("gone", Lost(f"{self._name}: a grant was not answered within 2 s"))
            return []
        if now_ms - self._beat_ms >= HEARTBEAT_MS:
            self._beat(now_ms)
        if silent_ms >= LOST_MS:
            return self._end("gone", Lost(f"{self._name}: nothing came for {LOST_MS / 1000:g} s"))
        if silent_ms >= DEADMAN_MS and self.state == "live":
            self._go("quiet")
            self._pressed = self._contact = None
            return [Stale()]
        if self._contact is not None and now_ms - self._contact[2] >= self._hold_ms:
            (frame, t_ms, _), self._contact = self._contact, None
            return [Delivered(ContactState(frame), t_ms)]
        return []

    def wait_ms(self, now_ms: int) -> int:
        """Return how long `tick` can wait without a received byte, milliseconds."""
        if self.state in ("greeting", "joining"):
            return max(self._start_ms + SILENCE_MS - now_ms, 0)
        if self._owed:
            return max(self._heard_ms + SILENCE_MS - now_ms, 0)
        if self._granted:
            return SILENCE_MS // 2  # a Grant may follow at any time
        dead_ms = self._heard_ms + DEADMAN_MS if self.state == "live" else now_ms + DEADMAN_MS
        return max(min(self._beat_ms + HEARTBEAT_MS, dead_ms) - now_ms, 0)

    def send(self, message: Message, now_ms: int) -> bool:
        """Send a message; return False if no session is live. ProtocolError if it does not fit."""
        if self.state not in ("live", "stale"):
            return False
        self._send(message, now_ms)
        if isinstance(message, Grant):
            if not self._owed:
                self._heard_ms = now_ms  # the 2 s begin now; silence was allowed before
            self._owed += 1
        return True

    def cut(self, reason: str) -> list[Received]:
        """End the session because the port was lost; return its events."""
        early = f"{reason} before an OrbTouch answered; name the orb's own port with --link"
        last = Lost(reason) if self.welcomed else Refused(early)
        return [] if self.over else self._end("cut", last)

    def close(self, reason: str, now_ms: int) -> None:
        """End the session because the host program ends; send Bye if it is live."""
        if not self.over:
            self.send(Bye(reason), now_ms)
            self._go("close")
            self._pressed = None

    def _end(self, event: str, last: Lost | Refused) -> list[Received]:
        self._go(event)
        self._pressed = None
        return [last]

    def _send(self, message: Message, now_ms: int) -> None:
        self._put(message, now_ms - self._start_ms)

    def _beat(self, now_ms: int) -> None:
        """Send a heartbeat with the acknowledgements."""
        self._beat_ms = now_ms
        self._send(
            HostHeartbeat(*self.clock.stamps(now_ms), self.past.done, self.past.missed), now_ms
        )

    # --- the handshake ---

    def _greeting(self, packet: Packet, now_ms: int) -> list[Received]:
        """Take the answer to Hello or Join; ignore packets of other sessions."""
        message = packet.message
        first = self.state == "greeting"
        answers = packet.sequence == self._taken if first else packet.session == self.number
        if answers and isinstance(message, Refuse):
            return self._end("refuse", Refused(f"{self._name}: {message.reason}"))
        if answers and first and isinstance(message, Offer) and message.version == VERSION:
            return self._join(packet, message, now_ms)
        if answers and not first:
            if isinstance(message, Welcome) and message.version == VERSION:
                return self._meet(packet, message, now_ms)
            if message is None and packet.version == VERSION:
                reason = f"{self._name} has another key; give both the same --key FILE"
                return self._end("forged", Refused(reason))
        if message is None and packet.version != VERSION:
            self._foreign = packet.version
        return []

    def _join(self, packet: Packet, offer: Offer, now_ms: int) -> list[Received]:
        """Send Join, if both sides have a key or none."""
        self.number = packet.session
        if offer.keyed != bool(self._key):
            self._send(Bye(_WITHOUT[offer.keyed]), now_ms)
            return self._end("objection", Refused(f"{self._name}: {_OBJECTION[offer.keyed]}"))
        self._go("offer")
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
        self._send(Join(self._token, "host", self._granted, *ours), now_ms)
        self._joined_ms = now_ms
        return []

    def _meet(self, packet: Packet, welcome: Welcome, now_ms: int) -> list[Received]:
        """Begin a session, or resume the one before."""
        self._go("welcome")
        self.welcomed = True
        self._take_number(packet, now_ms)
        # The first command may follow at once, and its age has to be known.
        self.clock.take(packet.t_ms, self._joined_ms & 0xFFFFFFFF, 0, now_ms)
        self._hold_ms = hold_ms(welcome.rate_hz)
        past = self.past
        if not (welcome.resumed and welcome.boot_nonce == past.boot_nonce):
            past.boot_nonce, past.done, past.missed = welcome.boot_nonce, welcome.done, 0
        self._owes = not self._granted
        return [Connected(welcome), *self._give_up(welcome.done)]

    # --- a live session ---

    def _take(self, packet: Packet, now_ms: int, stalled: bool) -> list[Received]:
        """Take one packet of this session."""
        message = packet.message
        self._take_number(packet, now_ms)
        self._go("bye" if isinstance(message, Bye) else "packet")
        match message:
            case Bye():
                self._pressed = None
                return [Lost(f"{self._name}: {message.reason}")]
            case NumberedCommand():
                return self._command(message, packet.t_ms, now_ms, stalled)
            case Heartbeat():
                self.clock.take(message.sent_ms, message.echo_ms, message.held_ms, now_ms)
                self._skew_ms = signed(packet.t_ms - message.sent_ms)
                return [*self._give_up(message.done), *self._hold(message.pressed, packet.t_ms)]
            case State():
                return self._hold(message.pressed, packet.t_ms)
            case ContactState():
                return self._touch(message, packet.t_ms, now_ms)
            case Granted() if self._owed:
                self._owed -= 1
        return [Delivered(message, packet.t_ms)] if message is not None else []

    def _command(
        self, message: NumberedCommand, t_ms: int, now_ms: int, stalled: bool
    ) -> list[Received]:
        """Return a command's event if it is the next one: Delivered, or Missed if too late."""
        self._owes = not self._granted
        events = self._give_up(message.done)
        if message.number != self.past.done + 1:
            return events  # a duplicate, or one before it is missing and both will be resent
        self.past.done += 1
        age_ms = self.clock.age_ms(message.sent_ms, now_ms) or 0
        if stalled or (age_ms > LATE_MS and not self._granted):
            self.past.missed += 1
            return [*events, Missed(1)]
        m = message
        command = Command(m.name, m.label, m.probability, m.touch, m.frame)
        return [*events, Delivered(command, t_ms)]

    def _touch(self, contact: ContactState, t_ms: int, now_ms: int) -> list[Received]:
        """Return the event of a contact that is not too old; of an end, if it ends one."""
        if contact.fingers:
            age_ms = self.clock.age_ms(contact.sent_ms, now_ms) or 0
            if age_ms > LATE_MS and not self._granted:
                return []
            self._contact = contact.frame, t_ms, now_ms
        elif self._contact is None:
            return []
        else:
            self._contact = None
        return [Delivered(contact, t_ms)]

    def _give_up(self, done: int) -> list[Received]:
        """Count commands up to `done` that were not received as missed."""
        count = self.past.give_up(done)
        return [Missed(count)] if count else []

    def _hold(self, pressed: tuple[str, ...], t_ms: int) -> list[Received]:
        """Take a snapshot of the held commands; return its event if it is new."""
        if pressed == self._pressed:
            return []
        self._pressed = pressed
        return [Delivered(State(pressed), t_ms)]


# By whether the orb needs a key: the sentence for the user, and the one for the orb.
_OBJECTION = {
    True: "the orb needs a key; add --key FILE, with the file that it was started with",
    False: "the orb has no key, so it cannot be authenticated; start it with the same "
    "--key FILE, or leave --key out here",
}
_WITHOUT = {True: "the host has no key", False: "the host needs a key, and the orb has none"}
