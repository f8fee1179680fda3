"""Packets, as docs/protocol.md specifies them, and what both ends of a session have in common."""

import struct
import zlib
from collections import deque
from collections.abc import Mapping
from typing import Final, NamedTuple

from controller.shared.protocol import codec
from controller.shared.protocol import teaching as teaching  # registers its messages
from controller.shared.protocol.auth import SIZE as TAG
from controller.shared.protocol.auth import FrameAuthenticator
from controller.shared.protocol.codec import ProtocolError
from controller.shared.protocol.messages import (
    MAX_PAYLOAD,
    TYPES,
    VERSION,
    Hello,
    Message,
    Refuse,
)

EVERY_VERSION: Final = (TYPES[Hello][0], TYPES[Refuse][0])  # their layout never changes
_CODECS: Final = dict(TYPES.values())
NEVER: Final = 0xFFFFFFFF  # hold time before the first heartbeat
_WINDOW: Final = 32  # samples, 3 s of heartbeats; the one with the shortest round trip counts
_LONGEST_MS: Final = 10_000  # longest valid round trip
_GRAIN_MS: Final = 2  # rounding and drift between two samples


class Packet(NamedTuple):
    """One message with its header.

    message is None if the version is another than ours, or if its authentication fails.
    """

    session: int
    sequence: int
    t_ms: int
    version: int
    message: Message | None


