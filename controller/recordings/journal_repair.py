"""Recovery of what is whole in a journal after a crash or a disk error."""

import dataclasses
import heapq
import json
import math
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Any, Final

import numpy as np

from controller import npz
from controller.recognition.pipeline import CommandRecord
from controller.recordings import reader
from controller.recordings.journal import (
    AMEND,
    AMENDABLE,
    FRAME,
    HEADERS,
    MAX_BYTES,
    MAX_RECORDS,
    MAX_ROWS,
    SYNCED,
    clean,
)
from controller.recordings.journal_records import (
    ID_BYTES,
    MAX_HEADER,
    Kind,
    Record,
    ids,
    payload,
    scan,
)
from controller.recordings.reader import COLUMNS, STATE
from controller.recordings.recording import LABELLERS, Mark, Recording, RecordingError

_OURS: Final = (Kind.HEADER, Kind.BLANK, Kind.SYNCED)  # all others hold what was recorded
_COLUMNS: Final[list[tuple[str, str]]] = [
    ("t", "<f8"), ("sequence", "<i8"), *((name, "<i2") for name in LABELLERS), ("excluded", "?"),
]  # fmt: skip


@dataclass(frozen=True)
class Report:
    """What became of a journal's bytes.

    Attributes:
        frames: Frames that are whole.
        damaged_bytes: Bytes that were on the disk once and are no longer whole.
        lost_records: Records that these bytes held.
        cut_bytes: Bytes at the end that a crash left unfinished.
        left_out: Whole records among those: a record before them is missing.
    """

    frames: int
    damaged_bytes: int
    lost_records: int
    cut_bytes: int
    left_out: int


@dataclass(frozen=True)
class Decoded:
    """What a journal holds: `recording` is None if it has no whole frame."""

    id: str
    recording: Recording | None
    report: Report


def decode(data: bytes) -> Decoded:
    """Return what is whole in a journal.

    Up to the last offset that was surely on the disk, damage is the disk's: it is passed over, and
    what follows is kept. After it a crash may have lost any block, so the first gap is the end.

    Raises:
        RecordingError: It is no journal, or makes no recording.
    """
    if len(data) > MAX_BYTES:
        raise RecordingError(f"has {len(data)} bytes, more than the {MAX_BYTES} allowed")
    if not data:
        raise RecordingError("is empty")
    rows = [(key, _records(data, key)) for key in ids(data)]
    if not rows:
        raise RecordingError("has no header that is whole")
    # Where a file grows over blocks that another journal has left, that one's frames come later.
    key, records = min(rows, key=lambda row: _first_frame(row[1]))
    kept, report = _whole(data, records)
    if not report.frames:
        return Decoded(key.hex(), None, report)
    try:
        return Decoded(key.hex(), _recording(data, kept), report)
    except (ValueError, TypeError, LookupError, OverflowError, RecursionError, struct.error) as e:
        # Each record is proven, so this is a journal that this program has not written.
        if isinstance(e, RecordingError):
            raise
        raise RecordingError("holds records that make no recording") from None


def _records(data: bytes, key: bytes) -> list[Record]:
    records = list(islice(scan(data, key), MAX_RECORDS + 1))
    if len(records) > MAX_RECORDS:
        raise RecordingError(f"holds more than the {MAX_RECORDS} records allowed")
    return records


def _first_frame(records: Sequence[Record]) -> float:
    return next((record.start for record in records if record.kind is Kind.FRAME), math.inf)


def _whole(data: bytes, records: Iterable[Record]) -> tuple[list[Record], Report]:
    """Return the records that count, and what became of all others."""
    records = list(records)
    limit = 0  # all before it was on the disk
    for record in records:
        if record.number < 2 * HEADERS:  # these were there before the first frame
            limit = max(limit, record.end)
        elif record.kind is Kind.SYNCED and len(content := payload(data, record)) == SYNCED.size:
            (offset,) = SYNCED.unpack(content)
            limit = max(limit, min(offset, record.start))
    kept: list[Record] = []
    damaged = lost = end = number = 0
    for record in records:
        if record.start != end or record.number != number:
            if record.start > limit:
                break
            damaged += record.start - end
            lost += record.number - number
        kept.append(record)
        end, number = record.end, record.number + 1
    left_out = sum(record.kind not in _OURS for record in records[len(kept) :])
    damaged += max(0, limit - end)
    frames = sum(record.kind is Kind.FRAME for record in kept)
    return kept, Report(frames, damaged, lost, len(data) - max(limit, end), left_out)


