"""The wire between the orb and its host: messages, packets, and bytes.

This docstring is the specification; the tables below it are its executable form. The module is
sans-IO (bytes in, packets out; no clock, no port) and needs the standard library only. Numbers are
little endian. The device offers, the host connects: one host at a time.

Frame
    ``COBS(header, payload, crc) 0x00``. COBS (consistent overhead byte stuffing) leaves no zero in
    a frame, so 0x00 ends it and a reader that comes in the middle is in step after the next zero.
    ``crc`` is the CRC-32 (zlib's) of header and payload, u32. The payload has at most 1024 bytes; a
    run of more than 1043 bytes without a zero is no frame and is dropped as it comes.

    ========= === =================================================================
    header        (10 bytes)
    ========= === =================================================================
    version   u4  high nibble of the first byte: the version of the payload, 1
    flags     u4  low nibble: 1, 2 may be ignored by who does not know them;
                  4, 8 may not: the frame is rejected. Version 1 sends 0
    type      u8  which message, see the table
    session   u16 the session's number, chosen by the device; 0: none yet
    sequence  u16 one more for every packet of a direction, wraps
    t_ms      u32 the sender's time when it was sent, milliseconds, wraps
    ========= === =================================================================

Messages (fields in wire order; H: the host sends it, D: the device)
    ==== =========== === ================================================================
    type message         payload
    ==== =========== === ================================================================
    1    Hello       H   version_min u8, version_max u8, token text64, host text64,
                         granted bool
    2    Welcome     D   version u8, boot_nonce u32, device_id text64, name text64,
                         virtual bool, rows size, columns size, pitch_mm f32, rate_hz f32,
                         heartbeat_ms span, deadman_ms span, labels names, commands names
    3    Refuse      D   reason text500
    4    Bye         H,D reason text500
    5    Heartbeat   H,D echo_ms u32
    16   Command     D   name text40, label text40, probability share, touch point, frame u32
    17   State       D   pressed names
    18   Telemetry   D   frame u32, image image, probabilities shares, touch point,
                         gesture text40, ready bool, rate_hz f32
    19   Truth       D   number u32, label text40, onset_ms u32, release_ms u32
    20   Granted     D   until_ms u32
    21   Health      D   found: u8 count <= 8, each text120
    32   Contacts    H   contacts: u8 count <= 16, each id u16, x f32, y f32, depth_mm f32,
                         radius_mm f32
    33   Perform     H   number u32, label text40, x f32, y f32
    34   Grant       H   until_ms u32
    ==== =========== === ================================================================

    bool is u8, 0 or 1. size is u8 >= 1, span is u16 >= 1 (milliseconds). f32 is finite; share is an
    f32 in 0..1. textN is u8 or (N > 255) u16 length, then so many bytes of UTF-8, at most N, all
    printable. names is u8 count <= 64, each text40. shares is u8 count, each u8 / 255. image is u16
    count <= 900, each u8, see `quantise_image`. point is u8 0 for none, or u8 1, x f32, y f32.
    Whatever breaks a rule, or leaves bytes over, is a bad frame.

What a receiver does
    Bad frames (COBS, CRC, incompatible flags, payload) are dropped and counted; unknown types are
    ignored and counted. Of a foreign version only the header is understood, and Hello and Refuse,
    which are the same in every version; so each side can tell its user which one to update.

Handshake
    The host opens the link and sends Hello (session 0, any sequence, best a random one); nothing
    else is accepted before. The device answers with Welcome, whose header has the new session's
    number, or with Refuse; both repeat the Hello's sequence, which tells them from remains of an
    earlier host in some buffer, and a 0x00 before Hello and its answer ends such remains. Both
    sides count on from there. State(()) follows Welcome at once.
    Another Hello at any time starts a new session; packets of another session are ignored. Without
    an answer within 2 s the host closes the link and tries again.

Once
    A packet is taken once per (session, sequence): only if its sequence is ahead of the last one
    taken, by 1 to 32767 modulo 65536 (`is_ahead`). Commands are sent at once or never: a device
    without a session drops them. State is a snapshot of what is held, and repairs anything.

Life
    Each side sends Heartbeat every heartbeat_ms. When nothing valid came for deadman_ms the host
    releases everything and pauses; after 1 s it closes the link and connects anew. The device
    forgets a host that was silent for 2 s.

Granted time
    A host that says ``granted`` in Hello owns the clock of a virtual device: Grant(t) lets it step
    exactly to t (milliseconds since the session's Welcome), and Granted(t) follows every packet up
    to t; a device may stop short of a t that is far off, and says so in Granted. What the host sent
    before a Grant is done before that step. No heartbeats are sent and no silence counts, except
    that a device with a Grant to answer says something every 2 s of the wall clock.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from controller import wire
from controller.wire import ProtocolError as ProtocolError

VERSION = 1  # of the payloads: the upper nibble of every packet
MAX_PAYLOAD = 1024  # bytes
COMMANDS = ("left", "right", "down", "drop", "rotate_cw", "rotate_ccw", "hold", "pause")
HEARTBEAT_MS = 100  # between two heartbeats, each way
DEADMAN_MS = 300  # without a valid packet: release everything, pause
LOST_MS = 1000  # without a valid packet: close, and connect anew
SILENCE_MS = 2000  # a device forgets a host, a host gives up on an answer


@dataclass(frozen=True, slots=True)
class Hello:
    """Host to device, first: who connects. Sent again at any time, it starts a new session."""

    version_min: int
    version_max: int
    token: str  # "" when none
    host: str  # a name for the log
    granted: bool  # "I shall grant time": virtual devices only


@dataclass(frozen=True, slots=True)
class Welcome:
    """Device to host: the answer; the session in its header is the number from here on."""

    version: int  # the one chosen
    boot_nonce: int  # u32, drawn at each start of the device
    device_id: str  # serial number; "virtual-SEED"
    name: str
    virtual: bool  # takes Contacts, Perform, Grant
    rows: int
    columns: int
    pitch_mm: float
    rate_hz: float
    heartbeat_ms: int
    deadman_ms: int
    labels: tuple[str, ...]
    commands: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Refuse:
    """Device to host, in place of Welcome: why not, in one sentence."""

    reason: str


@dataclass(frozen=True, slots=True)
class Bye:
    """Either side, before it closes: why."""

    reason: str


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Either side, ten times a second: alive, and the newest t_ms seen from the other (or 0)."""

    echo_ms: int


