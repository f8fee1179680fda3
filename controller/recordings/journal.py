"""Crash journal: a recording as an append-only log, read up to its first bad record.

    kind (1 byte)  length (4)  CRC-32 (4)  content (length bytes)

Numbers are little-endian. The CRC of a record is computed over its kind, length and content, and
starts from the CRC of the record before. So it covers everything since the header, which holds the
recording's random id: reading ends at a changed bit, a moved block or a block of another journal.
`docs/recording.md` lists the contents.
"""

import dataclasses
import json
import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

import numpy as np

from controller.recognition.images.frames import Frame
from controller.recognition.pipeline import CommandRecord, Touch
from controller.recordings import reader, writer
from controller.recordings.reader import COLUMNS, LARGEST, LATEST_S, STATE
from controller.recordings.recording import (
    LABELLERS,
    MAX_TEXT,
    UNKNOWN,
    Mark,
    Provenance,
    Recording,
    RecordingError,
    format_provenance,
    parse_provenance,
)
from controller.shared import npz
from controller.shared.aliases import State

# A journal is closed and the next begun at half of the readable size, so no frame is refused.
# Half is 5 hours at 10 Hz, 35 minutes at 100 Hz, and fits the memory of a small computer.
MAX_BYTES: Final = 64 << 20
MAX_ROWS: Final = 1 << 15  # marks, commands and exclusions; with the longest texts 262 MB
MAX_HEADER: Final = 16 << 20  # bytes; a pipeline's state has some hundred frames
_MAX_STATE: Final = MAX_HEADER // 2  # bytes; the array headers come on top

_RECORD: Final = struct.Struct("<BII")  # kind, length, CRC
_FRAME: Final = struct.Struct("<dqhhhh?dd")  # t, sequence, the label columns, excluded, touch
_SPAN: Final = struct.Struct("<dd")  # from, to
_LABELS: Final = [(name, "<i2") for name in LABELLERS]
_COLUMNS: Final = [("t", "<f8"), ("sequence", "<i8"), *_LABELS, ("excluded", "?")]
_ILLEGIBLE: Final = (  # errors of content that somebody else wrote
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RecursionError,
    struct.error,
)


class Kind(IntEnum):
    """Content of a record."""

    HEADER = 1
    FRAME = 2
    COMMAND = 3
    MARK = 4
    REST = 5
    EXCLUDE = 6


