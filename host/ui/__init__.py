"""The window: dome, panel, cards, pointer input."""
