"""Bundle updates and corrections during a run: received by the loop, tested on a thread."""

import logging
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from controller.adapt import correction
from controller.bundles.bundle import BundleError
from controller.bundles.deploy.install import install
from controller.bundles.deploy.store import BundleStore
from controller.bundles.deploy.upload import UploadReceiver
from controller.links import PRINT
from controller.protocol.codec import fitted
from controller.protocol.messages import (
    DECLINED,
    IN_USE,
    MAX_SENTENCE,
    PROVING,
    Correction,
    UploadChunk,
    UploadOffer,
    UploadStatus,
)
from controller.recognition.frames import Image
from controller.runtime.assemble import Parts

Install = Callable[[Path], str]  # tests a file and takes it into use; returns a sentence
# Learns the label of the latest images, (rows, columns) each, and takes the result into use.
Learn = Callable[[str, list[Image]], str]

_log = logging.getLogger("controller")


class BundleUpdater:
    """Handler of bundles and corrections that never blocks the loop.

    `switched` says that a new bundle is in use, with which the loop has to start again.
    """

    def __init__(
        self, upload: UploadReceiver, install: Install, learn: Learn | None = None
    ) -> None:
        """Take uploads, and corrections by `learn`; BundleError and OSError refuse one."""
        self.switched = False
        self._upload, self._install, self._learn = upload, install, learn
        self._thread: threading.Thread | None = None
        self._outcome: UploadStatus | None = None

    def take(self, message: UploadOffer | UploadChunk) -> UploadStatus:
        """Return the answer to a part of an upload."""
        answer = self._upload.take(message)
        if self._upload.whole is not None and self._thread is None:
            self._begin(partial(self._install, self._upload.whole))
        return answer

    def correct(self, message: Correction, images: list[Image]) -> UploadStatus:
        """Begin to learn the label of the latest images, (rows, columns) each; return a status."""
        if self._upload.objection or self._learn is None:
            reason = self._upload.objection or "corrections are not possible here"
            return UploadStatus(DECLINED, 0, reason)
        if self._thread is not None:
            reason = "the last one is not finished; try again in a moment"
            return UploadStatus(DECLINED, 0, reason)
        self._begin(partial(self._learn, message.label, images))
        return UploadStatus(PROVING, 0, "learning")

    def poll(self) -> UploadStatus | None:
        """Return the outcome of an upload or correction, once, without waiting."""
        if self._thread is None or self._thread.is_alive():
            return None
        self._thread = None
        if self._upload.whole is not None:  # else it was a correction
            self._upload.remove()
        outcome, self._outcome = self._outcome, None
        self.switched = outcome is not None and outcome.state == IN_USE
        return outcome

    def _begin(self, work: Callable[[], str]) -> None:
        self._thread = threading.Thread(target=self._do, args=(work,), name="updater", daemon=True)
        self._thread.start()

    def _do(self, work: Callable[[], str]) -> None:
        try:
            state, text = IN_USE, work()
        except OSError as error:
            state, text = DECLINED, f"the orb cannot keep it: {error.strerror or error}"
        except ValueError as error:  # BundleError is one
            state, text = DECLINED, str(error)
        except Exception as error:  # the host needs an answer in any case
            _log.exception("a bundle could not be taken into use")
            state, text = DECLINED, f"{type(error).__name__} on the orb; see its log"
        self._outcome = UploadStatus(state, 0, fitted(text, MAX_SENTENCE))


def updater(parts: Parts) -> BundleUpdater | None:
    """Return the handler of bundles and corrections; None for a link without them."""
    if parts.options.link == PRINT or parts.options.replay is not None:
        return None
    objection = ""
    if not parts.link.authenticated:
        objection = (
            "this link does not authenticate its hosts; give orb and host the same --key FILE, or "
            "copy the bundle to the orb and run `controller install` there"
        )
    elif parts.options.bundle is not None:
        objection = "this orb was started with a --bundle of its own"
    store = BundleStore()

    def take_into_use(path: Path, corrects: str | None = None) -> str:
        return install(path, store, other_sensor=False, report=_log.info, corrects=corrects)

    def learn(label: str, images: list[Image]) -> str:
        if label and label not in parts.bundle.labels:
            raise BundleError(f"there is no gesture {label!r}")
        stack = np.array(images, dtype=np.float32)
        return correction.correct(label, stack, parts.bundle.rate_hz, store, take_into_use)

    return BundleUpdater(UploadReceiver(store.folder, objection), take_into_use, learn)
