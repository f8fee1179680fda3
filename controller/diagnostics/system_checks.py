"""Checks of the computer: the inference engine and disk, one row each."""

import os
import shutil
import tempfile
from pathlib import Path
from typing import Final

from controller.bundles.container import BundleError
from controller.bundles.deploy import selftest
from controller.diagnostics.report import Row, Verdict
from controller.shared.notices import notice

_OTHER: Final = notice("other_version", "pip install 'onnxruntime==1.20.1'")
_LITTLE: Final = 200e6  # bytes free: a session of ten minutes takes some 3 MB


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
