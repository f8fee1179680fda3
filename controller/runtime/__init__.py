"""The running device: assembly of its parts, the paced loop, latency, shutdown.

For `cli` and `teach`.
"""
