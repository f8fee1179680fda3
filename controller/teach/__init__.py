"""Teach: examples of somebody's own gestures, gathered by cues (`controller teach`)."""

from controller.errors import UserError


class TeachError(UserError, ValueError):
    """It cannot be taught like this; the message says why, in one sentence."""
