"""Standard output and error: printable text, and results that cannot be printed."""

import errno
import os
import sys
from contextlib import suppress
from typing import TextIO


def adapt() -> None:
    """Print characters that the terminal does not know as escapes, from now on."""
    for stream in (sys.stdout, sys.stderr):
        if (change := getattr(stream, "reconfigure", None)) is not None:
            change(errors="backslashreplace")


def say(program: str, line: str) -> int:
    """Print a result; return the exit status: 0, or 1 if it cannot be printed.

    Args:
        program: The name that begins the message why it cannot, on standard error.
        line: The result.
    """
    try:
        if sys.stdout is None:  # the program was started without one
            raise OSError(errno.EBADF, "standard output is closed")
        print(line, flush=True)
    except OSError as error:  # a full disk, or `| head` has seen enough
        if sys.stdout is not None:
            _let_go(sys.stdout)
        return complain(program, f"cannot print the result: {error.strerror}", 1)
    return 0


def complain(program: str, problem: Exception | str, status: int) -> int:
    """Print what is wrong on standard error; return the exit status."""
    with suppress(OSError, ValueError):  # standard error may be closed; the status remains
        print(f"{program}: {printable(str(problem))}", file=sys.stderr)
    return status


def printable(text: str) -> str:
    """Return a text in which whatever a terminal would act on is an escape."""
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in text)


def _let_go(stream: TextIO) -> None:
    """Point a stream that cannot be written at nothing: Python flushes it once more at exit."""
    with suppress(OSError, ValueError):  # under a test it may be no stream of the system
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
