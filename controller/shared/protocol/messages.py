"""Messages between the orb and its host: one dataclass each, its fields in wire order.

docs/protocol.md is the specification. The decorator names a message's type number, and the type of
a field names its form in bytes, see `controller.shared.protocol.codec`. Standard library only.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final, TypeVar, dataclass_transform

from controller.shared.protocol import codec

VERSION = 4  # of the payloads: the upper nibble of every packet
UPDATE = "on the {}, run: pip install --upgrade orbtouch"  # the end that is older
MAX_PAYLOAD = 1024  # bytes
COMMANDS = ("left", "right", "down", "drop", "rotate_cw", "rotate_ccw", "hold", "pause")
HEARTBEAT_MS = 100  # between two heartbeats, each way
DEADMAN_MS = 300  # without a valid packet: release everything, pause
LOST_MS = 1000  # without a valid packet: close, and connect again
LOOP_FRAMES = 3  # frame periods without a sign of the control loop, or DEADMAN_MS if that is more
HUNG_MS = 1000  # without a sign of the control loop: the device sends no heartbeat
SILENCE_MS = 2000  # a device drops a silent host; a host gives up waiting
LATE_MS = 250  # an older command is not carried out
PIECE = 1000  # bytes of a bundle in one packet
MAX_TEXT = 64  # bytes of UTF-8: `controller.shared.protocol.codec.fitted`
WANTED, PROVING, IN_USE, DECLINED = range(4)  # states of a Delivery


@dataclass(frozen=True, slots=True)
class Message:
    """Base of all messages."""


@dataclass(frozen=True, slots=True)
class Request(Message):
    """A message from a host in a session."""


@dataclass(frozen=True, slots=True)
class Report(Message):
    """A message from a device in a session."""


def hold_ms(rate_hz: float) -> int:
    """Return how long a command stays held without a sign of the device's control loop."""
    return max(DEADMAN_MS, round(1000 * LOOP_FRAMES / rate_hz))


M = TypeVar("M", bound=Message)
TYPES: Final[dict[type[Message], tuple[int, codec.Codec]]] = {}  # numbers and codecs


@dataclass_transform(frozen_default=True)
def message(number: int) -> Callable[[type[M]], type[M]]:
    """Return the decorator that makes a frozen dataclass a message with its type number."""

    def register(plain: type[M]) -> type[M]:
        kind = dataclass(frozen=True, slots=True)(plain)
        TYPES[kind] = number, codec.record(kind)
        return kind

    return register


@message(1)
class Hello(Message):
    """Host to device: the start of a session, with versions and a random number as `token`.

    The Hello that a device session returns has the other fields from Join.
    """

    version_min: codec.U8
    version_max: codec.U8
    token: codec.Text64  # "" when none
    host: codec.Text64  # a name for the log
    granted: codec.Bool  # the host grants time: virtual devices only


@message(6)
class Offer(Message):
    """Device to host: the answer to Hello; the session in its header is the number from here on."""

    version: codec.U8  # the one chosen
    nonce: codec.Octets32  # drawn for the session
    keyed: codec.Bool  # every later frame carries an authentication tag


@message(48)
class UploadOffer(Request):
    """Host to device: announcement of a bundle."""

    digest: codec.Octets32  # SHA-256 of the file
    size: codec.U32  # bytes
    name: codec.Text64  # of the file, for the log


@message(49)
class UploadChunk(Request):
    """Host to device: a part of the bundle."""

    offset: codec.U32  # of the first
    data: Annotated[bytes, codec.octets(PIECE)]  # at most PIECE of them


@message(50)
class Correction(Request):
    """Host to device: the label of the latest touch, given by the player, to learn."""

    label: codec.Text40  # of Welcome.labels; "": undo the last correction


@message(35)
class Join(Message):
    """Host to device: its identity, and the last command that it received."""

    token: codec.Text64  # "" when none
    host: codec.Text64  # a name for the log
    granted: codec.Bool  # the host grants time: virtual devices only
    host_nonce: codec.Nonce32  # u32, not 0, drawn at each start of the host
    boot_nonce: codec.U32  # of the device of its last session
    done: codec.U32  # number of the last command received from that device


@message(2)
class Welcome(Message):
    """Device to host: the answer to Join, with the description of the device."""

    version: codec.U8  # the one chosen
    boot_nonce: codec.U32  # u32, drawn at each start of the device
    device_id: codec.Text64  # serial number; "virtual-SEED"
    name: codec.Text64
    virtual: codec.Bool  # takes Contacts, Perform, Grant
    rows: codec.Size
    columns: codec.Size
    pitch_mm: codec.F32
    rate_hz: codec.F32
    heartbeat_ms: codec.Span
    deadman_ms: codec.Span
    labels: codec.Names
    commands: codec.Names
    resumed: codec.Bool = False  # commands continue after Join.done, else after `done`
    done: codec.U32 = 0  # number of the newest command that will not be sent (again)


@message(3)
class Refuse(Message):
    """Device to host, in place of Offer or Welcome: the reason, in one sentence."""

    reason: codec.Text500


@message(4)
class Bye(Message):
    """Either side, before it closes: the reason."""

    reason: codec.Text500


@message(5)
class Heartbeat(Report):
    """Device to host, ten times a second: clocks as in `ClockSync`, and the held commands."""

    sent_ms: codec.U32
    echo_ms: codec.U32
    held_ms: codec.U32
    done: codec.U32  # number of the newest command that will not be sent again
    pressed: codec.Names  # as in State


