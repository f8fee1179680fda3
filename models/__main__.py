"""The command line of the training machine: `models COMMAND`, a file of `models/commands/` each."""

import argparse
import sys
from collections.abc import Sequence

from models import commands

DESCRIPTION = "Make data, train the orb's networks on recordings, and judge bundles."
EXAMPLE = "Try it (ten seconds): models evaluate --sessions 2 --minutes 2"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of the commands; return the exit status."""
    arguments = _parser().parse_args(argv)
    try:
        return int(arguments.run(arguments))
    except KeyboardInterrupt:
        print("models: interrupted; nothing was written", file=sys.stderr)
        return 1
    except (ValueError, OSError) as error:
        print(f"models: {error}", file=sys.stderr)
        return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="models", description=DESCRIPTION, epilog=EXAMPLE)
    listed = parser.add_subparsers(required=True, metavar="COMMAND")
    for name in commands.names():
        command = commands.load(name)
        options = listed.add_parser(
            name, help=command.SUMMARY, description=command.DESCRIPTION, epilog=command.EXAMPLE
        )
        command.add(options)
        options.set_defaults(run=command.run)
    return parser


if __name__ == "__main__":
    sys.exit(main())
