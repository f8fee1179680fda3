"""Changes of the bundle during a run: received by the loop, made and tested on a thread."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

from controller.bundles.deploy.upload import UploadReceiver
from controller.recognition.images.frames import Image
from controller.remote.worker import Worker
from controller.runtime.assemble import Parts
from controller.runtime.device import Device
from controller.runtime.loop import Handler
from controller.shared.errors import reason
from controller.shared.notices import notice
from controller.shared.protocol.messages import (
    DECLINED,
    IN_USE,
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
# Has a device take changed parts; None: it takes a new run.
Exchange = Callable[[Parts | None, Device], None]

BUSY: Final = notice("unfinished")

_log = logging.getLogger("controller")


class Loaded(NamedTuple):
    """A bundle that is in use now, read."""

    parts: Parts | None = None  # with it; None: the device cannot take it without a new run
    reports: tuple[Message, ...] = ()  # its description


class BundleUpdater(Handler):
    """Handler of bundles and corrections.

    Attributes:
        loaded: The bundle of the latest change.
        objection: Reason that nothing can be changed, a sentence; "" if it can.
        busy: Whether a change is under way, or its outcome has not been polled yet.
    """

    loaded = Loaded()

    def __init__(
        self,
        upload: UploadReceiver,
        install: Install,
        learn: Learn | None = None,
        load: Callable[[], Loaded] = Loaded,
        exchange: Exchange = lambda parts, device: None,
    ) -> None:
        """Take uploads, and corrections by `learn`; BundleError and OSError refuse one.

        `load` reads the bundle in use after a change, on the thread; `exchange` has the device take
        it.
        """
        self.objection = upload.objection
        self._upload, self._install, self._learn = upload, install, learn
        self._load, self._exchange = load, exchange
        self._worker = Worker()
        self.busy = False
        self._changed = False  # whether the latest change was made

    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        """Return the answer to a part of an upload, or to a correction."""
        if isinstance(message, Correction):
            return [self._correct(message, device)]
        if not isinstance(message, UploadOffer | UploadChunk):
            return None
        answer = self._upload.take(message)
        if self._upload.whole is not None and not self.busy:
            self.begin(partial(self._install, self._upload.whole), _status)
        return [answer]

    def poll(self, device: Device) -> Sequence[Message]:
        """Have the device take a changed bundle; return its description and the outcome."""
        outcome = self._worker.poll()
        if not outcome:
            return ()
        self.busy = False
        if self._upload.whole is not None:  # else it was a correction
            self._upload.remove()
        if not self._changed:
            return outcome
        self._exchange(self.loaded.parts, device)
        return [*self.loaded.reports, *outcome]

    def _correct(self, message: Correction, device: Device) -> UploadStatus:
        """Begin to learn the label of the latest images; return a status."""
        if self.objection or self._learn is None:
            return UploadStatus(DECLINED, 0, self.objection or notice("no_corrections"))
        if self.busy:
            return UploadStatus(DECLINED, 0, BUSY)
        self.begin(partial(self._learn, message.label, device.recent()), _status)
        device.note("correct", message.label or "take back")
        return UploadStatus(PROVING, 0, notice("learning"))

    def begin(self, work: Callable[[], str], answer: Answer) -> None:
        """Begin a change that returns a sentence; `answer` makes the message of its outcome."""
        self.busy = True
        self._worker.begin(lambda: [self._outcome(work, answer)])

    def _outcome(self, work: Callable[[], str], answer: Answer) -> Message:
        self._changed = False
        try:
            text = work()
            self.loaded = self._load()
            self._changed = True
        except OSError as error:
            text = notice("cannot_keep", reason(error))
        except ValueError as error:  # BundleError is one
            text = str(error)
        except Exception as error:  # the host needs an answer in any case
            _log.exception("a bundle could not be taken into use")
            text = notice("crashed", type(error).__name__)
        return answer(self._changed, text)


def _status(done: bool, text: str) -> Message:
    """Return the outcome of an upload or a correction."""
    return UploadStatus(IN_USE if done else DECLINED, 0, text)