@message(36)
class HostHeartbeat(Request):
    """Host to device, ten times a second and after commands: clocks and acknowledgements."""

    sent_ms: codec.U32
    echo_ms: codec.U32
    held_ms: codec.U32
    done: codec.U32  # number of the newest command received or missed
    missed: codec.U32  # missed since the first session of this host and device


@dataclass(frozen=True, slots=True)
class Command(Report):
    """A recognised command. Delivered once, or reported as missed."""

    name: codec.Text40
    label: codec.Text40  # the gesture
    probability: codec.Share
    touch: codec.Point  # (x, y), grid units
    frame: codec.U32


@message(16)
class NumberedCommand(Command):
    """Device to host: a command with its number, as encoded on the wire."""

    number: codec.U32  # counted from the device's start
    done: codec.U32  # number of the newest command that will not be sent again
    sent_ms: codec.U32  # the device's link clock when it was sent first


@message(17)
class State(Report):
    """Device to host: all commands held now; () right after Welcome."""

    pressed: codec.Names


@message(18)
class Telemetry(Report):
    """Device to host, one per frame: the device's measurements and estimates."""

    frame: codec.U32
    image: Annotated[bytes, codec.octets(900)]  # rows * columns, top row first: `quantise_image`
    probabilities: codec.Shares  # in the order of Welcome.labels; steps of 1/255
    touch: codec.Point  # (x, y), grid units
    gesture: codec.Text40  # the label held by the debouncer; "" if none
    ready: codec.Bool  # False until there is a baseline
    rate_hz: codec.F32  # measured


@message(19)
class GroundTruth(Report):
    """Virtual device to host, at the end of a performance: its true label and times."""

    number: codec.U32
    label: codec.Text40
    onset_ms: codec.U32
    release_ms: codec.U32


@message(20)
class Granted(Report):
    """Virtual device to host: every packet up to this time was sent before this one."""

    until_ms: codec.U32


@message(21)
class Health(Report):
    """Device to host: faults of the sensor with their remedies; () if there are none.

    A snapshot, sent when it changes and once to every new host if there is a fault.
    """

    found: Annotated[tuple[str, ...], codec.many(codec.sentence(120), 8)]  # worst first


@message(22)
class UploadStatus(Report):
    """Device to host: state of the upload of a bundle."""

    state: codec.U8  # WANTED, PROVING, IN_USE, DECLINED
    offset: codec.U32  # bytes received
    text: codec.Sentence500  # or ""


@dataclass(frozen=True, slots=True)
class StageTime:
    """Latency percentiles of one stage of the device, milliseconds."""

    name: codec.Text40
    p50_ms: codec.F32
    p95_ms: codec.F32
    p99_ms: codec.F32


@message(23)
class LatencyReport(Report):
    """Device to host, every second: latency of the latest frames by stage, milliseconds.

    The last entry is the whole.
    """

    period_ms: codec.F32  # between two frames
    missed: codec.U32  # frames skipped because they were late, since the start
    hops: Annotated[tuple[StageTime, ...], codec.many(codec.record(StageTime), 16)]


@message(24)
class UserIdentified(Report):
    """Device to host, at each change and once to every new host: the user; no authentication."""

    user: codec.Text40  # "": no enrolled user
    confidence: codec.Share  # probability of that user; without one, of the most probable


@message(25)
class PositionUncertainty(Report):
    """Device to host, before the other messages of a frame: uncertainty of its touch's position."""

    frame: codec.U32
    sigma: codec.Deviation  # standard deviation of each axis, grid units


@message(12)
class ContactState(Report):
    """Device to host, first in each frame in which something touches, and once when that ends.

    A state: it may be lost, and none waits behind other messages. Each value has its deviation.
    """

    frame: codec.U32
    x: codec.F32 = 0.0  # place, grid units: the middle of all contacts, weighed by their depth
    y: codec.F32 = 0.0
    place_sigma: codec.Deviation = 0.0  # of each axis
    depth_mm: codec.F32 = 0.0  # of the deepest contact
    depth_sigma: codec.Deviation = 0.0
    fingers: codec.U8 = 0  # 1, 2, or 3 for more; 0: the contact has ended, as has all of it
    fingers_sure: codec.Share = 0.0  # probability of that number
    angle_deg: codec.F32 = 0.0  # since the landing, counter-clockwise positive
    angle_sigma: codec.Deviation = 0.0
    rise_mm: codec.F32 = 0.0  # depth above its mean in the .2 s before
    rise_sigma: codec.Deviation = 0.0
    sent_ms: codec.U32 = 0  # the device's link clock; set by its session


@dataclass(frozen=True, slots=True)
class Contact:
    """One finger on the membrane: position (grid units), depth and radius (mm)."""

    id: codec.U16
    x: codec.F32
    y: codec.F32
    depth_mm: codec.F32
    radius_mm: codec.F32


@message(32)
class Contacts(Request):
    """Host to virtual device: all fingers on the membrane; () lifts them all."""

    contacts: Annotated[tuple[Contact, ...], codec.many(codec.record(Contact), 16)]


@message(33)
class Perform(Request):
    """Host to virtual device: perform this gesture, "brush" or "rest" by the simulated hand now."""

    number: codec.U32
    label: codec.Text40  # "": lift the hand at once
    x: codec.F32
    y: codec.F32


@message(34)
class Grant(Request):
    """Host to virtual device: advance exactly to this time."""

    until_ms: codec.U32
