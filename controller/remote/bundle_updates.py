"""Changes of the bundle during a run: received by the loop, made and tested on a thread."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

from controller.bundles.deploy.upload import UploadReceiver
from controller.recognition.images.frames import Image
from controller.runtime.parts import Parts
from controller.shared.protocol.codec import fitted
from controller.shared.protocol.messages import (
    DECLINED,
    IN_USE,
    MAX_SENTENCE,
    PROVING,
    Correction,
    Message,
    UploadChunk,
    UploadOffer,
    UploadStatus,
)

Install = Callable[[Path], str]  # tests a file and takes it into use; returns a sentence
# Learns the label of the latest images, (rows, columns) each, and takes the result into use.
Learn = Callable[[str, list[Image]], str]
Answer = Callable[[bool, str], Message]  # of a change: whether it was made, and a sentence

BUSY: Final = "the last change is not finished; try again in a moment"

_log = logging.getLogger("controller")


class Loaded(NamedTuple):
    """A bundle that is in use now, read."""

    parts: Parts | None  # with it; None: the device cannot take it without a new run
    reports: tuple[Message, ...] = ()  # its description


class BundleUpdater:
    """Handler of bundles and corrections that never blocks the loop.

    Attributes:
        switched: Whether a new bundle is in use, which the device has not taken yet.
        loaded: That bundle.
        objection: Reason that nothing can be changed, a sentence; "" if it can.
    """

    switched, loaded = False, Loaded(None)

    def __init__(
        self,
        upload: UploadReceiver,
        install: Install,
        learn: Learn | None = None,
        load: Callable[[], Loaded] = lambda: Loaded(None),
    ) -> None:
        """Take uploads, and corrections by `learn`; BundleError and OSError refuse one.

        `load` reads the bundle in use after a change.
        """
        self.objection = upload.objection
        self._upload, self._install, self._learn, self._load = upload, install, learn, load
        self._thread: threading.Thread | None = None
        self._outcome: Message | None = None

    @property
    def busy(self) -> bool:
        """Whether a change is under way, or its outcome has not been polled yet."""
        return self._thread is not None

    def take(self, message: UploadOffer | UploadChunk) -> UploadStatus:
        """Return the answer to a part of an upload."""
        answer = self._upload.take(message)
        if self._upload.whole is not None and self._thread is None:
            self.begin(partial(self._install, self._upload.whole), _status)
        return answer

    def correct(self, message: Correction, images: list[Image]) -> UploadStatus:
        """Begin to learn the label of the latest images, (rows, columns) each; return a status."""
        if self._upload.objection or self._learn is None:
            reason = self._upload.objection or "corrections are not possible here"
            return UploadStatus(DECLINED, 0, reason)
        if self.busy:
            return UploadStatus(DECLINED, 0, BUSY)
        self.begin(partial(self._learn, message.label, images), _status)
        return UploadStatus(PROVING, 0, "learning")

    def poll(self) -> Message | None:
        """Return the outcome of a change, once, without waiting."""
        if self._thread is None or self._thread.is_alive():
            return None
        self._thread = None
        if self._upload.whole is not None:  # else it was a correction
            self._upload.remove()
        outcome, self._outcome = self._outcome, None
        return outcome

    def begin(self, work: Callable[[], str], answer: Answer) -> None:
        """Begin a change that returns a sentence; `answer` makes the message of its outcome."""
        arguments = work, answer
        self._thread = threading.Thread(
            target=self._do, args=arguments, name="updater", daemon=True
        )
        self._thread.start()

    def _do(self, work: Callable[[], str], answer: Answer) -> None:
        done = False
        try:
            text = work()
            self.loaded = self._load()
            self.switched = done = True
        except OSError as error:
            text = f"the orb cannot keep it: {error.strerror or error}"
        except ValueError as error:  # BundleError is one
            text = str(error)
        except Exception as error:  # the host needs an answer in any case
            _log.exception("a bundle could not be taken into use")
            text = f"{type(error).__name__} on the orb; see its log"
        self._outcome = answer(done, fitted(text, MAX_SENTENCE))


def _status(done: bool, text: str) -> Message:
    """Return the outcome of an upload or a correction."""
    return UploadStatus(IN_USE if done else DECLINED, 0, text)
