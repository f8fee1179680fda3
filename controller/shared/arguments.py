"""Command lines: numbers that are refused in a sentence, and options that are suggested."""

from argparse import ArgumentParser, ArgumentTypeError
from collections.abc import Callable
from math import inf, nan
from re import match
from typing import NoReturn


class Parser(ArgumentParser):
    """Parser that names the nearest option, command or choice where one is unknown."""

    def error(self, message: str) -> NoReturn:
        """Print the usage and the message, and exit with status 2."""
        from difflib import get_close_matches  # in here: it compiles regular expressions

        head, _, words = message.partition("unrecognized arguments: ")
        odd = next((word for word in words.split() if word.startswith("--")), "")
        known = self._options() if odd and not head else []
        if choice := match(r".*invalid choice: '(.*)' \(choose from (.*)\)$", message):
            odd, known = choice[1], [name.strip("'") for name in choice[2].split(", ")]
        if near := get_close_matches(odd.partition("=")[0], known, n=1):
            message += f"; did you mean {near[0]}?"
        super().error(message)

    def _options(self) -> list[str]:
        """Return the long options of this parser and of its commands."""
        names = [name for name in self._option_string_actions if name.startswith("--")]
        for action in self._actions:
            commands = action.choices if isinstance(action.choices, dict) else {}
            names += [name for one in commands.values() for name in one._options()]
        return names


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
