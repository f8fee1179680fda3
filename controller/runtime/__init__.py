"""The running device: composition root, paced loop, latency, service notifications.

Imported by `cli` and `teach`.
"""
