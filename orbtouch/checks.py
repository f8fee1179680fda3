"""Checks of what a program hands over: wrong types and values are one sentence before work."""

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.recognition.images.frames import MOST_WINDOW
from controller.shared.errors import UserError, reason

# Advice of the command line, and its like in Python
_WORDS: Final = {
    "name a file made with --record": "arrays become one by Recording.from_arrays",
    "choose another with --bundle": "load another network",
    "choose another bundle": "load another network",
}


@contextmanager
def sentences() -> Iterator[None]:
    """Raise errors of the implementation as `Error`, in words of the interface."""
    try:
        yield
    except (UserError, ValueError, OSError) as error:
        text = f"{error.filename}: {reason(error)}" if isinstance(error, OSError) else str(error)
        text = f"the bundle {text}" if text.startswith(("has ", "is ")) else text
        for words, own in _WORDS.items():
            text = text.replace(words, own)
        raise UserError(text) from error.__cause__


def needed(module: str, what: str, install: str) -> Any:
    """Return an optional module; Error, with the command that installs it, if it is missing."""
    try:
        return import_module(module)
    except ImportError:
        name = module.partition(".")[0]
        raise UserError(f"{what} needs {name}; install it with: {install}") from None


def number(value: object, what: str, least: float, most: float) -> None:
    """Raise Error unless a value is a number from `least` to `most`."""
    real = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if not real or not least <= float(value) <= most:  # type: ignore[arg-type]
        bound = f"{least:g} or more" if most == math.inf else f"from {least:g} to {most:g}"
        raise UserError(f"{what} = {value!r}; expected is a number {bound}")


def whole(value: object, what: str, least: int, most: int) -> None:
    """Raise Error unless a value is a whole number from `least` to `most`."""
    number(value, what, least, most)
    if not isinstance(value, int | np.integer):
        raise UserError(f"{what} = {value!r}; expected is a whole number")


def window(value: object) -> None:
    """Raise Error unless a value is a number of images in a window, or 0."""
    whole(value, "window", 0 if value == 0 else 2, MOST_WINDOW)


def path(value: object) -> Path:
    """Return a path; Error for anything else."""
    if not isinstance(value, str | os.PathLike):
        raise UserError(f"a {type(value).__name__} is no path; save it first, and name its file")
    return Path(value)


def options(given: Iterable[str], known: Sequence[str]) -> None:
    """Raise Error unless all keywords are known."""
    if odd := [name for name in given if name not in known]:
        raise UserError(f"there is no option {odd[0]!r}; there are {', '.join(known)}")


def one_of(value: object, what: str, known: Sequence[str]) -> None:
    """Raise Error unless a value is among those known."""
    if value not in known:
        raise UserError(f"{what} = {value!r}; expected is one of {', '.join(map(repr, known))}")
