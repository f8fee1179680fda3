"""Errors that a user can put right, and how commands report them: one sentence, an exit status."""

import os
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Final, TextIO

TROUBLE: Final = 1
INTERRUPTED: Final = 130  # what shells expect after Ctrl+C


class UserError(Exception):
    """A request that cannot be met. The message is one sentence: found, expected, what to do.

    One that is caught has a class of its own, derived from this and the built-in error it is like.

    Attributes:
        status: Exit status of the command: 2, a mistake in what the user typed or in a file that
            they named.
    """

    __module__, __qualname__ = "orbtouch", "Error"  # its public name, in traces
    status = 2


class TroubleError(UserError):
    """A request that is right and cannot be met now, such as one for missing hardware."""

    status = 1


def how_to_install(extra: str) -> str:
    """Return the command that installs an optional part of this program, such as "bluetooth"."""
    small = "; PyTorch's CPU build is enough: orbtouch docs training" if "train" in extra else ""
    return f"pip install 'orbtouch[{extra}]' (in a clone: pip install -e '.[{extra}]'){small}"


def reason(error: OSError) -> str:
    """Return the system's reason for an error, such as "no such file or directory"."""
    text = error.strerror or str(error)
    return text[:1].lower() + text[1:]


def output_folder(path: Path) -> Path:
    """Return a folder for results, which is made; UserError if that is not possible."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        problem = f"cannot write into {path}: {reason(error)}; choose another folder"
        raise UserError(problem) from None
    return path


def run(program: str, command: Callable[[], int]) -> int:
    """Run a command of `program`; return its exit status. Expected errors become one sentence.

    A character that the terminal cannot show is printed as an escape. A reader that has gone
    (`| head`) ends the command without a word, with status 1.
    """
    for stream in (sys.stdout, sys.stderr):
        if (adapt := getattr(stream, "reconfigure", None)) is not None:
            adapt(errors="backslashreplace")
    try:
        try:
            status = command()
        finally:  # argparse prints its help and raises SystemExit
            if sys.stdout is not None:
                sys.stdout.flush()
    except UserError as error:
        return complain(program, error, error.status)
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        let_go(sys.stdout)
        return TROUBLE
    except OSError as error:
        if error.filename is not None:
            return complain(program, f"{error.filename}: {reason(error)}", TROUBLE)
        let_go(sys.stdout)
        return complain(program, f"cannot write the output: {reason(error)}", TROUBLE)
    return status


def complain(program: str, problem: Exception | str, status: int) -> int:
    """Print what is wrong on standard error; return the exit status."""
    with suppress(OSError, ValueError):  # standard error may be closed; the status remains
        print(f"{program}: {printable(str(problem))}", file=sys.stderr)
    return status


def say(line: str) -> None:
    """Print a message on standard error, as results go to standard output."""
    print(line, file=sys.stderr, flush=True)


def ask(question: str) -> str:
    """Ask on standard error, as results go to standard output; EOFError if the input has ended."""
    print(question, end="", file=sys.stderr, flush=True)
    return input()


def count(number: int, noun: str, nouns: str = "") -> str:
    """Return a number of things, as in "1 line" and "2 lines"; `nouns` is another plural."""
    return f"{number} {noun if number == 1 else nouns or noun + 's'}"


def unknown_command(program: str, name: str, known: Iterable[str], advice: str = "") -> UserError:
    """Return the error that there is no such command, with the nearest one, or advice."""
    from difflib import get_close_matches  # in here: it compiles regular expressions

    names = list(known)
    near = get_close_matches(name, names, n=1)
    advice = f"did you mean `{program} {near[0]}`?" if near else advice
    return UserError(f"there is no command {name!r}; {advice or 'there are ' + ', '.join(names)}")


def printable(text: str) -> str:
    """Return a text with escapes for what a terminal would act on; line breaks stay."""
    if text.isprintable():
        return text
    return "".join(
        sign if sign.isprintable() or sign == "\n" else repr(sign)[1:-1] for sign in text
    )


def one_line(text: str) -> str:
    """Return a text as `printable` does, with line breaks as escapes too."""
    return printable(text).replace("\n", "\\n")


def let_go(stream: TextIO) -> None:
    """Point a stream that cannot be written at nothing: Python flushes it once more at exit."""
    with suppress(OSError, ValueError):  # under a test it may be no stream of the system
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
