"""Where a user's own files are: what platformdirs says, which on Linux need not be asked.

To import it takes 3 ms of each start, with the temporary files and random numbers that it imports;
on Linux its answer is one line of the XDG Base Directory Specification.
"""

import os
import sys
from pathlib import Path
from typing import Final

_NAME: Final = "orbtouch"
_USUAL: Final = {"data": ".local/share", "state": ".local/state"}  # below the home


def data() -> Path:
    """Return the folder of what is kept for good: bundles."""
    return _folder("data")


def state() -> Path:
    """Return the folder of what was found out and can be found out again: calibrations, hosts."""
    return _folder("state")


def _folder(kind: str) -> Path:
    home, given = os.environ.get("HOME", ""), os.environ.get(f"XDG_{kind.upper()}_HOME", "")
    absolute = home.startswith("/") and given[:1] in ("", "/")
    if sys.platform == "linux" and absolute and "ANDROID_ROOT" not in os.environ:
        return Path(given or Path(home, _USUAL[kind]), _NAME)
    import platformdirs

    ask = {"data": platformdirs.user_data_path, "state": platformdirs.user_state_path}
    return ask[kind](_NAME, appauthor=False)
