"""Records in a row, each of which can be proven alone: the lowest layer of a journal.

    magic (4 bytes)  kind (1)  number (4)  length (4)  payload (length)  proof (8)

Numbers are little-endian. The proof is BLAKE2b of the record's offset and all that stands before
the proof, with the journal's own random id as the key. So a bit that changed, a block that stood
elsewhere, and a block of another journal are all found out, and nothing wrong is ever read.
"""

import hashlib
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple

from controller.recordings.recording import RecordingError

MAGIC: Final = b"\xc2OJ\x1b"  # no text begins so, and no number of picofarads is near it
ID_BYTES: Final = 16
MAX_PAYLOAD: Final = 64 << 10  # a frame of 4096 taxels has 16 KiB
MAX_HEADER: Final = 16 << 20  # a pipeline remembers some hundred frames
_FIELDS: Final = struct.Struct("<4sBII")
_OFFSET: Final = struct.Struct("<Q")
_PROOF_BYTES: Final = 8
OVERHEAD: Final = _FIELDS.size + _PROOF_BYTES

# Looking for the next whole record costs time for each one that only looks like it. Damage has
# few of those; a file made to keep us busy has many, so the work is limited to a few readings.
_READINGS: Final = 4
_LOOK_BYTES: Final = 256  # what looking at one that is none costs, as if so much were read


class Kind(IntEnum):
    """What a record holds."""

    HEADER = 1
    FRAME = 2
    COMMAND = 3
    MARK = 4
    REST = 5
    AMEND = 6
    SYNCED = 7
    BLANK = 8


class Record(NamedTuple):
    """One whole record: its bytes are data[start:end]."""

    kind: Kind
    number: int
    start: int
    end: int


def payload(data: bytes, record: Record) -> bytes:
    """Return what a record holds."""
    return data[record.start + _FIELDS.size : record.end - _PROOF_BYTES]


def encode(kind: Kind, number: int, content: bytes, offset: int, key: bytes) -> bytes:
    """Return a record that stands at `offset` of the journal whose id is `key`."""
    content = _FIELDS.pack(MAGIC, kind, number, len(content)) + content
    return content + _proof(content, offset, key)


def scan(data: bytes, key: bytes) -> Iterator[Record]:
    """Yield every whole record of the journal whose id is `key`, in order, numbers rising.

    What stands between them is no record, or damaged.

    Raises:
        RecordingError: Far too much looks like records and is none.
    """
    work = _Work(len(data))
    offset, last = 0, -1
    while 0 <= offset < len(data):
        record = _at(data, offset, key, work)
        if record is not None and record.number > last:
            yield record
            offset, last = record.end, record.number
        else:
            offset = data.find(MAGIC, offset + 1)


def ids(data: bytes) -> list[bytes]:
    """Return the ids of the journals whose headers are here: one, unless blocks are strangers."""
    work = _Work(len(data))
    found: list[bytes] = []
    start = MAGIC + bytes([Kind.HEADER])
    offset = data.find(start)
    while 0 <= offset < 2 * MAX_HEADER and len(found) < 2:
        place = offset + _FIELDS.size
        key = data[place : place + ID_BYTES]
        record = _at(data, offset, key, work)
        if record is not None and key not in found:
            found.append(key)
        offset = data.find(start, offset + 1 if record is None else record.end)
    return found


@dataclass
class _Work:
    """How much may still be spent on what is no record."""

    size: int

    def __post_init__(self) -> None:
        self.left = _READINGS * self.size + 2 * MAX_HEADER

    def spend(self, length: int) -> None:
        self.left -= _LOOK_BYTES + length
        if self.left < 0:
            raise RecordingError("is full of what only looks like records; it is none of ours")


def _at(data: bytes, offset: int, key: bytes, work: _Work) -> Record | None:
    """Return the record that stands at `offset`; None if none does, or it is damaged."""
    if len(data) - offset < OVERHEAD:
        return None
    magic, kind, number, length = _FIELDS.unpack_from(data, offset)
    limit = MAX_HEADER if kind == Kind.HEADER else MAX_PAYLOAD
    middle = offset + _FIELDS.size + length
    if magic != MAGIC or kind not in _KINDS or length > limit or middle > len(data) - _PROOF_BYTES:
        work.spend(0)
        return None
    content = data[offset:middle]
    end = middle + _PROOF_BYTES
    if _proof(content, offset, key) != data[middle:end]:
        work.spend(length)
        return None
    return Record(Kind(kind), number, offset, end)


def _proof(content: bytes, offset: int, key: bytes) -> bytes:
    return hashlib.blake2b(
        _OFFSET.pack(offset) + content, key=key, digest_size=_PROOF_BYTES
    ).digest()


_KINDS: Final = frozenset(Kind)
