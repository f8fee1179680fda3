"""What users get wrong: the one kind of error that the command line tells in a sentence."""


class Mistake(Exception):  # noqa: N818 (the errors are those that derive from it)
    """Something that was asked for cannot be had; the message says why and what to do instead.

    Each room derives its own from this and from the built-in error that it is like.
    """
