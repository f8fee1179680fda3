"""The command line: dispatch to a command, and import nothing but what it needs."""

import sys

from controller import importing


def main(argv: list[str] | None = None) -> int:
    """Run `controller` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    words = sys.argv[1:] if argv is None else argv
    name = words[0] if words and not words[0].startswith("-") else None
    with importing():
        import os
        from importlib import import_module

        from controller.cli.commands import COMMANDS, RUN
        from controller.errors import complain, run, unknown_command

        if name is not None and name not in COMMANDS:
            error = unknown_command("controller", name, COMMANDS)
            return complain("controller", error, error.status)
        # Our matrices are small: NumPy's threads would wait for each other five times as long.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        command = import_module(RUN if name is None else COMMANDS[name][0])
    return run("controller", lambda: command.main(words if name is None else words[1:]))


if __name__ == "__main__":
    sys.exit(main())
