"""The last line of a program, where nobody may be left to read it."""

import os
import sys


def say(program: str, line: str) -> int:
    """Print a result; return the exit status: 0, or 1 if it cannot be printed.

    Args:
        program: Who says why it cannot, on the standard error.
        line: The result.
    """
    try:
        print(line, flush=True)
    except OSError as error:  # a full disk, or `| head` has seen enough
        print(f"{program}: cannot print the result: {error.strerror}", file=sys.stderr)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())  # Python flushes once more at exit
        os.close(nowhere)
        return 1
    return 0
