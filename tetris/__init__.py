"""A game of Tetris that knows nothing of orbs."""
