"""Take a bundle that a host sends in pieces; what is here survives a lost link, and lost power.

The pieces go into `FOLDER/incoming/DIGEST.part`. A host that comes back hears how much there is,
and goes on; whether the whole is what was announced its SHA-256 tells at the end.
"""

import contextlib
import hashlib
from pathlib import Path
from typing import Final

from controller.bundles.bundle import MAX_BYTES
from controller.protocol.messages import (
    DECLINED,
    PROVING,
    WANTED,
    UploadChunk,
    UploadOffer,
    UploadStatus,
)

FOLDER: Final = "incoming"


class UploadReceiver:
    """One delivery at a time.

    Attributes:
        whole: The file, once all of it is here and is what was announced.
        objection: Why nothing may be delivered; "": it may.
    """

    def __init__(self, shelf: Path, objection: str = "") -> None:
        """Take deliveries into a shelf's folder.

        Args:
            shelf: The folder of bundles.
            objection: Why this link may deliver nothing; "": it may.
        """
        self.whole: Path | None = None
        self._folder = shelf / FOLDER
        self.objection = objection
        self._announced: UploadOffer | None = None
        self._have = 0

    def take(self, message: UploadOffer | UploadChunk) -> UploadStatus:
        """Take an announcement or a piece, and return how it stands."""
        try:
            return self._begin(message) if isinstance(message, UploadOffer) else self._add(message)
        except OSError as error:
            self._announced = None
            return UploadStatus(DECLINED, 0, f"the orb cannot keep it: {error.strerror or error}")

    def remove(self) -> None:
        """Delete what was delivered."""
        self._announced = self.whole = None
        for path in self._folder.glob("*.part"):
            with contextlib.suppress(OSError):
                path.unlink()

    def _begin(self, announced: UploadOffer) -> UploadStatus:
        if self.objection:
            return UploadStatus(DECLINED, 0, self.objection)
        if len(announced.digest) != hashlib.sha256().digest_size or announced.size < 1:
            return UploadStatus(DECLINED, 0, "that announces no file")
        if announced.size > MAX_BYTES:
            return UploadStatus(DECLINED, 0, f"{announced.size} bytes are more than {MAX_BYTES}")
        if self.whole is not None:
            return UploadStatus(PROVING, announced.size, "")
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._path(announced)
        for other in self._folder.glob("*.part"):
            if other != path:
                other.unlink()
        with path.open("ab") as file:
            self._have = file.tell()
            if self._have > announced.size:
                self._have = file.truncate(0)
        self._announced = announced
        return self._stand(announced)

    def _add(self, piece: UploadChunk) -> UploadStatus:
        announced = self._announced
        if announced is None:
            return UploadStatus(DECLINED, 0, "nothing was announced")
        # A piece that is not the next one tells that some were lost, or came twice.
        fits = piece.offset == self._have and self._have + len(piece.data) <= announced.size
        if fits and piece.data:
            with self._path(announced).open("ab") as file:
                file.write(piece.data)
            self._have += len(piece.data)
        return self._stand(announced)

    def _stand(self, announced: UploadOffer) -> UploadStatus:
        """Return what is wanted, or look at what there is if that is all."""
        if self._have < announced.size:
            return UploadStatus(WANTED, self._have, "")
        path = self._path(announced)
        self._announced = None
        if hashlib.sha256(path.read_bytes()).digest() != announced.digest:
            path.unlink()
            return UploadStatus(
                DECLINED, 0, "what arrived is not what was announced; send it again"
            )
        self.whole = path
        return UploadStatus(PROVING, announced.size, "")

    def _path(self, announced: UploadOffer) -> Path:
        return self._folder / f"{announced.digest.hex()}.part"
