"""Errors that a user can put right; the command line prints their message and no traceback."""


class UserError(Exception):
    """A request that cannot be met. The message is one sentence: found, expected, what to do.

    Each package derives its own errors from this and from the built-in error that they are like.

    Attributes:
        status: Exit status of the command: 2, a mistake in what the user typed or in a file that
            they named.
    """

    status = 2


class TroubleError(UserError):
    """A request that is right and cannot be met now, such as one for missing hardware."""

    status = 1


def how_to_install(extra: str) -> str:
    """Return the command that installs an optional part of this program, such as "bluetooth"."""
    return f"pip install 'orbtouch[{extra}]' (in a clone: pip install -e '.[{extra}]')"


def reason(error: OSError) -> str:
    """Return the system's reason for an error, such as "no such file or directory"."""
    text = error.strerror or str(error)
    return text[:1].lower() + text[1:]