class Journal:
    """A growing journal in memory: every prefix of whole records is a recording.

    Attributes:
        origin: Provenance of the recording, with the journal's id.
        data: The bytes.
    """

    def __init__(self, origin: Provenance, state: State, recording_id: str) -> None:
        """Begin with origin and `Pipeline.state()`; RecordingError if one is not valid."""
        self.origin = dataclasses.replace(origin, id=recording_id)
        self.data = bytearray()
        self._crc = self._rows = 0
        self._t_s, self._sequence = -LATEST_S, -1  # of the latest frame
        self._append(Kind.HEADER, _header(self.origin, state))

    @property
    def full(self) -> bool:
        """Whether it is time to close this journal and begin the next."""
        return 2 * len(self.data) >= MAX_BYTES or 2 * self._rows >= MAX_ROWS

    def add_frame(
        self,
        frame: Frame,
        t_s: float,
        number: int,
        labels: Sequence[int] = (UNKNOWN,) * len(LABELLERS),
        touch: Touch | None = None,
    ) -> None:
        """Append a frame, (rows, columns), with its labels; RecordingError if not valid."""
        image = self._image(frame, f"frame {number}")
        if not (self._t_s < t_s < LATEST_S and self._sequence < number < 1 << 63):
            raise RecordingError(
                f"frame {number} at {t_s} s comes after frame {self._sequence} at {self._t_s} s; "
                "number and time must rise"
            )
        if not all(UNKNOWN <= label < len(self.origin.labels) for label in labels):
            raise RecordingError(f"frame {number} has a label that the recording does not name")
        row = _FRAME.pack(t_s, number, *labels, False, *(touch or writer.NOWHERE))
        self._append(Kind.FRAME, row + image)
        self._t_s, self._sequence = t_s, number

    def add_command(self, command: CommandRecord) -> None:
        """Append a recognised command; RecordingError if the reader would refuse it."""
        c, touch = command, command.touch
        if not (math.isfinite(c.t_s) and math.isfinite(c.probability) and 0 <= c.frame < 1 << 63):
            raise RecordingError(f"the command {c} has a time, frame or probability that is none")
        place = touch if touch is None or all(map(math.isfinite, touch)) else None
        names = (_clean(c.gesture), _clean(c.command))
        self._add_row(Kind.COMMAND, c.t_s, c.frame, names[0], c.probability, place, names[1])

    def add_mark(self, t_s: float, kind: str, text: str) -> None:
        """Append an event; texts are cut after 1000 characters. RecordingError: no time."""
        if not abs(t_s) <= LATEST_S:
            raise RecordingError(f"a mark was made at {t_s} s; its time must be a number")
        self._add_row(Kind.MARK, t_s, _clean(kind), _clean(text))

    def add_rest(self, frame: Frame) -> None:
        """Append the untouched sensor, (rows, columns); the first one counts."""
        self._append(Kind.REST, self._image(frame, "the rest image"))

    def exclude(self, from_s: float, to_s: float) -> None:
        """Append that training leaves out the frames so far in [from, to)."""
        self._append(Kind.EXCLUDE, _SPAN.pack(from_s, to_s))
        self._rows += 1

    def _image(self, frame: Frame, name: str) -> bytes:
        """Return the bytes of a frame, (rows, columns), if the reader accepts them."""
        shape = (self.origin.rows, self.origin.columns)
        image = frame.astype("<f4")
        if image.shape != shape or not (np.abs(image) < LARGEST).all():  # refuses NaN too
            raise RecordingError(
                f"{name} must be {shape[0]}×{shape[1]} numbers below {LARGEST:g}; "
                "look at the sensor"
            )
        return image.tobytes()

    def _add_row(self, kind: Kind, *row: Any) -> None:
        self._append(kind, json.dumps(row).encode())
        self._rows += 1

    def _append(self, kind: Kind, content: bytes) -> None:
        size = _RECORD.size + len(content)
        if len(self.data) + size > MAX_BYTES or self._rows >= MAX_ROWS:
            raise RecordingError("the journal is full and takes no more; begin the next recording")
        self._crc = _crc(kind, content, self._crc)
        self.data += _RECORD.pack(kind, len(content), self._crc) + content


@dataclass(frozen=True)
class Decoded:
    """Content of a journal up to its first bad record."""

    recording: Recording | None  # None if there is no whole frame
    whole_bytes: int  # length of the valid records
    frame_bytes: int  # length of one frame's record; a shorter rest of the file holds none


def decode(data: bytes) -> Decoded:
    """Return the content up to the first bad record; RecordingError if it makes no recording."""
    if len(data) > MAX_BYTES:
        raise RecordingError(f"has {len(data)} bytes, more than the {MAX_BYTES} allowed")
    if not data:
        raise RecordingError("is empty")
    contents: dict[int, list[bytes]] = {kind: [] for kind in Kind}
    before: list[int] = []  # frames before each exclusion
    whole_bytes = 0
    for kind, content, end in _records(data):
        whole_bytes = end
        contents.get(kind, []).append(content)
        if kind == Kind.EXCLUDE:
            before.append(len(contents[Kind.FRAME]))
    if not contents[Kind.HEADER]:
        raise RecordingError("has no whole header")
    try:
        arrays = npz.unpack(contents[Kind.HEADER][0], MAX_HEADER)
        origin = reader.origin_of(arrays.get("meta"))
        frame_bytes = _RECORD.size + _FRAME.size + 4 * origin.rows * origin.columns
        recording = _recording(arrays, origin, contents, before)
    except RecordingError:
        raise
    except _ILLEGIBLE:
        raise RecordingError("holds records that make no recording") from None
    return Decoded(recording, whole_bytes, frame_bytes)


