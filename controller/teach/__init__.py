"""Guided sessions in which users record examples of their own gestures. For `cli`."""
