"""Handlers of a host's requests that change the bundle in use, for one run."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np

from controller.adapt import correction
from controller.bundles.container import BundleError
from controller.bundles.deploy.install import install
from controller.bundles.deploy.store import BundleStore
from controller.bundles.deploy.upload import UploadReceiver
from controller.recognition.images.frames import Image
from controller.remote.bundle_updates import BundleUpdater, Loaded
from controller.remote.teacher import Teacher
from controller.runtime.parts import Parts
from controller.runtime.renewal import refreshed
from controller.shared.errors import UserError

_log = logging.getLogger("controller")


def handlers(current: Callable[[], Parts]) -> tuple[BundleUpdater, Teacher]:
    """Return the handlers of changes of the current parts."""
    parts = current()
    objection = ""
    if parts.options.replay is not None:
        objection = "this orb replays a recording, so it cannot be changed"
    elif not parts.link.authenticated:
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
        bundle = current().bundle
        if label and label not in bundle.labels:
            raise BundleError(f"there is no gesture {label!r}")
        stack = np.array(images, dtype=np.float32)
        return correction.correct(label, stack, bundle.rate_hz, store, take_into_use)

    def load() -> Loaded:
        try:
            new = refreshed(current())
        except UserError:  # such as a --mapping with a gesture that it lacks
            store.use(store.record().previous or "")
            raise
        return Loaded(new, () if new is None else teacher.describe(new))

    handler = BundleUpdater(UploadReceiver(store.folder, objection), take_into_use, learn, load)
    teacher = Teacher(handler, current, store, take_into_use)
    return handler, teacher
