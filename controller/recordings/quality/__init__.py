"""Checks of recordings: taxels, timing, labels, duplicates."""
