"""The commands of the training machine: one file each, found by its name (`models NAME`).

A command's file has

    SUMMARY      what it does, in a few words
    DESCRIPTION  the same in sentences
    EXAMPLE      a first thing to try
    add(parser)  its options
    run(arguments) -> int  does it; the exit status

and imports at its top only what every machine has: PyTorch and the like inside `run`, after
`models.cli._options.require`. A command that resumes after Ctrl-C sets the default `resumes`.
"""

import importlib
import pkgutil
from types import ModuleType

from controller.shared.errors import unknown_command


def names() -> list[str]:
    """Return the names of all commands, in alphabetical order."""
    found = [module.name for module in pkgutil.iter_modules(__path__)]
    return sorted(name for name in found if not name.startswith("_"))


def load(name: str) -> ModuleType:
    """Return a command's file."""
    return importlib.import_module(f"{__name__}.{name}")


def require(name: str) -> str:
    """Return the name of a command; raise UserError, which names the nearest, if there is none."""
    known = names()
    if name in known:
        return name
    raise unknown_command("models", name, known)
