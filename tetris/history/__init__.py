"""Replays, best lists, statistics and video. For `window`."""