def _recording(data: bytes, records: Sequence[Record]) -> Recording:
    """Return the recording that these records make, checked as if it came from a file."""
    by: dict[Kind, list[bytes]] = {kind: [] for kind in Kind}
    for record in records:
        by[record.kind].append(payload(data, record))
    if len(by[Kind.MARK]) + len(by[Kind.COMMAND]) > MAX_ROWS:
        raise RecordingError(f"holds more than the {MAX_ROWS} marks and commands allowed")
    arrays = _arrays(by[Kind.HEADER][0])
    origin = reader.origin_of(arrays.get("meta"))
    shape = (origin.rows, origin.columns)
    size = len(by[Kind.FRAME][0]) - FRAME.size
    if size < 0 or any(len(row) != FRAME.size + size for row in by[Kind.FRAME]):
        raise RecordingError("holds frames of several sizes")
    kinds: list[Any] = [*_COLUMNS, ("touch", "<f8", (2,)), ("frame", "<f4", (size // 4,))]
    table = np.frombuffer(b"".join(by[Kind.FRAME]), dtype=kinds)
    arrays |= {name: table[name].astype(kind) for name, kind in COLUMNS.items()}
    arrays["frames"] = table["frame"].astype(np.float32).reshape(-1, *shape)
    arrays["touch"] = table["touch"].astype(np.float64)
    if by[Kind.REST]:
        arrays["rest"] = np.frombuffer(by[Kind.REST][0], "<f4").astype(np.float32).reshape(shape)
    _amend(arrays, [AMEND.unpack(row) for row in by[Kind.AMEND]])
    marks = sorted((_mark(row) for row in by[Kind.MARK]), key=lambda mark: mark.t_s)
    return dataclasses.replace(
        reader.parse(arrays | _NO_TABLES),
        marks=tuple(marks),
        commands=tuple(_command(row) for row in by[Kind.COMMAND]),
    )


def _arrays(header: bytes) -> npz.Arrays:
    """Return the arrays of a header: meta and the state."""
    arrays = npz.unpack(header[ID_BYTES:], MAX_HEADER)
    return {n: array for n, array in arrays.items() if n == "meta" or n.startswith(STATE)}


def _amend(arrays: npz.Arrays, amendments: Iterable[tuple[int, float, float, int]]) -> None:
    """Give the columns their later values; where several overlap, the last one counts."""
    by: dict[str, list[tuple[int, int, int, int]]] = {name: [] for name in AMENDABLE}
    t = arrays["t"]
    for order, (column, from_s, to_s, value) in enumerate(amendments):
        start, end = np.searchsorted(t, (from_s, to_s)).tolist()
        if start < end:
            by[AMENDABLE[column]].append((start, end, order, value))
    for name, spans in by.items():
        spans.sort()
        waiting = iter([*spans, (len(t), 0, 0, 0)])
        upcoming = next(waiting)
        open_: list[tuple[int, int, int]] = []  # a heap, the latest first
        for a, b in pairwise(sorted({edge for span in spans for edge in span[:2]})):
            while upcoming[0] == a and upcoming[1]:
                heapq.heappush(open_, (-upcoming[2], upcoming[1], upcoming[3]))
                upcoming = next(waiting)
            while open_ and open_[0][1] <= a:
                heapq.heappop(open_)
            if open_:
                arrays[name][a:b] = open_[0][2]


def _mark(row: bytes) -> Mark:
    t_s, kind, words = json.loads(row)
    return Mark(_finite(t_s), _text(kind), _text(words))


def _command(row: bytes) -> CommandRecord:
    t_s, frame, gesture, probability, touch, command = json.loads(row)
    place = None if touch is None else (_finite(touch[0]), _finite(touch[1]))
    number = int(np.int64(frame))
    return CommandRecord(
        _finite(t_s), number, _text(gesture), _finite(probability), place, _text(command)
    )


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise RecordingError("holds a name that is none")
    return clean(value)


def _finite(value: Any) -> float:
    if not np.isfinite(value):
        raise RecordingError("holds a number that is none")
    return float(value)


_NO_TABLES: Final[npz.Arrays] = {
    **{name: np.zeros(0) for name in ("mark_t", "command_t", "command_probability")},
    **{
        name: np.array([], dtype=np.str_)
        for name in ("mark_kind", "mark_text", "command_gesture", "command_name")
    },
    "command_frame": np.zeros(0, dtype=np.int64),
    "command_touch": np.zeros((0, 2)),
}
