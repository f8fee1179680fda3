"""Measurements that somebody can repeat; each runs by itself, with `python -m`."""
