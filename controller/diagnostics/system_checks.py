"""Checks of the computer: the inference engine, disk and a link, one row each."""

import os
import shutil
import tempfile
from pathlib import Path
from typing import Final

from controller.bundles.container import BundleError
from controller.bundles.deploy import selftest
from controller.diagnostics.report import Row, Verdict
from controller.links import LinkError, open_link
from controller.shared.notices import notice
from controller.shared.protocol.messages import DEADMAN_MS, HEARTBEAT_MS, VERSION, Welcome

_OTHER: Final = notice("other_version", "pip install 'onnxruntime==1.20.1'")
_LITTLE: Final = 200e6  # bytes free: a session of ten minutes takes some 3 MB
_GRID: Final = (1, 1, 10.0, 10.0)
_TIMES: Final = (HEARTBEAT_MS, DEADMAN_MS)
_WELCOME: Final = Welcome(
    VERSION, 1, "doctor", "OrbTouch", False, *_GRID, *_TIMES, ("null",), ("pause",)
)


def runtime(bundle: Path) -> Row:
    """Return whether ONNX Runtime gives the golden answers of a bundle's networks."""
    name = "onnxruntime"
    try:
        engine = selftest.run(bundle, blocks=0).engine
    except BundleError as error:
        return Row(name, Verdict.FAULT, str(error), _OTHER, "runtime")
    return Row(name, Verdict.GOOD, notice("golden", engine, bundle.name))


def disk(folder: Path) -> Row:
    """Return whether a folder can be written to and has room."""
    place = next((p for p in (folder, *folder.parents) if p.is_dir()), Path())
    try:
        free = shutil.disk_usage(place).free
        with tempfile.TemporaryFile(dir=place, buffering=0) as file:
            file.write(b"doctor")
            os.fsync(file.fileno())
    except OSError as error:
        found = notice("unwritable", place, error.strerror or error)
        return Row("disk", Verdict.FAULT, found, notice("unwritable_advice"), "disk")
    found = notice("free", free / 1e9, place)
    if free < _LITTLE:
        return Row("disk", Verdict.DOUBTFUL, found, notice("room"), "disk")
    return Row("disk", Verdict.GOOD, found)


def link(url: str) -> Row:
    """Return whether a link, named as of `controller --link`, can be opened."""
    try:
        open_link(url, _WELCOME).close()
    except LinkError as error:
        return Row("link", Verdict.FAULT, str(error), "Choose another --link.", "link")
    return Row("link", Verdict.GOOD, f"{url} can be opened")
