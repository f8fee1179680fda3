"""Numbers on command lines: types for argparse that refuse what is out of range in a sentence."""

from argparse import ArgumentTypeError
from collections.abc import Callable
from math import inf, nan


def whole(least: int, most: int) -> Callable[[str], int]:
    """Return a parser of whole numbers from `least`, 0 or more, to `most`."""

    def read(words: str) -> int:
        short = words.isascii() and words.isdecimal() and len(words) <= len(str(most))
        if not (short and least <= int(words) <= most):
            raise ArgumentTypeError(f"{words[:40]} must be a whole number from {least} to {most}")
        return int(words)

    return read


def number(least: float, most: float = inf) -> Callable[[str], float]:
    """Return a parser of finite numbers from `least` to `most`."""
    limits = f", {least:g} or more" if most == inf else f" from {least:g} to {most:g}"

    def read(words: str) -> float:
        try:
            value = float(words)
        except ValueError:
            value = nan
        if not least <= value <= most or value == inf:
            raise ArgumentTypeError(f"{words[:40]} must be a number{limits}")
        return value

    return read
