"""The program `models`; its command line is models/cli/_command_line.py."""

import sys

from controller import importing


def main(argv: list[str] | None = None) -> int:
    """Run the program; return its exit status."""
    with importing():
        from models.cli import _command_line as command_line
    return command_line.main(sys.argv[1:] if argv is None else argv)


if __name__ == "__main__":
    sys.exit(main())
