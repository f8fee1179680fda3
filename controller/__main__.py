"""The command line: dispatch to a command, and import nothing but what it needs."""

import sys

from controller import importing


def main(argv: list[str] | None = None) -> int:
    """Run `controller` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    words = sys.argv[1:] if argv is None else argv
    name = words[0] if words and words[0] and not words[0].startswith("-") else ""
    with importing():
        import os

        from controller.cli import COMMANDS, load
        from controller.shared.errors import complain, run, unknown_command

        if name not in COMMANDS:
            error = unknown_command("controller", name, filter(None, COMMANDS))
            return complain("controller", error, error.status)
        # Our matrices are small: NumPy's threads would wait for each other five times as long.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        command = load(name)
    return run("controller", lambda: command(words[1:] if name else words))


if __name__ == "__main__":
    sys.exit(main())
