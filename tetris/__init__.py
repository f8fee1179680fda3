"""A game of Tetris that knows nothing of orbs."""

PURPOSE = "play Tetris without an orb, or watch a bot"
