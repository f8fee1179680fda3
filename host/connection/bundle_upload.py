"""Upload of a bundle to an orb, in chunks, beside other traffic on the link."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, Literal

from controller.shared.errors import UserError, reason
from controller.shared.files import read_bytes
from controller.shared.notices import notice
from controller.shared.protocol.codec import fitted
from controller.shared.protocol.link_events import Connected, Delivered, Lost, Received
from controller.shared.protocol.messages import (
    DECLINED,
    IN_USE,
    MAX_TEXT,
    PIECE,
    PROVING,
    Message,
    UploadChunk,
    UploadOffer,
    UploadStatus,
)

MOST: Final = 64 << 20  # bytes; an orb takes no more
AHEAD: Final = 16  # pieces under way
PATIENCE_S: Final = 1.0  # without an answer: what was under way is sent again
REPEATS: Final = 30  # without progress, then it is given up
PROOF_REPEATS: Final = 600  # the same while the orb proves it; a slow board may take minutes
PROOFS: Final = 3  # begun, without an outcome; then it is given up as well
NO_OUTCOME: Final = notice("no_outcome")

Stage = Literal["waiting", "sending", "proving", "in use", "declined"]


class BundleUpload:
    """Delivers one file; a lost link interrupts it, and the next connection goes on.

    Attributes:
        stage: "waiting" for a connection; "sending"; "proving", when the orb has all of it; then
            "in use" or "declined", also when it is given up.
        told: The orb's last answer, a sentence; "" if nothing. `NO_OUTCOME` when it is given up.
        offset: Bytes that the orb has.
        size: Bytes of the file.
    """

    def __init__(self, name: str, data: bytes) -> None:
        """Deliver these bytes; `name`, as far as it fits, is for the orb's log."""
        self.stage: Stage = "waiting"
        self.told = ""
        self.offset = 0
        self.size = len(data)
        self._data = data
        self._announced = UploadOffer(
            hashlib.sha256(data).digest(), len(data), fitted(name, MAX_TEXT)
        )
        self._next = 0  # offset of the next piece to send
        self._heard_s = 0.0
        self._there = False  # whether a session is live
        self._repeats = 0  # since the last progress
        self._proofs = 0  # begun

    @property
    def over(self) -> bool:
        """Whether there is nothing left to do."""
        return self.stage in ("in use", "declined")

    def turn(
        self, news: Sequence[Received], now_s: float, send: Callable[[Message], object]
    ) -> None:
        """Take what came since the last turn, and send what it asks for, without waiting.

        `now_s` are seconds that never go back.
        """
        for item in news:
            if self.over:
                return
            if isinstance(item, Connected):
                self._there = True
                self._begin(now_s, send)
            elif isinstance(item, Lost):
                self.stage, self._there = "waiting", False
            elif isinstance(item, Delivered) and isinstance(item.message, UploadStatus):
                self._heard_s = now_s
                self._answer(item.message)
        if self.stage == "sending":
            if now_s - self._heard_s > PATIENCE_S:
                self._heard_s, self._next = now_s, self.offset
                self._repeats += 1
            self._send(send)
        elif self._there and not self.over and now_s - self._heard_s > PATIENCE_S:
            self._begin(now_s, send)  # its answer was lost, or it is still proving
        most = PROOF_REPEATS if self.offset == self.size else REPEATS
        if not self.over and (self._repeats > most or self._proofs > PROOFS):
            self.stage, self.told = "declined", NO_OUTCOME

    def _begin(self, now_s: float, send: Callable[[Message], object]) -> None:
        self._heard_s = now_s
        self._repeats += 1
        send(self._announced)

    def _answer(self, answer: UploadStatus) -> None:
        self.told = answer.text
        before = self.offset
        if answer.state == IN_USE:
            self.stage, self.offset = "in use", self.size
        elif answer.state == DECLINED:
            self.stage = "declined"
        elif answer.state == PROVING:
            self._proofs += self.stage != "proving"
            self.stage, self.offset = "proving", self.size
        else:
            if self.stage != "sending":
                self._next = answer.offset
            self.stage, self.offset = "sending", min(answer.offset, self.size)
            self._next = max(self._next, self.offset)
        if self.offset != before:
            self._repeats = 0

    def _send(self, send: Callable[[Message], object]) -> None:
        while self._next < min(self.size, self.offset + AHEAD * PIECE):
            piece = self._data[self._next : self._next + PIECE]
            if send(UploadChunk(self._next, piece)) is False:
                return
            self._next += len(piece)


def load(path: Path) -> BundleUpload:
    """Return the upload of a file; UserError if it cannot be read, or is no bundle by its size."""
    try:
        data = read_bytes(path, MOST)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {reason(error)}; name a bundle") from None
    if not data:
        raise UserError(f"{path} is empty; name a bundle")
    return BundleUpload(path.name, data)


def outcome(upload: BundleUpload) -> str:
    """Return the sentence about an upload that is over."""
    return notice("refused", upload.told) if upload.stage == "declined" else upload.told
