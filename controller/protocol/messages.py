"""The wire between the orb and its host: messages, packets, and bytes.

This docstring is the specification; the tables below it are its executable form. The module is
sans-IO (bytes in, packets out; no clock, no port) and needs the standard library only. Numbers are
little endian. The device offers, the host connects: one host at a time.

Frame
    ``COBS(header, payload, tag, crc) 0x00``. COBS (consistent overhead byte stuffing) leaves no
    zero in a frame, so 0x00 ends it and a reader that comes in the middle is in step after the next
    zero. ``crc`` is the CRC-32 (zlib's) of all before it, u32. ``tag`` is there in sealed frames
    only: 8 bytes over header and payload, see `controller.protocol.auth`. The payload has at most
    1024 bytes; a run of more than 1051 bytes without a zero is no frame and is dropped as it comes.

    ========= === =================================================================
    header        (10 bytes)
    ========= === =================================================================
    version   u4  high nibble of the first byte: the version of the payload, 2
    flags     u4  low nibble: 1, 2 may be ignored by who does not know them;
                  4, 8 may not: the frame is rejected. 4: the frame is sealed
    type      u8  which message, see the table
    session   u16 the session's number, chosen by the device; 0: none yet
    sequence  u16 one more for every packet of a direction, wraps
    t_ms      u32 the sender's time that the message belongs to, milliseconds, wraps
    ========= === =================================================================

Messages (fields in wire order; H: the host sends it, D: the device)
    ==== =================== === ================================================================
    type message                 payload
    ==== =================== === ================================================================
    1    Hello               H   version_min u8, version_max u8, token text64, host text64,
                                 granted bool
    2    Welcome             D   version u8, boot_nonce u32, device_id text64, name text64,
                                 virtual bool, rows size, columns size, pitch_mm f32, rate_hz f32,
                                 heartbeat_ms span, deadman_ms span, labels names, commands names,
                                 resumed bool, done u32
    3    Refuse              D   reason text500
    4    Bye                 H,D reason text500
    5    Heartbeat           D   sent_ms u32, echo_ms u32, held_ms u32, done u32, pressed names
    6    Offer               D   version u8, nonce octets32, keyed bool
    16   NumberedCommand     D   name text40, label text40, probability share, touch point,
                                 frame u32, number u32, done u32, sent_ms u32
    17   State               D   pressed names
    18   Telemetry           D   frame u32, image image, probabilities shares, touch point,
                                 gesture text40, ready bool, rate_hz f32
    19   GroundTruth         D   number u32, label text40, onset_ms u32, release_ms u32
    20   Granted             D   until_ms u32
    21   Health              D   found: u8 count <= 8, each text120
    22   UploadStatus        D   state u8, offset u32, told text500
    23   LatencyReport       D   period_ms f32, missed u32, hops: u8 count <= 16, each name text40,
                                 p50_ms f32, p95_ms f32, p99_ms f32
    24   UserIdentified      D   user text40, confidence share
    25   PositionUncertainty D   frame u32, sigma f32 >= 0
    32   Contacts            H   contacts: u8 count <= 16, each id u16, x f32, y f32, depth_mm f32,
                                 radius_mm f32
    33   Perform             H   number u32, label text40, x f32, y f32
    34   Grant               H   until_ms u32
    35   Join                H   token text64, host text64, granted bool, host_nonce u32 >= 1,
                                 boot_nonce u32, done u32
    36   HostHeartbeat       H   sent_ms u32, echo_ms u32, held_ms u32, done u32, missed u32
    48   UploadOffer         H   digest octets32, size u32, name text64
    49   UploadChunk         H   offset u32, data octets1000
    50   Correction          H   label text40
    ==== =================== === ================================================================

    bool is u8, 0 or 1. size is u8 >= 1, span is u16 >= 1 (milliseconds). f32 is finite; share is an
    f32 in 0..1. textN is u8 or (N > 255) u16 length, then so many bytes of UTF-8, at most N, all
    printable; octetsN the same with any bytes. names is u8 count <= 64, each text40. shares is u8
    count, each u8 / 255. image is u16 count <= 900, each u8, see `quantise_image`. point is u8 0
    for none, or u8 1, x f32, y f32. Whatever breaks a rule, or leaves bytes over, is a bad frame.

What a receiver does
    Bad frames (COBS, CRC, incompatible flags, payload) are dropped and counted; unknown types are
    ignored and counted. Of a foreign version only the header is understood, and Hello and Refuse,
    which are the same in every version; so each side can tell its user which one to update. A side
    takes only messages that the other side sends, so a line that echoes is not a device.

Handshake
    The host opens the link and sends Hello (session 0, any sequence, best a random one; token is 32
    hex digits, drawn for this session, host is "", granted is False); nothing else is accepted
    before. The device answers with Offer, whose header has the new session's number, or with
    Refuse; both repeat the Hello's sequence, which tells them from remains of an earlier host in
    some buffer, and a 0x00 before Hello and its answer ends such remains. Both sides count on from
    there. The host sends Join, and the device answers with Welcome, or Refuse. State(()) follows
    Welcome at once.

    Another Hello at any time starts a new session; packets of another session are ignored. Without
    a session 2 s after Hello each side gives up; the host closes the link and tries again.
    `controller.protocol.states` has all states and what leads from one to another.

    If Offer says ``keyed``, every frame from Join on is sealed with the key that both have, and
    frames that are not are not taken, Hello and Refuse apart; a side with a key ends the handshake
    with one that has none. So before it has proved that it knows the key a host learns the version,
    a random number, and that there is a key.

Once
    A packet is taken once per (session, sequence): only if its sequence is ahead of the last one
    taken, by 1 to 32767 modulo 65536 (`is_ahead`).

    Commands have numbers of their own, counted from the device's start, and are sent until the host
    acknowledges them: ``done`` in HostHeartbeat is the newest number that it has taken or missed,
    and is sent every heartbeat_ms and at once after a command. What is not acknowledged after 50
    ms, or two round trips if that is more, is sent again, in order; after 250 ms it is given up.
    ``done`` of the device is the newest number that it will not send again. The host takes number
    after number; what the device is done with and never came, what comes 250 ms late, and what
    comes out of a silence of 300 ms, is missed, and counted in ``missed``.

    A host that comes back (host_nonce, boot_nonce: drawn at each start of the host and of the
    device) says in Join up to where it is done, and the device goes on behind that: ``resumed``.
    Any other host begins behind all that was, at Welcome's ``done``.

    State is a snapshot of what is held, and ``pressed`` in Heartbeat repeats it, so that it repairs
    anything.

Life
    Device and host send Heartbeat and HostHeartbeat every heartbeat_ms, and measure with them round
    trip and clock offset: sent_ms is the sender's link clock, echo_ms the newest one that came from
    the other side, held_ms how long ago that was (2**32 - 1: none yet). The answer to Join begins
    it: t_ms of Welcome is the device's link clock. When nothing valid came for 300 ms, whatever
    deadman_ms says, the host releases everything and pauses; after 1 s it closes the link and
    connects anew. The device forgets a host that was silent for 2 s.

Deliveries
    A host may send the device a new bundle: UploadOffer (its SHA-256, its size), then UploadChunks
    of it. The device answers each with UploadStatus: state 0 and how much it has, from which it
    wants more; 1 when it has all and proves it; 2 when the bundle is in use, before it ends the
    session to begin anew with it; 3 when it does not take it, and why. What it has outlives the
    session, so a host that comes back sends UploadOffer again and goes on. Only a link that proves
    who is there takes any.

    Correction(label) says what the latest touch was ("null": no gesture; "": take the last
    correction back). The device learns it beside its play, with the same answers: UploadStatus 1
    while it learns, then 2 or 3.

Granted time
    A host that says ``granted`` in Join owns the clock of a virtual device: Grant(t) lets it step
    exactly to t (milliseconds since the session's Welcome), and Granted(t) follows every packet up
    to t; a device may stop short of a t that is far off, and says so in Granted. What the host sent
    before a Grant is done before that step. No heartbeats are sent and no silence counts, except
    that a device with a Grant to answer says something every 2 s of the wall clock. Commands are
    sent once and not acknowledged: such a link is a pipe to a process of the host's own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from controller.protocol import codec
from controller.protocol.codec import ProtocolError

VERSION = 2  # of the payloads: the upper nibble of every packet
MAX_PAYLOAD = 1024  # bytes
COMMANDS = ("left", "right", "down", "drop", "rotate_cw", "rotate_ccw", "hold", "pause")
HEARTBEAT_MS = 100  # between two heartbeats, each way
DEADMAN_MS = 300  # without a valid packet: release everything, pause
LOST_MS = 1000  # without a valid packet: close, and connect anew
SILENCE_MS = 2000  # a device forgets a host, a host gives up on an answer
LATE_MS = 250  # a command that is older is not obeyed any more
PIECE = 1000  # bytes of a bundle in one packet
MAX_TEXT, MAX_SENTENCE = 64, 500  # bytes of UTF-8: `controller.protocol.codec.fitted`
WANTED, PROVING, IN_USE, DECLINED = range(4)  # states of a Delivery
RESEND_MS = 50  # until a command that is not acknowledged is sent again, at least


@dataclass(frozen=True, slots=True)
class Hello:
    """Host to device, first: who connects. Sent again at any time, it starts a new session.

    On the wire all but the versions is empty, and token a number drawn for the session; what the
    device's program is told has these fields from Join.
    """

    version_min: int
    version_max: int
    token: str  # "" when none
    host: str  # a name for the log
    granted: bool  # "I shall grant time": virtual devices only


@dataclass(frozen=True, slots=True)
class Offer:
    """Device to host: the answer to Hello; the session in its header is the number from here on."""

    version: int  # the one chosen
    nonce: bytes  # drawn for the session
    keyed: bool  # every frame from here on is to be sealed


@dataclass(frozen=True, slots=True)
class UploadOffer:
    """Host to device: there is a bundle for you."""

    digest: bytes  # SHA-256 of the file
    size: int  # bytes
    name: str  # of the file, for the log


@dataclass(frozen=True, slots=True)
class UploadChunk:
    """Host to device: some bytes of the bundle."""

    offset: int  # of the first
    data: bytes  # at most PIECE of them


@dataclass(frozen=True, slots=True)
class Correction:
    """Host to device: what the latest touch was, as its player says; learn it."""

    label: str  # of Welcome.labels; "": take the last correction back


@dataclass(frozen=True, slots=True)
class Join:
    """Host to device: who it is, and how far it is with the device's commands."""

    token: str  # "" when none
    host: str  # a name for the log
    granted: bool  # "I shall grant time": virtual devices only
    host_nonce: int  # u32, not 0, drawn at each start of the host
    boot_nonce: int  # of the device that it was connected to before
    done: int  # number of the last command that it knows of that one


