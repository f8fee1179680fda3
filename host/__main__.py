"""The command line of the laptop."""

import sys


def main(argv: list[str] | None = None) -> int:
    """Run `host`; return its exit status: 0 success, 1 trouble, 2 wrong usage, 130 interrupted."""
    try:
        from host.cli import command  # in here, as all that takes long enough for a Ctrl+C

        return command(sys.argv[1:] if argv is None else argv)
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
