"""Folders of a user's own files, as platformdirs and the XDG specification have them."""

import os
from pathlib import Path
from typing import Final

import platformdirs

_NAME: Final = "orbtouch"


def data() -> Path:
    """Return the folder of what is kept for good: bundles."""
    return _absolute(platformdirs.user_data_path(_NAME, appauthor=False), ".local/share")


def state() -> Path:
    """Return the folder of what was found out and can be found out again: calibrations, hosts."""
    return _absolute(platformdirs.user_state_path(_NAME, appauthor=False), ".local/state")


def config() -> Path:
    """Return the folder of what the user chose: the host's devices."""
    return _absolute(platformdirs.user_config_path(_NAME, appauthor=False), ".config")


def runtime() -> Path:
    """Return the folder of what holds while a program runs; `state` if the system has none."""
    given = os.environ.get("XDG_RUNTIME_DIR", "")
    return Path(given, _NAME) if os.path.isabs(given) else state()  # noqa: PTH117


def _absolute(found: Path, usual: str) -> Path:
    """Return a folder; a relative XDG variable, which old platformdirs take, is ignored."""
    return found if found.is_absolute() else Path.home() / usual / _NAME
