"""Field codecs and COBS: the values of messages to bytes and back, little endian.

`controller.shared.protocol.messages` names the types of its fields by the aliases at the end of
this file. Reading checks every value and raises one of `BAD_BYTES`; it never reads beyond the
given bytes.
"""

import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from math import inf, isfinite
from typing import Annotated, Any, Final, NamedTuple

from controller.shared.errors import one_line
from controller.shared.notices import TEMPLATES, Notice


class ProtocolError(ValueError):
    """A message that does not fit the wire format, or bytes that are no packet."""


MOST_ARGUMENTS: Final = 8  # of a notice
MOST_NESTED: Final = 4  # notices in one another
BAD_BYTES: Final = (struct.error, ValueError, IndexError)  # raised by reading


def cobs_encode(data: bytes) -> bytes:
    """Return data without zero bytes: each becomes the distance to the next, 255 at most."""
    out = bytearray()
    for block in data.split(b"\0"):
        while len(block) >= 254:
            out += b"\xff" + block[:254]
            block = block[254:]
        out.append(len(block) + 1)
        out += block
    last = data.rpartition(b"\0")[2]
    if last and len(last) % 254 == 0:
        del out[-1]  # a full last block needs no empty block after it
    return bytes(out)


def cobs_decode(data: bytes) -> bytes:
    """Return the data of a frame without its final zero; ProtocolError if a block is too long."""
    blocks: list[bytes] = []
    full = b""  # blocks of 254 bytes with no zero after them
    at, size = 0, len(data)
    while at < size:
        code = data[at]
        block = data[at + 1 : at + code]
        if code == 255:
            full += block
        else:
            blocks.append(full + block if full else block)
            full = b""
        at += code or size + 1
    if at != size:
        raise ProtocolError("a block reaches beyond the frame")
    if full:
        blocks.append(full)
    return b"\0".join(blocks)


class Codec(NamedTuple):
    """The codec of one field."""

    write: Callable[[Any], bytes]  # raises ValueError, TypeError or struct.error
    read: Callable[[bytes, int], tuple[Any, int]]  # the value at data[at], and the position after


def number(letter: str, low: float, high: float) -> Codec:
    """Return the codec of a number: a letter of `struct`, and its least and greatest value."""
    layout = struct.Struct("<" + letter)

    def checked(value: float) -> float:
        if not low <= value <= high:  # not a number is refused here, too
            raise ProtocolError(f"{value} is not {low} to {high}")
        return value

    return Codec(
        lambda value: layout.pack(checked(value)),
        lambda data, at: (checked(layout.unpack_from(data, at)[0]), at + layout.size),
    )


def record(make: Any) -> Codec:
    """Return the codec of a dataclass whose fields are `Annotated` with codecs."""
    codecs: list[tuple[str, Codec]] = [
        (field.name, field.type.__metadata__[0])  # type: ignore[union-attr]
        for field in fields(make)
    ]

    def read(data: bytes, at: int) -> tuple[Any, int]:
        values = []
        for _, codec in codecs:
            value, at = codec.read(data, at)
            values.append(value)
        return make(*values), at

    return Codec(
        lambda value: b"".join([codec.write(getattr(value, name)) for name, codec in codecs]), read
    )


def octets(
    limit: int, pack: Callable[[Any], bytes] = bytes, unpack: Callable[[bytes], Any] = bytes
) -> Codec:
    """Return the codec of up to `limit` bytes after their count: u8, or u16 beyond 255.

    `pack` turns the value into bytes, and `unpack` bytes into the value.
    """
    width = 1 if limit < 256 else 2

    def write(value: Any) -> bytes:
        raw = pack(value)
        if len(raw) > limit:
            raise ProtocolError(f"{len(raw)} bytes, where at most {limit} fit")
        return len(raw).to_bytes(width, "little") + raw

    def read(data: bytes, at: int) -> tuple[Any, int]:
        start = at + width
        end = start + int.from_bytes(data[at:start], "little")
        if end > len(data) or end - start > limit:
            raise ProtocolError("a field is cut off, or too long")
        return unpack(data[start:end]), end

    return Codec(write, read)


def text(limit: int) -> Codec:
    """Return the codec of a printable text of up to `limit` bytes of UTF-8."""
    return octets(
        limit, lambda value: _printable(value).encode(), lambda raw: _printable(raw.decode())
    )


def sentence(limit: int) -> Codec:
    """Return the codec of a sentence: a notice, or free text of up to `limit` bytes of UTF-8.

    A notice that is longer is sent as free text, and that is cut.
    """

    def pack(value: str) -> bytes:
        raw = _pack_sentence(value)
        return raw if len(raw) <= limit + 1 else _pack_sentence(fitted(value, limit))

    return octets(limit + 1, pack, _unpack_sentence)


def many(item: Codec, limit: int) -> Codec:
    """Return the codec of a tuple of up to `limit` (< 256) items after their count."""

    def write(values: Sequence[Any]) -> bytes:
        if len(values) > limit:
            raise ProtocolError(f"{len(values)} values, where at most {limit} fit")
        return bytes([len(values)]) + b"".join([item.write(value) for value in values])

    def read(data: bytes, at: int) -> tuple[tuple[Any, ...], int]:
        count = data[at]
        if count > limit:
            raise ProtocolError("too many values")
        at += 1
        values = []
        for _ in range(count):
            value, at = item.read(data, at)
            values.append(value)
        return tuple(values), at

    return Codec(write, read)


