"""Parts of other packages, found by the entry points of installed distributions.

The groups are `orbtouch.sensors`, `orbtouch.links`, `orbtouch.targets` and `orbtouch.taps`. An
entry point has the name on the command line; its value is a module with the `create` of its kind.
"""

from typing import Any

from controller.errors import TroubleError


class PluginError(TroubleError):
    """A part of another package cannot be imported."""


def find(kind: str, name: str) -> Any:
    """Return the module of a part, such as ("sensors", "mat"); None: no package has one.

    Ask only for a name that this program does not have: the look-up reads the list of what is
    installed.
    """
    for entry in _entries(kind):
        if entry.name == name:
            try:
                return entry.load()
            except Exception as error:  # of a stranger's module
                why = " ".join(str(error).split()) or type(error).__name__
                raise PluginError(f"cannot import {entry.value}, {kind} {name!r}: {why}") from None
    return None


def names(kind: str) -> list[str]:
    """Return the names of all parts of a kind in other packages."""
    return sorted({entry.name for entry in _entries(kind)})


def _entries(kind: str) -> Any:
    from importlib.metadata import entry_points  # slow, and seldom needed

    return entry_points(group=f"orbtouch.{kind}")
