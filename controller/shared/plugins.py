"""Parts of other packages: entry points `orbtouch.sensors`, `.links`, `.targets` and `.taps`.

The name of an entry point is that on the command line; its value is a module with `create`.
"""

from typing import Any

from controller.shared.errors import TroubleError, one_line


class PluginError(TroubleError):
    """A part of another package cannot be imported."""


def find(kind: str, name: str) -> Any:
    """Return the module of a part, such as ("sensors", "mat"); None: no package has one.

    The look-up is slow, so it is for names that this program does not have.
    """
    for entry in _entries(kind):
        if entry.name == name:
            try:
                return entry.load()
            except (Exception, SystemExit) as error:  # of a stranger's module
                why = one_line(str(error)) or type(error).__name__
                raise PluginError(f"cannot import {entry.value}, {kind} {name!r}: {why}") from None
    return None


def names(kind: str) -> list[str]:
    """Return the names of all parts of a kind in other packages."""
    return sorted({entry.name for entry in _entries(kind)})


def _entries(kind: str) -> Any:
    from importlib.metadata import entry_points  # slow, and seldom needed

    return entry_points(group=f"orbtouch.{kind}")
