"""Bots, search and the learning environment. For `history` and `window`."""
