"""A journal: a recording as a row of records, of which every whole beginning is a recording.

    header, blank, header, blank, frame, command, frame, ..., synced, frame, ..., header, ...

The header is written twice, each copy in blocks of its own, and is on the disk before the first
frame; further copies follow whenever the journal has doubled. A `Journal` grows in memory; what is
on the disk is always a beginning of it. `salvage` reads whatever a crash or a bad disk has left of
one. docs/recording.md says what each record holds.
"""

import dataclasses
import json
import math
import struct
from collections.abc import Sequence
from typing import Final

import numpy as np

from controller import npz
from controller.recognition.pipeline import CommandRecord, Touch
from controller.recognition.preprocess import Frame, State
from controller.recordings import meta
from controller.recordings.journal_records import MAX_HEADER, OVERHEAD, Kind, encode
from controller.recordings.reader import LARGEST, LATEST_S, STATE
from controller.recordings.recording import LABELLERS, UNKNOWN, Provenance, RecordingError

NOWHERE: Final = (np.nan, np.nan)
AMENDABLE: Final = (*LABELLERS, "excluded")
BLOCK: Final = 4096  # of a disk: what is lost or kept in one piece
HEADERS: Final = 2  # before the first frame
FARTHEST: Final = 1 << 20  # bytes from one of the later headers to the next

MAX_STATE: Final = MAX_HEADER // 2  # of what the header unpacks to; array headers come on top

# A journal is closed and the next begun at half of what is read, so nothing is ever turned away.
# Half is 5 hours at 10 Hz, 35 minutes at 100 Hz, and little enough to wait in a small computer's
# memory for a disk that has trouble.
MAX_BYTES: Final = 64 << 20
MAX_RECORDS: Final = 1 << 19
MAX_ROWS: Final = 1 << 15  # marks and commands; with the longest texts they unpack to 262 MB

FRAME: Final = struct.Struct("<dqhhhh?dd")  # t, sequence, the labellers, excluded, touch
AMEND: Final = struct.Struct("<Bddh")  # column, from, to, value
SYNCED: Final = struct.Struct("<Q")  # all before this offset is on the disk


