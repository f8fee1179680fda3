"""Lookup of a service's RFCOMM channel: one request of the Service Discovery Protocol.

Bluetooth Core Specification, volume 3, part B: 3 has the form of values, 4 that of requests.
"""

from __future__ import annotations

import socket
import struct
import uuid
from collections.abc import Iterator
from typing import Any, Final

PSM: Final = 1  # where every device answers such questions
ANSWER_S: Final = 5.0
RFCOMM_UUID: Final = uuid.UUID("00000003-0000-1000-8000-00805f9b34fb")
PROTOCOLS: Final = 0x0004  # the attribute that lists them, lowest first
_ASK, _ANSWER = 0x06, 0x07  # ServiceSearchAttribute request and response
_MOST: Final = 0xFFFF  # bytes of an answer
_BASE: Final = RFCOMM_UUID.bytes[4:]  # short UUIDs stand for this one with other first bytes
_ROUNDS: Final = 64  # an answer in more pieces is none


class SdpError(OSError):
    """The other side does not answer as the protocol says."""


def channel(connection: socket.socket, service: str) -> int | None:
    """Return the RFCOMM channel of a service's full UUID, None if the device does not offer it.

    The connection is to `PSM` of the device; OSError if it does not answer.
    """
    connection.settimeout(ANSWER_S)
    answer, rest = b"", b"\0"
    for number in range(_ROUNDS):
        connection.sendall(question(number, service, rest))
        piece, rest = _piece(connection.recv(_MOST), number)
        answer += piece
        if rest == b"\0":
            return find_channel(answer)
    raise SdpError("the list of services never ends")


def question(number: int, service: str, rest: bytes = b"\0") -> bytes:
    """Return the request for the protocols of every record that holds a service's UUID.

    `rest` is the continuation state of the answer before; one zero byte to begin.
    """
    pattern = b"\x35\x11\x1c" + uuid.UUID(service).bytes
    attributes = b"\x35\x03\x09" + struct.pack(">H", PROTOCOLS)
    body = pattern + struct.pack(">H", _MOST) + attributes + rest
    return struct.pack(">BHH", _ASK, number, len(body)) + body


def _piece(packet: bytes, number: int) -> tuple[bytes, bytes]:
    """Return a piece of the answer, and the continuation state to ask for the next with."""
    try:
        kind, its_number, length, size = struct.unpack_from(">BHHH", packet)
    except struct.error:
        raise SdpError("the answer is cut short") from None
    if kind != _ANSWER or its_number != number or len(packet) < 5 + length or length < size + 3:
        raise SdpError(f"the device cannot answer (it says {packet[:8].hex()})")
    return packet[7 : 7 + size], packet[7 + size : 5 + length]


def find_channel(answer: bytes) -> int | None:
    """Return the channel in lists of protocols: what stands beside RFCOMM's UUID."""
    try:
        return _beside_rfcomm(list(values(answer)))
    except (IndexError, RecursionError):
        raise SdpError("the list of services is garbled") from None


def _beside_rfcomm(value: Any) -> int | None:
    if not isinstance(value, list):
        return None
    if value[:1] == [RFCOMM_UUID] and len(value) > 1 and isinstance(value[1], int):
        return value[1] if 1 <= value[1] <= 30 else None
    return next((found for each in value if (found := _beside_rfcomm(each)) is not None), None)


def values(data: bytes) -> Iterator[Any]:
    """Yield the values in bytes: ints, UUIDs, lists, and bytes for everything else."""
    at = 0
    while at < len(data):
        kind, size = data[at] >> 3, data[at] & 7
        at += 1
        if size >= 5:
            width = 1 << (size - 5)
            length = int.from_bytes(data[at : at + width], "big")
            at += width
        else:
            length = 0 if kind == 0 else 1 << size
        body = data[at : at + length]
        if len(body) < length or (kind == 3 and length not in (2, 4, 16)):
            raise IndexError(at)
        at += length
        if kind in (1, 2):
            yield int.from_bytes(body, "big", signed=kind == 2)
        elif kind == 3:
            yield uuid.UUID(bytes=body if length == 16 else body.rjust(4, b"\0") + _BASE)
        elif kind in (6, 7):
            yield list(values(body))
        else:
            yield body