@dataclass(frozen=True, slots=True)
class Command:
    """Device to host: the player asked for something. Delivered once."""

    name: str
    label: str  # the gesture that it was
    probability: float
    touch: tuple[float, float] | None  # (x, y), grid units
    frame: int


@dataclass(frozen=True, slots=True)
class State:
    """Device to host: everything that is held now; () right after Welcome."""

    pressed: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Telemetry:
    """Device to host, one per frame: what the device feels and believes."""

    frame: int
    image: bytes  # rows * columns, top row first: `quantise_image`
    probabilities: tuple[float, ...]  # in the order of Welcome.labels; steps of 1/255
    touch: tuple[float, float] | None  # (x, y), grid units
    gesture: str  # the label held by the debouncer; "" if none
    ready: bool  # False while the rest image is being taken
    rate_hz: float  # measured


@dataclass(frozen=True, slots=True)
class Truth:
    """Virtual device to host, when a performance has ended: what its hand really did, and when."""

    number: int
    label: str
    onset_ms: int
    release_ms: int


@dataclass(frozen=True, slots=True)
class Granted:
    """Virtual device to host: every packet up to here has been sent before this one."""

    until_ms: int


@dataclass(frozen=True, slots=True)
class Health:
    """Device to host: what is not as it should be with the sensor, and what to do; () if nothing.

    A snapshot, sent when it changes and once to every new host if there is something to tell.
    """

    found: tuple[str, ...]  # sentences, worst first


