"""Field codecs and COBS: values to bytes and back, and the kinds of fields that a packet can have.

`controller.protocol.messages` joins these kinds to messages. Reading checks everything and raises
one of `BAD_BYTES`; nothing is read beyond the bytes given. Little endian; the standard library
only.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence
from itertools import groupby
from math import isfinite
from typing import Any, NamedTuple, Protocol, cast

from controller.console import one_line


class ProtocolError(ValueError):
    """A message that the wire cannot carry, or bytes that are no packet."""


BAD_BYTES = (struct.error, ValueError, IndexError)  # what reading raises; ProtocolError is one


def cobs_encode(data: bytes) -> bytes:
    """Return data without zeros: each becomes the distance to the next, 255 at most."""
    out = bytearray()
    blocks = data.split(b"\0")
    if len(data) < 254:  # most packets: no block can be full
        for block in blocks:
            out.append(len(block) + 1)
            out += block
        return bytes(out)
    for block in blocks:
        at = 0
        while len(block) - at >= 254:
            out += b"\xff" + block[at : at + 254]
            at += 254
        out.append(len(block) - at + 1)
        out += block[at:]
    last = len(blocks[-1])
    if last and last % 254 == 0:
        del out[-1]  # a full block at the very end needs no empty one behind it
    return bytes(out)


def cobs_decode(data: bytes) -> bytes:
    """Return what `cobs_encode` was given.

    Args:
        data: A frame without its closing zero; it holds no zero.

    Raises:
        ProtocolError: A block is longer than the data.
    """
    blocks: list[bytes] = []
    full = b""  # blocks of 254 bytes, behind which no zero stood
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


class Number(NamedTuple):
    """A number of fixed size: its letter in `struct`, and the least and greatest value."""

    letter: str
    low: float
    high: float


class Field(Protocol):
    """A value of varying size."""

    def write(self, value: Any, /) -> bytes:
        """Return the value as bytes, or raise ValueError, TypeError or struct.error."""

    def read(self, data: bytes, at: int, /) -> tuple[Any, int]:
        """Return the value that starts at data[at], and where it ends."""


Kind = Number | Field

_LARGEST = 3.4028234663852886e38  # float32
U8 = Number("B", 0, 0xFF)
U16 = Number("H", 0, 0xFFFF)
U32 = Number("I", 0, 0xFFFFFFFF)
SIZE = Number("B", 1, 0xFF)
SPAN = Number("H", 1, 0xFFFF)  # milliseconds
F32 = Number("f", -_LARGEST, _LARGEST)  # finite
SHARE = Number("f", 0, 1)


class _Pair(NamedTuple):
    """A field made of two functions."""

    write: Callable[[Any], bytes]
    read: Callable[[bytes, int], tuple[Any, int]]


def octets(
    limit: int, pack: Callable[[Any], bytes] = bytes, unpack: Callable[[bytes], Any] = bytes
) -> Field:
    """Return the field for up to `limit` bytes behind their count: u8, or u16 beyond 255.

    Args:
        limit: The greatest number of bytes.
        pack: Turns the value into bytes.
        unpack: Turns bytes into the value.
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

    return _Pair(write, read)


def text(limit: int) -> Field:
    """Return the field for a printable text of up to `limit` bytes of UTF-8."""
    return octets(limit, _pack_text, _unpack_text)


def fitted(value: str, limit: int) -> str:
    """Return any text as `text(limit)` takes it: what cannot be printed as escapes, and cut.

    It is cut between two characters, so that it has at most `limit` bytes of UTF-8.
    """
    return one_line(value).encode()[:limit].decode(errors="ignore")


def many(item: Field, limit: int) -> Field:
    """Return the field for a tuple of up to `limit` (< 256) items behind their count."""

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

    return _Pair(write, read)


