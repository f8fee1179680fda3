"""Handlers of a host's requests for one run; the loop offers each request to all of them."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np

from controller.adapt import process
from controller.bundles.container import BundleError
from controller.bundles.deploy.install import install
from controller.bundles.deploy.store import BundleStore
from controller.bundles.deploy.upload import UploadReceiver
from controller.recognition.images.frames import Image
from controller.remote.bundle_updates import BundleUpdater, Exchange, Loaded
from controller.remote.examples import ExampleStore, ExampleTaker
from controller.remote.gesture_reports import Describer
from controller.remote.link_check import LinkCheck
from controller.remote.link_recording import LinkRecording
from controller.remote.teacher import Refusal, Teacher
from controller.remote.worker import Worker
from controller.runtime.assemble import Parts
from controller.runtime.loop import Handler
from controller.runtime.renewal import refreshed
from controller.shared import files
from controller.shared.errors import UserError
from controller.shared.notices import notice

_log = logging.getLogger("controller")


def handlers(current: Callable[[], Parts], exchange: Exchange) -> list[Handler]:
    """Return the handlers of requests; `exchange` has a device take changed parts."""
    store, objection = BundleStore(), _objection(current())

    def take_into_use(path: Path, corrects: str | None = None) -> str:
        return install(path, store, other_sensor=False, report=_log.info, corrects=corrects)

    def learn(label: str, images: list[Image]) -> str:
        bundle = current().bundle
        if label and label not in bundle.labels:
            raise BundleError(notice("no_gesture", label))
        stack = np.array(images, dtype=np.float32)
        return process.correct(label, stack, bundle.rate_hz, store, take_into_use)

    def load() -> Loaded:
        try:
            new = refreshed(current())
        except UserError:  # such as a --mapping with a gesture that it lacks
            store.use(store.record().previous or "")
            raise
        return Loaded(new, () if new is None else describer.describe(new))

    upload = UploadReceiver(store.folder, objection)
    updater = BundleUpdater(upload, take_into_use, learn, load, exchange)
    folder, worker, bundle = files.data_folder() / "teaching", Worker(), current().bundle
    grid = bundle.rows, bundle.columns
    examples = ExampleStore(folder / "examples", grid, bundle.rate_hz)
    describer = Describer(current, worker, examples, folder, objection)
    if objection:
        return [updater, describer, Refusal(objection)]
    return [
        updater,
        describer,
        LinkRecording(folder / "recordings", worker, current),
        ExampleTaker(examples, worker),
        LinkCheck(current),
        Teacher(updater, current, store, take_into_use, folder, worker, examples),
    ]


def _objection(parts: Parts) -> str:
    """Return the reason that nothing can be changed, a sentence; "" if it can."""
    if parts.options.replay is not None:
        return notice("replays")
    if not parts.link.authenticated:
        return notice("open_link")
    if parts.options.bundle is not None:
        return notice("own_bundle")
    return ""
