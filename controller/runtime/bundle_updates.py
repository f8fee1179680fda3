"""Deliveries while the orb is played: the loop takes pieces, a thread proves, the loop switches."""

import logging
import threading
from collections.abc import Callable
from pathlib import Path

from controller.bundles.deploy.upload import UploadReceiver
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
from controller.recognition.preprocess import Image

Install = Callable[[Path], str]  # proves a file and takes it into use; returns a sentence
# Learns what the latest images were and takes that into use; returns a sentence.
Learn = Callable[[str, list[Image]], str]

_log = logging.getLogger("controller")


class BundleUpdater:
    """Sees to deliveries, and never keeps the loop waiting.

    Attributes:
        switched: Whether a new bundle is in use; the loop begins anew with it.
    """

    def __init__(
        self, intake: UploadReceiver, install: Install, learn: Learn | None = None
    ) -> None:
        """Take deliveries and corrections.

        Args:
            intake: Takes the pieces of a delivery.
            install: Raises BundleError or OSError if it does not go through.
            learn: Likewise, or ValueError; None: nothing can be learned here.
        """
        self.switched = False
        self._intake, self._install, self._learn = intake, install, learn
        self._thread: threading.Thread | None = None
        self._outcome: UploadStatus | None = None

    def take(self, message: UploadOffer | UploadChunk) -> UploadStatus:
        """Return the answer to what a host says."""
        answer = self._intake.take(message)
        if self._intake.whole is not None and self._thread is None:
            path = self._intake.whole
            self._begin(lambda: self._install(path))
        return answer

    def correct(self, message: Correction, images: list[Image]) -> UploadStatus:
        """Begin to learn what the latest images were; return the answer for now."""
        if self._intake.objection or self._learn is None:
            return UploadStatus(
                DECLINED, 0, self._intake.objection or "nothing can be learned here"
            )
        if self._thread is not None:
            return UploadStatus(
                DECLINED, 0, "still busy with the last one; say it again in a moment"
            )
        learn = self._learn
        self._begin(lambda: learn(message.label, images))
        return UploadStatus(PROVING, 0, "learning")

    def poll(self) -> UploadStatus | None:
        """Return how a proof went, once, without waiting."""
        if self._thread is None or self._thread.is_alive():
            return None
        self._thread = None
        if self._intake.whole is not None:  # else it was a correction
            self._intake.remove()
        outcome, self._outcome = self._outcome, None
        self.switched = outcome is not None and outcome.state == IN_USE
        return outcome

    def _begin(self, work: Callable[[], str]) -> None:
        self._thread = threading.Thread(target=self._do, args=(work,), name="clerk", daemon=True)
        self._thread.start()

    def _do(self, work: Callable[[], str]) -> None:
        try:
            state, told = IN_USE, work()
        except OSError as error:
            state, told = DECLINED, f"the orb cannot keep it: {error.strerror or error}"
        except ValueError as error:  # BundleError is one
            state, told = DECLINED, str(error)
        except Exception as error:  # the host waits for an answer, whatever went wrong
            _log.exception("a bundle could not be taken into use")
            state, told = DECLINED, f"{type(error).__name__} on the orb; its log says more"
        self._outcome = UploadStatus(state, 0, fitted(told, MAX_SENTENCE))