class WireRecord:
    """A dataclass as bytes, field by field; numbers side by side go through one struct."""

    def __init__(self, make: Any, kinds: Sequence[Kind]) -> None:
        """Join the dataclass `make` with the kinds of its fields, in their order."""
        self._make = make
        self._steps: list[_Numbers | _Single] = []
        named = zip(make.__match_args__, kinds, strict=True)
        for are_numbers, group in groupby(named, lambda pair: isinstance(pair[1], Number)):
            if are_numbers:
                self._steps.append(_Numbers(cast(list[tuple[str, Number]], list(group))))
            else:
                self._steps += [_Single(name, cast(Field, kind)) for name, kind in group]

    def write(self, value: Any) -> bytes:
        """Return the dataclass as bytes."""
        return b"".join([step.write(value) for step in self._steps])

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        """Return the dataclass that starts at data[at], and where it ends."""
        values: list[Any] = []
        for step in self._steps:
            at = step.read(data, at, values)
        return self._make(*values), at


class _Numbers:
    """A step of a record: neighbouring numbers."""

    def __init__(self, named: list[tuple[str, Number]]) -> None:
        self._names = [name for name, _ in named]
        self._struct = struct.Struct("<" + "".join(number.letter for _, number in named))
        self._limits = [
            (index, number.low, number.high)
            for index, (_, number) in enumerate(named)
            if number.letter == "f" or number.low > 0  # the struct itself checks the others
        ]

    def write(self, record: Any) -> bytes:
        values = [getattr(record, name) for name in self._names]
        self._check(values)
        return self._struct.pack(*values)

    def read(self, data: bytes, at: int, values: list[Any]) -> int:
        numbers = self._struct.unpack_from(data, at)
        self._check(numbers)
        values += numbers
        return at + self._struct.size

    def _check(self, numbers: Sequence[float]) -> None:
        for index, low, high in self._limits:
            if not low <= numbers[index] <= high:  # not a number is refused here, too
                raise ProtocolError(
                    f"{self._names[index]} is {numbers[index]}: not {low} to {high}"
                )


class _Single:
    """A step of a record: one field of varying size."""

    def __init__(self, name: str, field: Field) -> None:
        self._name, self._field = name, field

    def write(self, record: Any) -> bytes:
        return self._field.write(getattr(record, self._name))

    def read(self, data: bytes, at: int, values: list[Any]) -> int:
        value, at = self._field.read(data, at)
        values.append(value)
        return at


def _pack_text(value: str) -> bytes:
    if not value.isprintable():
        raise ProtocolError(f"{value!r} is not printable")
    return value.encode()


def _unpack_text(raw: bytes) -> str:
    value = raw.decode()
    if not value.isprintable():  # it may end up on a terminal
        raise ProtocolError(f"{value!r} is not printable")
    return value


def _pack_shares(values: Iterable[float]) -> bytes:
    return bytes([round(value * 255.0) for value in values])


def _unpack_shares(raw: bytes) -> tuple[float, ...]:
    return tuple([_SHARES[value] for value in raw])


_SHARES = tuple(value / 255.0 for value in range(256))


def _write_bool(value: bool) -> bytes:
    return b"\1" if value else b"\0"


def _read_bool(data: bytes, at: int) -> tuple[bool, int]:
    return (False, True)[data[at]], at + 1


def _write_point(point: tuple[float, float] | None) -> bytes:
    if point is None:
        return b"\0"
    x, y = point
    if not (isfinite(x) and isfinite(y)):
        raise ProtocolError("a place must be finite")
    return b"\1" + _XY.pack(x, y)


def _read_point(data: bytes, at: int) -> tuple[tuple[float, float] | None, int]:
    present, at = _read_bool(data, at)
    if not present:
        return None, at
    x, y = _XY.unpack_from(data, at)
    if not (isfinite(x) and isfinite(y)):
        raise ProtocolError("a place must be finite")
    return (x, y), at + _XY.size


_XY = struct.Struct("<ff")
BOOL: Field = _Pair(_write_bool, _read_bool)
POINT: Field = _Pair(_write_point, _read_point)
SHARES = octets(255, _pack_shares, _unpack_shares)
