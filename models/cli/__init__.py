"""Command lines of the training machine, a module each; and the table of the commands.

A command's module has

    DESCRIPTION  what it does, in sentences
    EXAMPLE      a first thing to try
    add(parser)  its options
    run(arguments) -> int  does it; the exit status

and imports at its top only what every machine has: PyTorch and the like inside `run`, after
`models.cli._options.require`. A command that resumes after Ctrl-C sets the default `resumes`.
"""

from importlib import import_module
from types import ModuleType
from typing import Final

COMMANDS: Final = {  # name: purpose
    "evaluate": "judge a bundle on sessions that it never saw",
    "folds": "train and judge in folds: each person by a network that never saw them",
    "paper": "repeat the paper's figures and its estimates of information",
    "simulate": "write a data set of simulated sessions",
    "sweep": "run many trainings: learning curves, cross-validation, grids",
    "train": "make a bundle from recordings",
}


def load(name: str) -> ModuleType:
    """Return a command's module."""
    return import_module(f"{__name__}.{name}")
