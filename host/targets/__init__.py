"""Targets of commands, found by name: a module each, and two kinds of keys."""

import importlib
import pkgutil
from typing import cast

from host.targets.base import Target, TargetError, TargetOptions

__all__ = ["Target", "TargetError", "TargetOptions", "load", "names"]

_KEYS = ("keyboard", "gamepad")  # kinds of `host.targets.keys`
_SHARED = ("base", "keys")  # modules that are no target


def names() -> tuple[str, ...]:
    """Return the names of all targets."""
    found = {module.name for module in pkgutil.iter_modules(__path__)}
    return tuple(sorted(found.difference(_SHARED).union(_KEYS)))


def load(name: str, options: TargetOptions | None = None) -> Target:
    """Make a target: `create(options)` of the module of that name.

    TargetError, another UserError of an option, or BackendError if it cannot press keys here.
    """
    if name not in names():
        raise TargetError(f"there is no target {name!r}; there are: {', '.join(names())}")
    module = importlib.import_module(f"{__name__}.{'keys' if name in _KEYS else name}")
    kind = (name,) if name in _KEYS else ()
    return cast(Target, module.create(*kind, options or TargetOptions()))
