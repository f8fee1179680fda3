"""Chunked upload of a bundle, resumable after a lost link or a power cut.

The chunks go into `FOLDER/incoming/DIGEST.part`. A host that reconnects gets the number of bytes
received and continues there; at the end the SHA-256 of the file is compared.
"""

import contextlib
import hashlib
from pathlib import Path

from controller.bundles.container import MAX_BYTES
from controller.bundles.deploy.store import INCOMING
from controller.shared.errors import reason
from controller.shared.notices import notice
from controller.shared.protocol.messages import (
    DECLINED,
    PROVING,
    WANTED,
    UploadChunk,
    UploadOffer,
    UploadStatus,
)


class UploadReceiver:
    """Receiver of one upload at a time: `whole` is the complete file, None before."""

    def __init__(self, store: Path, objection: str = "") -> None:
        """Receive into the folder of the bundle store; decline all if there is an objection."""
        self.whole: Path | None = None
        self.objection = objection
        self._folder = store / INCOMING
        self._offer: UploadOffer | None = None
        self._size = 0  # bytes received

    def take(self, message: UploadOffer | UploadChunk) -> UploadStatus:
        """Process an offer or a chunk, and return the status of the upload."""
        try:
            return self._begin(message) if isinstance(message, UploadOffer) else self._add(message)
        except OSError as error:
            self._offer = None
            return UploadStatus(DECLINED, 0, notice("cannot_keep", reason(error)))

    def remove(self) -> None:
        """Delete uploaded files."""
        self._offer = self.whole = None
        for path in self._folder.glob("*.part"):
            with contextlib.suppress(OSError):
                path.unlink()

    def _begin(self, offer: UploadOffer) -> UploadStatus:
        if self.objection:
            return UploadStatus(DECLINED, 0, self.objection)
        if len(offer.digest) != hashlib.sha256().digest_size or offer.size < 1:
            return UploadStatus(DECLINED, 0, "that announces no file")
        if offer.size > MAX_BYTES:
            return UploadStatus(DECLINED, 0, f"{offer.size} bytes are more than {MAX_BYTES}")
        if self.whole is not None:
            return UploadStatus(PROVING, offer.size, "")
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._path(offer)
        for other in self._folder.glob("*.part"):
            if other != path:
                other.unlink()
        with path.open("ab") as file:
            self._size = file.tell()
            if self._size > offer.size:
                self._size = file.truncate(0)
        self._offer = offer
        return self._status(offer)

    def _add(self, chunk: UploadChunk) -> UploadStatus:
        offer = self._offer
        if offer is None:
            return UploadStatus(DECLINED, 0, "nothing was announced")
        # A chunk at another offset follows a lost chunk, or was sent twice.
        fits = chunk.offset == self._size and self._size + len(chunk.data) <= offer.size
        if fits and chunk.data:
            with self._path(offer).open("ab") as file:
                file.write(chunk.data)
            self._size += len(chunk.data)
        return self._status(offer)

    def _status(self, offer: UploadOffer) -> UploadStatus:
        """Return the status after a chunk; compare the hash if the file is complete."""
        if self._size < offer.size:
            return UploadStatus(WANTED, self._size, "")
        path = self._path(offer)
        self._offer = None
        if hashlib.sha256(path.read_bytes()).digest() != offer.digest:
            path.unlink()
            return UploadStatus(DECLINED, 0, notice("garbled"))
        self.whole = path
        return UploadStatus(PROVING, offer.size, "")

    def _path(self, offer: UploadOffer) -> Path:
        return self._folder / f"{offer.digest.hex()}.part"