@dataclass(frozen=True, slots=True)
class Welcome:
    """Device to host: the answer to Join, and what the device is and can do."""

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
    resumed: bool = False  # commands go on where this host is, else behind `done`
    done: int = 0  # number of the newest command that will not be sent (again)


@dataclass(frozen=True, slots=True)
class Refuse:
    """Device to host, in place of Offer or Welcome: why not, in one sentence."""

    reason: str


@dataclass(frozen=True, slots=True)
class Bye:
    """Either side, before it closes: why."""

    reason: str


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Device to host, ten times a second: alive; clocks as in `clock_sync`; what is held."""

    sent_ms: int
    echo_ms: int
    held_ms: int
    done: int  # number of the newest command that will not be sent again
    pressed: tuple[str, ...]  # as in State


@dataclass(frozen=True, slots=True)
class HostHeartbeat:
    """Host to device, ten times a second and after commands: alive, and what has been taken."""

    sent_ms: int
    echo_ms: int
    held_ms: int
    done: int  # number of the newest command that was taken, or missed
    missed: int  # how many were missed, since this host first met this device


@dataclass(frozen=True, slots=True)
class Command:
    """The player asked for something. Delivered once, or reported as missed."""

    name: str
    label: str  # the gesture that it was
    probability: float
    touch: tuple[float, float] | None  # (x, y), grid units
    frame: int


@dataclass(frozen=True, slots=True)
class NumberedCommand(Command):
    """Device to host: a command as it travels."""

    number: int  # counted from the device's start
    done: int  # number of the newest command that will not be sent again
    sent_ms: int  # the device's link clock when it was sent first


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
class GroundTruth:
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
class UploadStatus:
    """Device to host: how it stands with the bundle that the host sends."""

    state: int  # WANTED, PROVING, IN_USE, DECLINED
    offset: int  # bytes that are here
    told: str  # a sentence, or ""


@dataclass(frozen=True, slots=True)
class StageTime:
    """One part of a frame's way through the device, and how long it took, milliseconds."""

    name: str
    p50_ms: float
    p95_ms: float
    p99_ms: float


