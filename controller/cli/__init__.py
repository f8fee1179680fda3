"""Command lines of the device: argparse, call, print; and the table of the commands."""

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Final

COMMANDS: Final = {  # name: function that runs it, and purpose
    "": ("run:main", "run the device"),
    "teach": ("teach:main", "record examples of your own gestures"),
    "recordings": ("recordings:main", "recover, check and import recordings"),
    "install": ("install:main", "take a bundle into use, or list those of this device"),
    "calibrate": ("calibrate:main", "measure the untouched sensor and keep the result"),
    "doctor": ("doctor:main", "check computer, wiring, sensor and Bluetooth"),
    "pair": ("pair:main", "pair with a host over Bluetooth"),
}


def load(name: str) -> Callable[[Sequence[str]], int]:
    """Return the function of a command, which takes its words and returns its exit status."""
    module, _, function = COMMANDS[name][0].partition(":")
    found: Callable[[Sequence[str]], int] = getattr(import_module(f"{__name__}.{module}"), function)
    return found
