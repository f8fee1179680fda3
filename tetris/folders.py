"""Where a player's own files live, by the rules of each system (XDG, macOS, Windows)."""

from pathlib import Path
from typing import Final

import platformdirs

_PROGRAM: Final = "orbtouch"
_ROOM: Final = "tetris"


def data_folder() -> Path:
    """Return the folder of best lists and replays; it may not exist yet."""
    return platformdirs.user_data_path(_PROGRAM, appauthor=False) / _ROOM


def config_folder() -> Path:
    """Return the folder of settings; it may not exist yet."""
    return platformdirs.user_config_path(_PROGRAM, appauthor=False) / _ROOM