def fitted(value: str, limit: int) -> str:
    """Return a text that `text(limit)` accepts: unprintable characters escaped, the rest cut off.

    The cut is between two characters; the result has at most `limit` bytes of UTF-8.
    """
    return one_line(value).encode()[:limit].decode(errors="ignore")


def quantise_image(values: Iterable[float]) -> bytes:
    """Return relative capacitances z as bytes: steps of 0.005, 128 untouched, z 0.36 to 1.635.

    ProtocolError if a value is not finite.
    """
    try:
        return bytes([min(max(round((z - 1.0) * 200.0) + 128, 0), 255) for z in values])
    except (ValueError, OverflowError):
        raise ProtocolError("an image must be finite to be sent") from None


def image_from_bytes(image: bytes) -> list[float]:
    """Return the z of each byte of `Telemetry.image`: the inverse of `quantise_image`."""
    return [_Z[value] for value in image]


_Z: Final = tuple(1.0 + (value - 128) / 200.0 for value in range(256))


def _printable(value: str) -> str:
    if not value.isprintable():  # it may be shown on a terminal
        raise ProtocolError(f"{value!r} is not printable")
    return value


def _pack_sentence(value: str) -> bytes:
    """Return free text after a zero, or the code and arguments of a notice."""
    if not isinstance(value, Notice):
        return b"\0" + one_line(value).encode()
    parts = [_PART.write(_pack_sentence(one)) for one in value.arguments]
    return _NAME.write(value.code) + b"".join(parts)


def _unpack_sentence(raw: bytes, depth: int = MOST_NESTED) -> str:
    """Return a notice, or free text; that of an unknown code shows code and arguments."""
    code, at = _NAME.read(raw, 0)
    if not code:
        return _printable(raw[at:].decode())
    if depth < 1:
        raise ProtocolError("a notice is nested too deeply")
    arguments: list[str] = []
    while at < len(raw):
        part, at = _PART.read(raw, at)
        arguments.append(_unpack_sentence(part, depth - 1))
    if len(arguments) > MOST_ARGUMENTS:
        raise ProtocolError("a notice has too many arguments")
    return Notice(code, arguments) if code in TEMPLATES else f"{code}: {', '.join(arguments)}"


def _pack_shares(values: Iterable[float]) -> bytes:
    return bytes([round(value * 255.0) for value in values])


def _unpack_shares(raw: bytes) -> tuple[float, ...]:
    return tuple([value / 255.0 for value in raw])


def _write_bool(value: bool) -> bytes:
    return b"\1" if value else b"\0"


def _read_bool(data: bytes, at: int) -> tuple[bool, int]:
    return (False, True)[data[at]], at + 1


def _write_point(point: tuple[float, float] | None) -> bytes:
    return b"\0" if point is None else b"\1" + _XY.pack(*_finite(point))


def _read_point(data: bytes, at: int) -> tuple[tuple[float, float] | None, int]:
    present, at = _read_bool(data, at)
    if not present:
        return None, at
    return _finite(_XY.unpack_from(data, at)), at + _XY.size


def _finite(point: tuple[float, ...]) -> tuple[float, float]:
    x, y = point
    if not (isfinite(x) and isfinite(y)):
        raise ProtocolError("a position must be finite")
    return x, y


_XY: Final = struct.Struct("<ff")
_LARGEST: Final = 3.4028234663852886e38  # float32
_U32: Final = 0xFFFFFFFF
_NAME: Final = text(40)
_PART: Final = octets(0xFFFF)  # an argument of a notice

Bool = Annotated[bool, Codec(_write_bool, _read_bool)]
U8 = Annotated[int, number("B", 0, 0xFF)]
U16 = Annotated[int, number("H", 0, 0xFFFF)]
U32 = Annotated[int, number("I", 0, _U32)]
Nonce32 = Annotated[int, number("I", 1, _U32)]
Size = Annotated[int, number("B", 1, 0xFF)]
Span = Annotated[int, number("H", 1, 0xFFFF)]  # milliseconds
F32 = Annotated[float, number("f", -_LARGEST, _LARGEST)]  # finite
Bound = Annotated[float, number("f", -inf, inf)]  # infinite: no bound
Deviation = Annotated[float, number("f", 0, _LARGEST)]
Share = Annotated[float, number("f", 0, 1)]
Text40 = Annotated[str, _NAME]
Text64 = Annotated[str, text(64)]
Text500 = Annotated[str, text(500)]
Sentence500 = Annotated[str, sentence(500)]
Names = Annotated[tuple[str, ...], many(_NAME, 64)]
Octets32 = Annotated[bytes, octets(32)]
Point = Annotated[tuple[float, float] | None, Codec(_write_point, _read_point)]
Shares = Annotated[tuple[float, ...], octets(255, _pack_shares, _unpack_shares)]
