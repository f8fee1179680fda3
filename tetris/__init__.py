"""A game of Tetris that knows nothing of orbs."""

import os

PURPOSE = "play Tetris without an orb, or watch a bot"

# pygame greets on standard output, which belongs to results.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
