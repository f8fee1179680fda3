"""The program `models`; its command line is models/command_line.py."""

import sys


def main(argv: list[str] | None = None) -> int:
    """Run the program; return its exit status."""
    try:  # Ctrl-C ends it in one way from its first moment on, so even imports are in here
        from models import command_line
    except KeyboardInterrupt:
        return 130
    return command_line.main(sys.argv[1:] if argv is None else argv)


if __name__ == "__main__":
    sys.exit(main())