@dataclass(frozen=True, slots=True)
class Contact:
    """One finger on the membrane: where (grid units), how deep and how wide (mm)."""

    id: int
    x: float
    y: float
    depth_mm: float
    radius_mm: float


@dataclass(frozen=True, slots=True)
class Contacts:
    """Host to virtual device: all fingers that touch now; () lifts them all."""

    contacts: tuple[Contact, ...]


@dataclass(frozen=True, slots=True)
class Perform:
    """Host to virtual device: let your own hand do this gesture, or "brush" or "rest", now."""

    number: int
    label: str
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class Grant:
    """Host to virtual device: step exactly to here."""

    until_ms: int


Message = (
    Hello | Welcome | Refuse | Bye | Heartbeat | Command | State | Telemetry | Truth | Granted
    | Health | Contacts | Perform | Grant
)  # fmt: skip


class Packet(NamedTuple):
    """One message with its header; message is None where a foreign version hides it."""

    session: int
    sequence: int
    t_ms: int
    version: int
    message: Message | None


def encode(message: Message, *, session: int, sequence: int, t_ms: int) -> bytes:
    """Return a message as one frame, the closing zero included.

    Args:
        message: What to say.
        session: The session's number, u16.
        sequence: The packet's number, u16.
        t_ms: The sender's time in milliseconds; it wraps at 2**32.

    Raises:
        ProtocolError: A field has no place on the wire: too long, too large, not finite.
    """
    kind, record = _KINDS[type(message)]
    try:
        head = _HEADER.pack(VERSION << 4, kind, session, sequence, t_ms & 0xFFFFFFFF)
        body = head + record.write(message)
    except (struct.error, ValueError, OverflowError, TypeError) as error:
        raise ProtocolError(f"cannot send {type(message).__name__}: {error}") from None
    if len(body) > _HEADER.size + MAX_PAYLOAD:
        size = len(body) - _HEADER.size
        raise ProtocolError(
            f"{type(message).__name__} has {size} bytes of payload; {MAX_PAYLOAD} fit in a packet"
        )
    return wire.cobs_encode(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0"


class Decoder:
    """From bytes, cut anywhere and with noise in between, to packets.

    Attributes:
        noise_bytes: Bytes dropped because they were part of no valid frame.
        bad_frames: Runs of bytes between two zeros that were no valid frame.
        unknown: Valid frames whose type this version does not know.
    """

    def __init__(self) -> None:
        self.noise_bytes = 0
        self.bad_frames = 0
        self.unknown = 0
        self._tail = b""
        self._skipping = False  # the present run is too long to become a frame

    def feed(self, data: bytes) -> list[Packet]:
        """Return the packets that these bytes complete. Takes any bytes, never raises."""
        *runs, tail = data.split(b"\0")
        packets: list[Packet] = []
        if runs:
            self._finish(self._tail + runs[0], packets)
            for run in runs[1:]:
                self._finish(run, packets)
            self._tail = b""
        self._keep(tail)
        return packets

    def _finish(self, run: bytes, packets: list[Packet]) -> None:
        """Turn one run between two zeros into a packet, or count it as dropped."""
        if self._skipping:
            self._skipping = False
            self.noise_bytes += len(run)
        elif run:
            try:
                packet = _parse(run)
            except wire.BAD_BYTES:
                self.bad_frames += 1
                self.noise_bytes += len(run)
            else:
                if packet is None:
                    self.unknown += 1
                else:
                    packets.append(packet)

    def _keep(self, tail: bytes) -> None:
        """Remember the beginning of a frame, but never more than a frame can have."""
        self._tail += tail
        if self._skipping or len(self._tail) > MAX_FRAME:
            self.bad_frames += not self._skipping
            self.noise_bytes += len(self._tail)
            self._tail, self._skipping = b"", True


def is_ahead(sequence: int, last: int) -> bool:
    """Return whether a packet is newer than the last one taken, across the wrap at 65536."""
    return 0 < (sequence - last) & 0xFFFF < 0x8000


def quantise_image(values: Iterable[float]) -> bytes:
    """Return relative capacitances z as bytes: steps of 0.005, 128 untouched, z 0.36 to 1.635.

    Raises:
        ProtocolError: A value is not finite.
    """
    try:
        return bytes([min(max(round((z - 1.0) * 200.0) + 128, 0), 255) for z in values])
    except (ValueError, OverflowError):
        raise ProtocolError("an image must be finite to be sent") from None


def image_from_bytes(image: bytes) -> list[float]:
    """Return the z of each byte of Telemetry.image: the inverse of `quantise_image`."""
    return [_Z[value] for value in image]


_HEADER = struct.Struct("<BBHHI")  # version and flags, type, session, sequence, t_ms
_INCOMPATIBLE = 0b1100  # flags that may not be ignored
_LARGEST = _HEADER.size + MAX_PAYLOAD + 4
MAX_FRAME = _LARGEST + -(-_LARGEST // 254)  # bytes, without the closing zero
_Z = tuple(1.0 + (value - 128) / 200.0 for value in range(256))


def _parse(run: bytes) -> Packet | None:
    """Return the packet of one frame, or None if its type is unknown; raise if it is none."""
    if len(run) > MAX_FRAME:
        raise ProtocolError("too long for a frame")
    frame = wire.cobs_decode(run)
    body = frame[:-4]
    if not _HEADER.size <= len(body) <= _HEADER.size + MAX_PAYLOAD:
        raise ProtocolError("too short or too long for a packet")
    if zlib.crc32(body) != int.from_bytes(frame[-4:], "little"):
        raise ProtocolError("wrong checksum")
    first, kind, session, sequence, t_ms = _HEADER.unpack_from(body)
    version = first >> 4
    record = _RECORDS.get(kind)
    if version != VERSION and kind not in _EVERY_VERSION:
        return Packet(session, sequence, t_ms, version, None)
    if first & _INCOMPATIBLE:
        raise ProtocolError("unknown incompatible flags")
    if record is None:
        return None
    message, end = record.read(body, _HEADER.size)
    if end != len(body):
        raise ProtocolError("bytes are left over")
    return Packet(session, sequence, t_ms, version, message)


def _tables() -> tuple[dict[type, tuple[int, wire.Record]], dict[int, wire.Record]]:
    """Return the table of the docstring, by message class and by type number."""
    u8, u32, f32, size, span, share = wire.U8, wire.U32, wire.F32, wire.SIZE, wire.SPAN, wire.SHARE
    flag, point, shares, image = wire.BOOL, wire.POINT, wire.SHARES, wire.octets(900)
    text, sentence, name = wire.text(64), wire.text(500), wire.text(40)
    names = wire.many(name, 64)
    contact = wire.Record(Contact, (wire.U16, f32, f32, f32, f32))
    table: tuple[tuple[int, type, tuple[wire.Kind, ...]], ...] = (
        (1, Hello, (u8, u8, text, text, flag)),
        (2, Welcome, (u8, u32, text, text, flag, size, size, f32, f32, span, span, names, names)),
        (3, Refuse, (sentence,)),
        (4, Bye, (sentence,)),
        (5, Heartbeat, (u32,)),
        (16, Command, (name, name, share, point, u32)),
        (17, State, (names,)),
        (18, Telemetry, (u32, image, shares, point, name, flag, f32)),
        (19, Truth, (u32, name, u32, u32)),
        (20, Granted, (u32,)),
        (21, Health, (wire.many(wire.text(120), 8),)),
        (32, Contacts, (wire.many(contact, 16),)),
        (33, Perform, (u32, name, f32, f32)),
        (34, Grant, (u32,)),
    )
    records = {number: wire.Record(message, kinds) for number, message, kinds in table}
    return {message: (number, records[number]) for number, message, _ in table}, records


_KINDS, _RECORDS = _tables()
_EVERY_VERSION = (_KINDS[Hello][0], _KINDS[Refuse][0])  # their layout never changes
