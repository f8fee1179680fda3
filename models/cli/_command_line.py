"""The command line of the training machine: `models COMMAND`, a file of `models/cli/` each."""

import argparse
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from controller import __version__
from controller.shared import errors
from controller.shared.arguments import Parser
from controller.shared.errors import UserError, unknown_command
from models.cli import COMMANDS, load

DESCRIPTION = "Make data, train the orb's networks on recordings, and judge bundles."
EXAMPLE = "Try it (ten seconds): models evaluate --sessions 2 --minutes 2"


def main(words: Sequence[str]) -> int:
    """Run one of the commands; return the exit status."""
    return errors.run("models", lambda: _run(words))


def _run(words: Sequence[str]) -> int:
    arguments = None
    with _noting() as interrupts:
        try:
            arguments = _parser(words[:1]).parse_args(words)
            return int(arguments.run(arguments))
        except BaseException as error:
            if not (interrupts or isinstance(error, KeyboardInterrupt)):
                if isinstance(error, ValueError):
                    raise UserError(str(error)) from None
                raise
    # After an interrupt inside a text that was executed, as when a data class is made, Python ends
    # by the signal instead of with our status. Executing another makes it forget that.
    exec("")
    if arguments is None:
        return errors.INTERRUPTED
    if sys.stderr.isatty():  # behind what shows how far it has come
        print(file=sys.stderr)
    kept = (
        "the same command goes on from here" if arguments.resumes else "every file written is whole"
    )
    return errors.complain("models", f"interrupted; {kept}", errors.INTERRUPTED)


@contextmanager
def _noting() -> Iterator[list[int]]:
    """Note interrupts: a library that is imported makes another error of some of them."""
    seen: list[int] = []

    def note(number: int, frame: object) -> None:
        seen.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        yield seen
    finally:
        if signal.getsignal(signal.SIGINT) is note:  # else a command has made other arrangements
            signal.signal(signal.SIGINT, before)


def _parser(first: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser of the command that is named first, if any, else of all."""
    names = list(COMMANDS)
    if first and not first[0].startswith("-"):
        if first[0] not in COMMANDS:
            raise unknown_command("models", first[0], COMMANDS)
        names = [first[0]]
    parser = Parser(prog="models", description=DESCRIPTION, epilog=EXAMPLE)
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    listed = parser.add_subparsers(required=True, metavar="COMMAND")
    for name in names:
        command = load(name)
        options = listed.add_parser(
            name, help=COMMANDS[name], description=command.DESCRIPTION, epilog=command.EXAMPLE
        )
        options.set_defaults(run=command.run, resumes=False)
        command.add(options)
    return parser
