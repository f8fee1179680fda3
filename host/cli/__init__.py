"""The verbs of `host`. A verb's module is imported when it is run, and nothing else."""

from argparse import ArgumentParser
from collections.abc import Sequence
from importlib import import_module
from typing import Any, Final

from controller import importing
from controller.shared.errors import complain, run, unknown_command

# Name: the module whose `main` runs it, and a line of help.
VERBS: Final = {
    "find": ("host.cli.find", "list the orbs that are here, and those that were"),
    "install": ("host.cli.install", "send an orb a new bundle"),
}
PLAY: Final = ("host.cli.play", "play with an orb, or with a virtual one")  # without a verb


def command(words: Sequence[str]) -> int:
    """Run a command line; return the exit status."""
    return run("host", lambda: _run([*words]))


def _run(words: list[str]) -> int:
    name, rest = _found(words)
    with importing():
        module = import_module(name)
    status: int = module.main(rest)
    return status


def _found(words: list[str]) -> tuple[str, list[str]]:
    """Return the module of the verb that is meant, and the words for its `main`."""
    first = words[0] if words else "-"
    if first in VERBS:
        return VERBS[first][0], words[1:]
    if first.startswith("-"):
        return PLAY[0], words
    raise unknown_command("host", first, VERBS, f"a port is named with --link {first}")


def add_option(parser: ArgumentParser, option: str, text: str, **how: Any) -> None:
    """Add an option with its placeholder, such as "--link URL"; one without is a switch."""
    name, _, metavar = option.partition(" ")
    how |= {"metavar": metavar} if metavar else {"action": "store_true"}
    parser.add_argument(name, help=text, **how)


def warn(words: str) -> None:
    """Print a sentence on standard error."""
    complain("host", words, 0)
