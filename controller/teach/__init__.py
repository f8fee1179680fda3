"""Guided sessions in which users record examples of their own gestures. For `cli`."""

from controller.shared.errors import UserError


class TeachError(UserError, ValueError):
    """It cannot be taught like this; the message says why, in one sentence."""