@dataclass(frozen=True, slots=True)
class LatencyReport:
    """Device to host, every second: where the time of the latest frames went, milliseconds."""

    period_ms: float  # from frame to frame: what there is to spend
    missed: int  # frames that could not be read in their time, since the start
    hops: tuple[StageTime, ...]  # in their order, the last one all of them together


@dataclass(frozen=True, slots=True)
class UserIdentified:
    """Device to host: who touches, as far as their touch tells; a convenience, never a proof.

    A snapshot, sent when it changes and once to every new host. A device that knows nobody sends
    none.
    """

    user: str  # "": nobody that it knows
    confidence: float  # how probable that is; without a user, of the most probable one


@dataclass(frozen=True, slots=True)
class PositionUncertainty:
    """Device to host, before what else it says of a frame: how sure the place of its touch is."""

    frame: int
    sigma: float  # deviation from where it truly is, of each axis, grid units


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
    Hello | Welcome | Refuse | Bye | Heartbeat | Offer | Command | NumberedCommand | State
    | Telemetry | GroundTruth | Granted | Health | UploadStatus | LatencyReport | UserIdentified
    | PositionUncertainty | Contacts | Perform | Grant | Join | HostHeartbeat | UploadOffer
    | UploadChunk | Correction
)  # fmt: skip


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


