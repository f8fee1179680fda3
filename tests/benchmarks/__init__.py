"""Measurements; each runs by itself, with `python -m tests.benchmarks.NAME`."""