class Journal:
    """A journal as it grows: everything that happened so far, as the bytes of its file.

    Attributes:
        origin: Where the recording comes from; its id is the journal's.
        data: The bytes.
        frames: How many frames they hold.
        head: How many bytes the two headers have.
    """

    def __init__(self, origin: Provenance, state: State, key: bytes) -> None:
        """Begin a journal.

        Args:
            origin: Where the frames come from; its id is replaced.
            state: `Pipeline.state()` before the first frame.
            key: The journal's id, random, `ID_BYTES` long, never used before.

        Raises:
            RecordingError: No recording can have such an origin or state.
        """
        self.origin = dataclasses.replace(origin, id=key.hex())
        self.data = bytearray()
        self.frames = 0
        self._key = key
        self._records = self._rows = 0
        self._t_s, self._sequence = -LATEST_S, -1  # of the latest frame
        self._header = _header(self.origin, state)
        for _ in range(HEADERS):
            self._append(Kind.HEADER, self._header)
            self._append(Kind.BLANK, bytes(-(len(self.data) + OVERHEAD) % BLOCK))
        self.head = len(self.data)
        self._again = 2 * self.head  # where the next header belongs

    @property
    def full(self) -> bool:
        """Whether it is time to close this journal and begin the next."""
        return (
            2 * len(self.data) >= MAX_BYTES
            or 2 * self._records >= MAX_RECORDS
            or 2 * self._rows >= MAX_ROWS
        )

    def frame(
        self,
        frame: Frame,
        t_s: float,
        number: int,
        who: Sequence[int],
        excluded: bool,
        touch: Touch,
    ) -> None:
        """Append a frame; `who` has an index for each of the labellers.

        Raises:
            RecordingError: It could not be read again, or no more is taken.
        """
        image = self._image(frame, f"frame {number}")
        if not (self._t_s < t_s < LATEST_S and self._sequence < number < 1 << 63):
            raise RecordingError(
                f"frame {number} at {t_s} s comes after frame {self._sequence} at {self._t_s} s; "
                "number and time must rise"
            )
        if not all(self._known(value) for value in who):
            raise RecordingError(f"frame {number} has a label that the recording does not name")
        if len(self.data) >= self._again:
            self._again = len(self.data) + min(len(self.data), FARTHEST)
            self._append(Kind.HEADER, self._header)
        row = FRAME.pack(t_s, number, *who, excluded, *touch)
        self._append(Kind.FRAME, row + image)
        self._t_s, self._sequence = t_s, number
        self.frames += 1

    def command(self, command: CommandRecord) -> None:
        """Append what was recognised.

        Raises:
            RecordingError: It could not be read again, or no more is taken.
        """
        c, touch = command, command.touch
        if not (math.isfinite(c.t_s) and math.isfinite(c.probability) and 0 <= c.frame < 1 << 63):
            raise RecordingError(f"the command {c} has a time, frame or probability that is none")
        place = touch if touch is None or all(map(math.isfinite, touch)) else None
        names = (clean(c.gesture), clean(c.command))
        row = (float(c.t_s), int(c.frame), names[0], float(c.probability), place, names[1])
        self._append(Kind.COMMAND, json.dumps(row).encode())
        self._rows += 1

    def mark(self, t_s: float, kind: str, words: str) -> None:
        """Append what happened beside the frames; texts are cut after 1000 characters.

        Raises:
            RecordingError: The time is no number.
        """
        if not abs(t_s) <= LATEST_S:
            raise RecordingError(f"a mark was made at {t_s} s; its time must be a number")
        self._append(Kind.MARK, json.dumps([t_s, clean(kind), clean(words)]).encode())
        self._rows += 1

    def rest(self, frame: Frame) -> None:
        """Append the untouched sensor; the first one counts."""
        self._append(Kind.REST, self._image(frame, "the rest image"))

    def amend(self, column: str, from_s: float, to_s: float, value: int) -> None:
        """Append that a column has another value in the frames so far, of times in [from, to).

        Raises:
            RecordingError: There is no such column, or it cannot have this value.
        """
        possible = value in (0, 1) if column == "excluded" else self._known(value)
        if column not in AMENDABLE or not possible or math.isnan(from_s) or math.isnan(to_s):
            raise RecordingError(
                f"{column!r} cannot become {value} from {from_s} to {to_s} s; there are "
                f"{', '.join(AMENDABLE)}, and the labels of the recording"
            )
        so_far = math.nextafter(self._t_s, math.inf)  # no frame to come, however many are lost
        fields = (AMENDABLE.index(column), from_s, min(to_s, so_far), value)
        self._append(Kind.AMEND, AMEND.pack(*fields))

    def synced(self, offset: int) -> None:
        """Append that everything before `offset` is on the disk."""
        self._append(Kind.SYNCED, SYNCED.pack(offset))

    def _image(self, frame: Frame, what: str) -> bytes:
        """Return a frame's bytes, if the reader will take them."""
        shape = (self.origin.rows, self.origin.columns)
        image = frame.astype("<f4")
        if image.shape != shape or not (np.abs(image) < LARGEST).all():  # NaN is refused as well
            raise RecordingError(
                f"{what} must be {shape[0]}×{shape[1]} numbers below {LARGEST:g}; "
                "look at the sensor"
            )
        return image.tobytes()

    def _known(self, label: int) -> bool:
        return UNKNOWN <= label < len(self.origin.labels)

    def _append(self, kind: Kind, content: bytes) -> None:
        record = encode(kind, self._records, content, len(self.data), self._key)
        if (
            len(self.data) + len(record) > MAX_BYTES
            or self._records >= MAX_RECORDS
            or self._rows >= MAX_ROWS
        ):
            raise RecordingError("the journal is full and takes no more; begin the next recording")
        self.data += record
        self._records += 1


def _header(origin: Provenance, state: State) -> bytes:
    """Return what a header holds: the journal's id, and an .npz of meta and the state."""
    about = meta.text(origin)
    try:
        meta.parse(about)
    except RecordingError as error:
        raise RecordingError(f"no recording can be made: its file {error}") from None
    if not all(a.dtype == np.float64 and np.isfinite(a).all() for a in state.values()):
        raise RecordingError("no recording can be made: the pipeline's state is not all numbers")
    arrays = npz.pack({"meta": np.array(about), **{STATE + n: a for n, a in state.items()}})
    content = bytes.fromhex(origin.id) + arrays
    if max(len(content), len(about) * 4 + sum(a.nbytes for a in state.values())) > MAX_STATE:
        raise RecordingError("no recording can be made: the pipeline remembers too much")
    return content


def clean(words: str) -> str:
    """Return a text that a file of ours can hold: no zeros, no half characters, not too long."""
    return words.replace("\0", "").encode(errors="replace").decode()[: meta.MAX_TEXT]