_Z = tuple(1.0 + (value - 128) / 200.0 for value in range(256))


def _tables() -> tuple[dict[type, tuple[int, codec.WireRecord]], dict[int, codec.WireRecord]]:
    """Return the table of the docstring, by message class and by type number."""
    u8, u32, f32, size, span, share = (
        codec.U8,
        codec.U32,
        codec.F32,
        codec.SIZE,
        codec.SPAN,
        codec.SHARE,
    )
    flag, point, shares, image = codec.BOOL, codec.POINT, codec.SHARES, codec.octets(900)
    text, sentence, name = codec.text(MAX_TEXT), codec.text(MAX_SENTENCE), codec.text(40)
    names = codec.many(name, 64)
    hop = codec.WireRecord(StageTime, (name, f32, f32, f32))
    contact = codec.WireRecord(Contact, (codec.U16, f32, f32, f32, f32))
    table: tuple[tuple[int, type, tuple[codec.Kind, ...]], ...] = (
        (1, Hello, (u8, u8, text, text, flag)),
        (2, Welcome, (u8, u32, text, text, flag, size, size, f32, f32, span, span, names, names,
                      flag, u32)),
        (3, Refuse, (sentence,)),
        (4, Bye, (sentence,)),
        (5, Heartbeat, (u32, u32, u32, u32, names)),
        (6, Offer, (u8, codec.octets(32), flag)),
        (16, NumberedCommand, (name, name, share, point, u32, u32, u32, u32)),
        (17, State, (names,)),
        (18, Telemetry, (u32, image, shares, point, name, flag, f32)),
        (19, GroundTruth, (u32, name, u32, u32)),
        (20, Granted, (u32,)),
        (21, Health, (codec.many(codec.text(120), 8),)),
        (22, UploadStatus, (u8, u32, sentence)),
        (23, LatencyReport, (f32, u32, codec.many(hop, 16))),
        (24, UserIdentified, (name, share)),
        (25, PositionUncertainty, (u32, codec.Number("f", 0, codec.F32.high))),
        (32, Contacts, (codec.many(contact, 16),)),
        (33, Perform, (u32, name, f32, f32)),
        (34, Grant, (u32,)),
        (35, Join, (text, text, flag, codec.Number("I", 1, 0xFFFFFFFF), u32, u32)),
        (36, HostHeartbeat, (u32, u32, u32, u32, u32)),
        (48, UploadOffer, (codec.octets(32), u32, text)),
        (49, UploadChunk, (u32, codec.octets(PIECE))),
        (50, Correction, (name,)),
    )  # fmt: skip
    records = {number: codec.WireRecord(message, kinds) for number, message, kinds in table}
    return {message: (number, records[number]) for number, message, _ in table}, records


KINDS, RECORDS = _tables()
EVERY_VERSION = (KINDS[Hello][0], KINDS[Refuse][0])  # their layout never changes
