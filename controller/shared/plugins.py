"""Parts of other packages: entry points `orbtouch.sensors`, `.links`, `.targets` and `.taps`.

The name of an entry point is that on the command line; its value is a module with `create`.
"""

from typing import Any

from controller.shared.errors import TroubleError, UserError, one_line


class PluginError(TroubleError):
    """A part of another package cannot be imported, or fails."""


class Part:
    """A module of another package; an error of it names the part, in a printable sentence."""

    def __init__(self, module: Any, what: str) -> None:
        self._module, self._what = module, what

    def __getattr__(self, name: str) -> Any:
        """Return what the module has under a name, such as a sensor's `Options`."""
        try:
            return getattr(self._module, name)
        except AttributeError:
            raise PluginError(f"{self._what} has no {name!r}; ask its author") from None

    def create(self, *args: object) -> Any:
        """Return what the module's `create` makes, or raise a UserError."""
        make = self.__getattr__("create")
        try:
            return make(*args)
        except UserError:
            raise
        except (Exception, SystemExit) as error:  # of another's module
            raise PluginError(f"{self._what} fails: {_reason(error)}") from error


def find(kind: str, name: str) -> Part | None:
    """Return a part, such as ("sensors", "mat"); None: no package has one.

    The look-up is slow, so it is for names that this program does not have.
    """
    for entry in _entries(kind):
        if entry.name == name:
            what = one_line(f"{entry.value}, {kind} {name!r},")
            try:
                return Part(entry.load(), what)
            except (Exception, SystemExit) as error:  # of another's module
                raise PluginError(f"{what} cannot be imported: {_reason(error)}") from None
    return None


def names(kind: str) -> list[str]:
    """Return the names of all parts of a kind in other packages, such as "sensors".

    Nothing is imported.
    """
    return sorted({one_line(entry.name) for entry in _entries(kind)})


def _reason(error: BaseException) -> str:
    return one_line(str(error)) or type(error).__name__


def _entries(kind: str) -> Any:
    from importlib.metadata import entry_points  # slow, and seldom needed

    return entry_points(group=f"orbtouch.{kind}")
