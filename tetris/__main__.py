"""Entry point. What it imports, it imports where Ctrl+C is expected."""

import sys


def main(argv: list[str] | None = None) -> int:
    """Play; return the exit status: 0 success, 1 trouble, 2 wrong usage, 130 Ctrl+C."""
    try:
        from tetris import cli

        return cli.run(argv)
    except KeyboardInterrupt:
        # If it came while a data class was made, Python would end by the signal instead of with
        # our status. Executing another text makes it forget that.
        exec("")
        return 130  # what shells expect


if __name__ == "__main__":
    sys.exit(main())
