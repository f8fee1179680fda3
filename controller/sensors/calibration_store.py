"""Stored calibrations, under the device's identity: the untouched frame, or the learned scale."""

import json
import logging
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.baseline import StoredBaseline
from controller.recognition.images.frames import Frame
from controller.sensors.hardware.description import UNNAMED
from controller.shared import files
from controller.shared.config import parse_json

VERSION: Final = 1
_SMALLEST, _LARGEST = 1e-3, 1e9  # what a rest value may be
_SMALLEST_SCALE: Final = 1e-6
_LONGEST: Final = 100  # letters of a file's name
_MAX_BYTES: Final = 4 << 20  # of a file: some hundred thousand taxels

_log = logging.getLogger("controller")


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """One calibration."""

    rest: Frame  # what the untouched sensor read, (rows, columns), picofarads
    idle: float  # mean of |z - 1| meanwhile
    rate_hz: float  # frames per second
    depth: float = 1.0  # factor of estimated depths

    def known(self, rate_hz: float) -> StoredBaseline:
        """Return the same for the preprocessor of a rate: a shorter scan is noisier."""
        idle = self.idle * math.sqrt(rate_hz / self.rate_hz)
        return StoredBaseline(self.rest, idle, self.depth)


def folder() -> Path:
    """Return where calibrations are kept."""
    return files.state_folder() / "calibrations"


def path(device_id: str) -> Path:
    """Return the file of a device."""
    return folder() / f"{quote(device_id, safe=' ')[:_LONGEST] or 'unknown'}.json"


def save(device_id: str, calibration: Calibration) -> Path:
    """Keep a calibration in the place of the last one; return its file, or raise OSError."""
    return _write(
        device_id,
        idle=round(calibration.idle, 6),
        rate_hz=calibration.rate_hz,
        depth=round(calibration.depth, 4),
        rest_pf=[[round(float(v), 4) for v in row] for row in calibration.rest],
    )


def load(device_id: str) -> Calibration | None:
    """Return what is kept of a device; None: nothing, or nothing that can be used."""
    try:
        plain = _plain(device_id)
        if plain is None or "rest_pf" not in plain:
            return None
        rest, idle = _rest(plain["rest_pf"]), float(plain["idle"])
        rate_hz, depth = float(plain["rate_hz"]), float(plain.get("depth", 1.0))
        if not (math.isfinite(idle) and 0.0 <= idle < 1.0 and 0.1 <= rate_hz <= 1000.0):
            raise ValueError("its noise is out of range")
        if not 0.1 <= depth <= 10.0:
            raise ValueError("its factor of depths is out of range")
        return Calibration(rest, idle, rate_hz, depth)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        _log.warning("%s is no calibration (%s), so rest is taken anew", path(device_id), error)
        return None


def keep_scale(device_id: str, scale: float) -> None:
    """Keep the scale of a sensor that has no rest in picofarads, or raise OSError.

    That of a sensor without a name is not kept: another one may be plugged in at the next start.
    """
    if device_id != UNNAMED:
        _write(device_id, scale=scale)


def scale(device_id: str) -> float:
    """Return the scale that is kept of a device; 0: none, or none that can be used."""
    try:
        kept = float((_plain(device_id) or {}).get("scale", 0.0))
    except (OSError, ValueError, KeyError, TypeError):
        return 0.0
    return kept if _SMALLEST_SCALE <= kept <= _LARGEST else 0.0


def forget(device_id: str) -> bool:
    """Remove what is kept of a device; return whether there was something, or raise OSError."""
    file = path(device_id)
    there = file.exists()
    file.unlink(missing_ok=True)
    return there


def _write(device_id: str, **entries: Any) -> Path:
    """Keep entries in the file of a device, alone, and return it."""
    plain = {"version": VERSION, "device_id": device_id, **entries}
    files.atomic_write(path(device_id), json.dumps(plain, indent=1).encode())
    return path(device_id)


def _plain(device_id: str) -> dict[str, Any] | None:
    """Return the table in the file of a device; None if it is of another one or form."""
    plain: dict[str, Any] = parse_json(files.read_bytes(path(device_id), _MAX_BYTES), _MAX_BYTES)
    fits = plain["version"] == VERSION and plain["device_id"] == device_id
    return plain if fits else None


def _rest(values: Any) -> NDArray[np.float32]:
    """Return a rest image, (rows, columns), picofarads, checked."""
    rest = np.array(values, dtype=np.float32)
    sound = rest.ndim == 2 and rest.size > 0 and bool(np.isfinite(rest).all())
    if not sound or rest.min() < _SMALLEST or rest.max() > _LARGEST:
        raise ValueError("its values are no picofarads")
    return rest
