"""Options that several commands have, kinds of values, and the check for optional packages."""

import argparse
import os
from dataclasses import fields
from importlib.util import find_spec
from typing import Any, Final

from controller.shared.arguments import number, whole
from controller.shared.errors import how_to_install
from models.data.examples import CHOICES, WINDOWS

# Module -> its package name.
PACKAGES: Final = {
    "torch": "torch",
    "onnx": "onnx",
    "tomli_w": "tomli-w",
    "matplotlib": "matplotlib",
    "sklearn": "scikit-learn",
    "distributed": "dask[distributed]",
}
# PyTorch with one thread, and a GPU that adds up in one order.
ENVIRONMENT: Final = {"OMP_NUM_THREADS": "1", "CUBLAS_WORKSPACE_CONFIG": ":4096:8"}


def require(what: str, *modules: str, extra: str = "train") -> None:
    """Check for optional packages; where PyTorch is among them, prepare its environment.

    Args:
        what: The purpose: "training".
        modules: Required modules, of `PACKAGES`; else a ValueError says how to install them.
        extra: The extra of pyproject.toml that holds them.
    """
    missing = [PACKAGES[module] for module in modules if find_spec(module) is None]
    if missing:
        raise ValueError(
            f"{what} needs {' and '.join(missing)}; install it with: {how_to_install(extra)}"
        )
    if "torch" in modules:
        for name, value in ENVIRONMENT.items():  # before PyTorch is imported
            os.environ.setdefault(name, value)


def chosen(arguments: argparse.Namespace, kind: type[Any]) -> dict[str, Any]:
    """Return the values of options that are fields of a dataclass, by name."""
    given = vars(arguments)
    return {field.name: given[field.name] for field in fields(kind) if field.name in given}


def take(parser: argparse.ArgumentParser, *names: str) -> None:
    """Add options of `SHARED` by name."""
    for name in names:
        parser.add_argument(f"--{name}", **SHARED[name])


count = whole(1, 100_000)
seed = whole(0, 2**32 - 1)
taxels = whole(2, 32)  # along a side of the grid
minutes = number(0.5, 600.0)  # of a session
SHARED: Final[dict[str, dict[str, Any]]] = {
    "labels": {
        "choices": CHOICES,
        "default": "auto",
        "help": "source of the labels (default: auto: the truth where it is known, else the first "
        "of people's labels that names a gesture; these are moved to where the touches were)",
    },
    "all": {
        "dest": "every",
        "action": "store_true",
        "help": "learn from recordings that fail the check, too (controller recordings)",
    },
    "window": {
        "type": whole(*WINDOWS),
        "default": 0,
        "metavar": "N",
        "help": "images in a window (default: those of one second)",
    },
    "seed": {
        "type": seed,
        "default": 0,
        "metavar": "S",
        "help": "of everything random; 900000 to 999999 are for tests only (default: 0)",
    },
}
