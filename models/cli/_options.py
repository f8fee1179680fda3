"""Kinds of values that the commands' options take; what does not fit is one sentence."""

import argparse
import sys
from collections.abc import Callable


def say(line: str) -> None:
    """Print a message: to standard error, because results go to standard output."""
    print(line, file=sys.stderr, flush=True)


def take_all(parser: argparse.ArgumentParser) -> None:
    """Add the option that takes every recording."""
    parser.add_argument(
        "--all",
        action="store_true",
        help="learn from recordings that fail the check, too (controller recordings check)",
    )


def count(text: str) -> int:
    """Return how many: 1 to 100,000."""
    return whole(1, 100_000)(text)


def seed(text: str) -> int:
    """Return a seed: 32 bits."""
    return whole(0, 2**32 - 1)(text)


def taxels(text: str) -> int:
    """Return the length of a side of the grid."""
    return whole(2, 32)(text)


def minutes(text: str) -> float:
    """Return the length of a session."""
    return number(0.5, 600.0)(text)


def whole(least: int, most: int) -> Callable[[str], int]:
    """Return what reads whole numbers of a range."""

    def read(text: str) -> int:
        value = int(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{text} is not between {least} and {most}")
        return value

    read.__name__ = "whole number"  # argparse names it where the text is no number
    return read


def number(least: float, most: float) -> Callable[[str], float]:
    """Return what reads numbers of a range."""

    def read(text: str) -> float:
        value = float(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{text} is not between {least:g} and {most:g}")
        return value

    read.__name__ = "number"
    return read
