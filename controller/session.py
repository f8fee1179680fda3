"""The device's side of the conversation in `controller.protocol`: bytes in, requests out.

Sans-IO: time comes in as an argument, bytes to send gather in `output`. Whoever owns the link
reads and writes. A session begins with an accepted Hello and ends with Bye, silence, or the link.
"""

from __future__ import annotations

import hmac

from controller.protocol import (
    SILENCE_MS,
    VERSION,
    Bye,
    Contacts,
    Decoder,
    Grant,
    Heartbeat,
    Hello,
    Message,
    Packet,
    Perform,
    Refuse,
    State,
    Welcome,
    encode,
    is_ahead,
)

BACKLOG = 16 * 1024  # bytes that wait for a slow host, about 8 s; what comes on top is dropped
GRANTED_BACKLOG = 4 * 1024 * 1024  # the same for granted time, where nothing may be missing


class DeviceSession:
    """Answers one host, whoever that is by and by.

    Attributes:
        number: The session's number; it stays when the session has ended.
        live: Whether a host was welcomed and is still there.
        granted: Whether that host owns the clock.
        busy: Set from outside: another host has the device, refuse this one.
        output: Bytes to send; the owner of the link takes them from the front.
        dropped: Messages that were not sent: no session, or the host reads too slowly.
        ignored: Valid packets that had no business here.
    """

    def __init__(self, welcome: Welcome, *, token: str = "", number: int = 0) -> None:
        """Wait for a host.

        Args:
            welcome: What this device says of itself.
            token: What a host must say in Hello; "" lets everyone in.
            number: The session before the first one.
        """
        self.number = number & 0xFFFF
        self.live = False
        self.granted = False
        self.busy = False
        self.output = bytearray()
        self.dropped = 0
        self.ignored = 0
        self._welcome = welcome
        self._token = token.encode()
        self._decoder = Decoder()
        self._sequence = 0  # of the newest packet sent
        self._taken = 0  # sequence of the newest packet taken
        self._echo_ms = 0
        self._heard_ms = 0
        self._beat_ms = 0
        self._skew_ms = 0  # from the link's clock to the one that messages carry

    def receive(self, data: bytes, now_ms: int) -> list[Message]:
        """Return the requests in these bytes: Hello (accepted), Contacts, Perform, Grant, Bye.

        Args:
            data: What came over the link, cut anywhere.
            now_ms: The link's clock.
        """
        requests: list[Message] = []
        for packet in self._decoder.feed(data):
            if isinstance(packet.message, Hello):
                requests += self._greet(packet, packet.message, now_ms)
            elif self._is_next(packet):
                requests += self._take(packet, now_ms)
            else:
                self.ignored += 1
        return requests

    def send(self, message: Message, t_ms: int, now_ms: int) -> None:
        """Say something to the host; without one it is dropped, never kept for the next.

        Args:
            message: What to say.
            t_ms: The device's time that it belongs to.
            now_ms: The link's clock.

        Raises:
            ProtocolError: The wire cannot carry it.
        """
        if not self.live or len(self.output) > (GRANTED_BACKLOG if self.granted else BACKLOG):
            self.dropped += 1
            return
        self._skew_ms = t_ms - now_ms
        self._sequence = (self._sequence + 1) & 0xFFFF
        self.output += encode(message, session=self.number, sequence=self._sequence, t_ms=t_ms)

    def tick(self, now_ms: int) -> list[Message]:
        """Send the heartbeat when it is due; return Bye if the host has been silent for too long.

        Granted time knows neither: the host may think for as long as it likes.
        """
        if not self.live or self.granted:
            return []
        if now_ms - self._heard_ms > SILENCE_MS:
            return self.end(f"the host was silent for {SILENCE_MS / 1000:g} s")
        if now_ms - self._beat_ms >= self._welcome.heartbeat_ms:
            # On the beat, not one pause after the last one, unless that is long ago.
            late_ms = (now_ms - self._beat_ms) % self._welcome.heartbeat_ms
            self._beat_ms = now_ms - late_ms
            self.send(Heartbeat(self._echo_ms), now_ms + self._skew_ms, now_ms)
        return []

    def end(self, reason: str) -> list[Message]:
        """End the session from this side, without a word; return it as the host's Bye, if live."""
        if not self.live:
            return []
        self.live = False
        self.output.clear()
        return [Bye(reason)]

    def _greet(self, packet: Packet, hello: Hello, now_ms: int) -> list[Message]:
        """Answer Hello with Welcome and State, or with Refuse."""
        ended = self.end("the host started anew")
        self.output[:] = b"\0"  # ends a frame that an earlier session got half of
        self._sequence = self._taken = packet.sequence
        self._heard_ms = self._beat_ms = now_ms
        self._echo_ms, self._skew_ms = packet.t_ms, 0
        reason = self._objection(hello)
        if reason:
            self.output += encode(Refuse(reason), session=0, sequence=packet.sequence, t_ms=now_ms)
            return ended
        self.number = self.number % 0xFFFF + 1  # never 0
        self.live, self.granted = True, hello.granted
        self.output += encode(self._welcome, session=self.number, sequence=packet.sequence, t_ms=0)
        self.send(State(()), 0, now_ms)
        return [hello]

    def _objection(self, hello: Hello) -> str:
        """Return why this host cannot be welcomed, or "" if it can."""
        if not hello.version_min <= VERSION <= hello.version_max:
            side = "host" if hello.version_max < VERSION else "orb's controller"
            return (
                f"the orb speaks protocol version {VERSION}, the host {_versions(hello)}; "
                f"update the {side}"
            )
        if self._token and not hmac.compare_digest(self._token, hello.token.encode()):
            return "this orb answers only to the program that started it; start one of your own"
        if hello.granted and not self._welcome.virtual:
            return "only a virtual orb's time can be granted; connect in real time"
        if self.busy:
            return "already connected to another host; close that one first"
        return ""

    def _is_next(self, packet: Packet) -> bool:
        """Return whether a packet is of this session and new."""
        return (
            self.live
            and packet.message is not None
            and packet.session == self.number
            and is_ahead(packet.sequence, self._taken)
        )

    def _take(self, packet: Packet, now_ms: int) -> list[Message]:
        """Take one packet of the live session: the request in it, if it is one."""
        self._taken, self._heard_ms = packet.sequence, now_ms
        self._echo_ms = packet.t_ms
        message = packet.message
        if isinstance(message, Bye):
            self.end(message.reason)
            return [message]
        if isinstance(message, Heartbeat):
            return []
        if self._welcome.virtual and (
            isinstance(message, Contacts | Perform) or (isinstance(message, Grant) and self.granted)
        ):
            return [message]
        self.ignored += 1
        return []


def _versions(hello: Hello) -> str:
    if hello.version_min == hello.version_max:
        return f"version {hello.version_min}"
    return f"versions {hello.version_min} to {hello.version_max}"
