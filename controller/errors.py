"""Errors that a user can put right; the command line prints their message and no traceback."""


class UserError(Exception):
    """A request that cannot be met. The message is one sentence: found, expected, what to do.

    Each package derives its own errors from this and from the built-in error that they are like.
    """


def reason(error: OSError) -> str:
    """Return the system's reason for an error, such as "no such file or directory"."""
    return (error.strerror or str(error)).lower()
