"""Teach: examples of somebody's own gestures, gathered by cues (`controller teach`)."""


class TeachError(ValueError):
    """It cannot be taught like this; the message says why, in one sentence."""