def _records(data: bytes) -> Iterator[tuple[int, bytes, int]]:
    """Yield (kind, content, end) of each record up to the first bad one."""
    end = crc = 0
    while len(data) - end >= _RECORD.size:
        kind, length, check = _RECORD.unpack_from(data, end)
        start = end + _RECORD.size
        content = data[start : start + length]
        crc = _crc(kind, content, crc)
        if len(content) < length or crc != check:
            return
        end = start + length
        yield kind, content, end


def _crc(kind: int, content: bytes, before: int) -> int:
    """Return the CRC of a record; `before` is that of the record before it."""
    return zlib.crc32(content, zlib.crc32(struct.pack("<BI", kind, len(content)), before))


def _recording(
    header: npz.Arrays, origin: Provenance, contents: dict[int, list[bytes]], before: list[int]
) -> Recording | None:
    """Return the recording of contents by kind, checked like one in a file; None without a frame.

    `header` has the origin as "meta", and the state; `before` the frames before each exclusion.
    """
    if not contents[Kind.FRAME]:
        return None
    if sum(len(contents[kind]) for kind in (Kind.COMMAND, Kind.MARK, Kind.EXCLUDE)) > MAX_ROWS:
        raise RecordingError(f"holds more than the {MAX_ROWS} marks and commands allowed")
    shape = (origin.rows, origin.columns)
    kinds: list[Any] = [*_COLUMNS, ("touch", "<f8", (2,)), ("frames", "<f4", shape)]
    table = np.frombuffer(b"".join(contents[Kind.FRAME]), dtype=kinds)
    if any(len(row) != table.itemsize for row in contents[Kind.FRAME]):
        raise RecordingError("holds frames of several sizes")
    arrays = {name: array for name, array in header.items() if name.startswith(STATE)}
    arrays["meta"] = header["meta"]
    arrays |= {name: table[name].astype(kind) for name, kind in COLUMNS.items()}
    arrays["touch"] = table["touch"].astype(np.float64)
    arrays["frames"] = table["frames"].astype(np.float32)
    for row in contents[Kind.REST][:1]:
        arrays["rest"] = np.frombuffer(row, "<f4").astype(np.float32).reshape(shape)
    for row, count in zip(contents[Kind.EXCLUDE], before, strict=True):
        arrays["excluded"][slice(*np.searchsorted(arrays["t"][:count], _SPAN.unpack(row)))] = True
    marks = sorted(map(_mark, contents[Kind.MARK]), key=lambda mark: mark.t_s)
    commands = [_command(row) for row in contents[Kind.COMMAND]]
    return reader.parse(arrays | writer.tables(marks, commands))


def _header(origin: Provenance, state: State) -> bytes:
    """Return the content of the header: an .npz of the origin and the state."""
    text = format_provenance(origin)
    try:
        parse_provenance(text)
    except RecordingError as error:
        raise RecordingError(f"no recording can be made: its file {error}") from None
    if not all(a.dtype == np.float64 and np.isfinite(a).all() for a in state.values()):
        raise RecordingError("no recording can be made: the pipeline's state is not all numbers")
    if len(text) * 4 + sum(a.nbytes for a in state.values()) > _MAX_STATE:
        raise RecordingError("no recording can be made: the pipeline's state is too large")
    return npz.pack({"meta": np.array(text), **{STATE + n: a for n, a in state.items()}})


def _mark(row: bytes) -> Mark:
    t_s, kind, text = json.loads(row)
    return Mark(float(t_s), _clean(kind), _clean(text))


def _command(row: bytes) -> CommandRecord:
    t_s, frame, gesture, probability, touch, command = json.loads(row)
    place = None if touch is None else (float(touch[0]), float(touch[1]))
    return CommandRecord(
        float(t_s), int(frame), _clean(gesture), float(probability), place, _clean(command)
    )


def _clean(text: str) -> str:
    """Return a text without zeros and lone surrogates, cut to the limit of a file."""
    return text.replace("\0", "").encode(errors="replace").decode()[:MAX_TEXT]
