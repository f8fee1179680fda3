"""Replays, best lists and statistics. For `window`."""