def encode(
    message: Message,
    *,
    session: int,
    sequence: int,
    t_ms: int,
    seal: FrameAuthenticator | None = None,
) -> bytes:
    """Return a message as one frame, the closing zero included.

    `session` and `sequence` are u16; `t_ms`, the sender's time in milliseconds, wraps at 2**32. A
    Command is sent as NumberedCommand. ProtocolError if a field does not fit the wire format.
    """
    try:
        kind, record = TYPES[type(message)]
        first = VERSION << 4 | (SEALED if seal else 0)
        head = _HEADER.pack(first, kind, session, sequence, t_ms & 0xFFFFFFFF)
        body = head + record.write(message)
    except KeyError:
        raise ProtocolError(f"{type(message).__name__} is never sent by itself") from None
    except (struct.error, ValueError, OverflowError, TypeError) as error:
        raise ProtocolError(f"cannot send {type(message).__name__}: {error}") from None
    if len(body) > _HEADER.size + MAX_PAYLOAD:
        size = len(body) - _HEADER.size
        raise ProtocolError(
            f"{type(message).__name__} has {size} bytes of payload; {MAX_PAYLOAD} fit in a packet"
        )
    if seal:
        body += seal.tag(body, sequence)
    return codec.cobs_encode(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0"


class Decoder:
    """Decoding of a noisy byte stream to packets.

    Attributes:
        seal: Authentication that frames other than Hello and Refuse need from now on; None: none.
    """

    def __init__(self) -> None:
        self.seal: FrameAuthenticator | None = None
        self._tail = b""
        self._skipping = False  # the present run is too long for a frame

    def feed(self, data: bytes) -> list[Packet]:
        """Return the packets that these bytes complete. Takes any bytes, never raises."""
        *runs, tail = data.split(b"\0")
        packets: list[Packet] = []
        for run in runs:
            whole, skipped = self._tail + run, self._skipping
            self._tail, self._skipping = b"", False
            if not whole or skipped:
                continue
            try:
                packet = _parse(whole, self.seal)
            except codec.BAD_BYTES:  # noise is dropped
                continue
            if packet is not None:  # so are types that this version does not know
                packets.append(packet)
        self._tail += tail
        if self._skipping or len(self._tail) > MAX_FRAME:
            self._tail, self._skipping = b"", True
        return packets


class ClockSync:
    """Estimate of the peer's clock from heartbeats, in whole milliseconds.

    Each carries the sender's clock, the newest clock reading received, and the time since. Both
    ends estimate as NTP does (RFC 5905, section 8).

    Attributes:
        rtt_ms: The newest round trip; None: not measured yet.
        offset_ms: The peer's clock minus ours, with an error of half a round trip at most; None:
            unknown.
    """

    def __init__(self) -> None:
        """Begin without a measurement."""
        self.rtt_ms: int | None = None
        self.offset_ms: int | None = None
        # (round trip, offset, upper limit of the offset)
        self._samples: deque[tuple[int, int, int]] = deque(maxlen=_WINDOW)
        self._most_ms = 0
        self._theirs_ms = 0  # the newest clock reading of the peer
        self._taken_ms: int | None = None  # our time of that

    def stamps(self, now_ms: int) -> tuple[int, int, int]:
        """Return the clock fields of the next heartbeat: ours, the peer's, and its hold time."""
        if self._taken_ms is None:
            return now_ms & 0xFFFFFFFF, 0, NEVER
        return now_ms & 0xFFFFFFFF, self._theirs_ms, min(now_ms - self._taken_ms, NEVER - 1)

    def take(self, sent_ms: int, echo_ms: int, held_ms: int, now_ms: int) -> None:
        """Take the clock fields of a heartbeat; impossible ones are no measurement."""
        self._theirs_ms, self._taken_ms = sent_ms, now_ms
        if held_ms == NEVER:
            return
        rtt_ms = signed(now_ms - echo_ms - held_ms)
        if not 0 <= rtt_ms <= _LONGEST_MS:
            return
        offset_ms = signed(sent_ms + rtt_ms // 2 - now_ms)
        if self._samples and self.offset_ms is not None:
            best_ms = min(self._samples)[0]
            if abs(signed(offset_ms - self.offset_ms)) > (rtt_ms + best_ms) / 2 + _GRAIN_MS:
                self._samples.clear()  # inconsistent: a clock was set
        # The peer received our heartbeat after we sent it, which limits the offset.
        self._samples.append((rtt_ms, offset_ms, signed(sent_ms - held_ms - echo_ms)))
        self.rtt_ms, self.offset_ms = rtt_ms, min(self._samples)[1]
        self._most_ms = min(most_ms for _, _, most_ms in self._samples)

    def age_ms(self, sent_ms: int, now_ms: int) -> int | None:
        """Return the greatest possible age of an event stamped by the peer; None: unknown.

        It exceeds the true age by the shortest one-way delay, which cannot be measured.
        """
        return None if self.offset_ms is None else signed(now_ms - sent_ms + self._most_ms)


def signed(value: int) -> int:
    """Return a difference of two u32 clocks, across the wrap."""
    return (value + 0x80000000 & 0xFFFFFFFF) - 0x80000000


class SessionEnd:
    """Common parts of both ends of a session: state, packet numbers, authentication, output.

    Attributes:
        state: The state, of its table in `controller.shared.protocol.states`.
        number: The session's number.
        output: Bytes to send; the owner of the link takes them from the front.
        clock: Round trip and clock offset.
    """

    def __init__(
        self, next_states: Mapping[tuple[str, str], str], state: str, number: int, key: bytes
    ) -> None:
        """Begin in a state, before the first packet."""
        self.state = state
        self.number = number
        self.output = bytearray()
        self.clock = ClockSync()
        self._next_states, self._key = next_states, key
        self._decoder = Decoder()
        self._seal: FrameAuthenticator | None = None  # of what is sent
        self._sequence = 0  # of the newest packet sent
        self._taken = 0  # sequence of the newest packet taken
        self._heard_ms = 0  # time of that
        self._beat_ms = 0  # when the last heartbeat was sent

    def _go(self, event: str) -> None:
        """Change the state by the table."""
        self.state = self._next_states[self.state, event]

    def _take_number(self, packet: Packet, now_ms: int) -> None:
        self._taken, self._heard_ms = packet.sequence, now_ms

    def _put(self, message: Message, t_ms: int) -> None:
        """Append a message to the output as the next packet."""
        sequence = (self._sequence + 1) & 0xFFFF
        self.output += encode(
            message, session=self.number, sequence=sequence, t_ms=t_ms, seal=self._seal
        )
        self._sequence = sequence


def is_ahead(sequence: int, last: int) -> bool:
    """Return whether a packet is newer than the last one, across the wrap at 65536."""
    return 0 < (sequence - last) & 0xFFFF < 0x8000


_HEADER = struct.Struct("<BBHHI")  # version and flags, type, session, sequence, t_ms
SEALED = 0b0100  # the flag of a frame with a tag
_INCOMPATIBLE = 0b1100  # flags that a receiver may not ignore
_LARGEST = _HEADER.size + MAX_PAYLOAD + TAG + 4
MAX_FRAME = _LARGEST + -(-_LARGEST // 254)  # bytes, without the closing zero


def _parse(run: bytes, seal: FrameAuthenticator | None) -> Packet | None:
    """Return the packet of one frame, None if its type is unknown; raise if it is invalid."""
    if len(run) > MAX_FRAME:
        raise ProtocolError("too long for a frame")
    frame = codec.cobs_decode(run)
    body = frame[:-4]
    if len(body) < _HEADER.size:
        raise ProtocolError("too short for a packet")
    if zlib.crc32(body) != int.from_bytes(frame[-4:], "little"):
        raise ProtocolError("wrong checksum")
    first, kind, session, sequence, t_ms = _HEADER.unpack_from(body)
    version = first >> 4
    record = _CODECS.get(kind)
    if version != VERSION and kind not in EVERY_VERSION:
        return Packet(session, sequence, t_ms, version, None)
    if first & _INCOMPATIBLE or seal is not None:
        if first & _INCOMPATIBLE & ~SEALED or (seal is None and first & SEALED):
            raise ProtocolError("unknown incompatible flags")
        if first & SEALED and seal is not None:
            body, tag = body[:-TAG], body[-TAG:]
            if len(body) < _HEADER.size or not seal.confirms(body, sequence, tag):
                return Packet(session, sequence, t_ms, version, None)
        elif kind not in EVERY_VERSION:
            return Packet(session, sequence, t_ms, version, None)
    if record is None:
        return None
    if len(body) > _HEADER.size + MAX_PAYLOAD:
        raise ProtocolError("too long for a packet")
    message, end = record.read(body, _HEADER.size)
    if end != len(body):
        raise ProtocolError("bytes are left over")
    return Packet(session, sequence, t_ms, version, message)
