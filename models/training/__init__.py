"""Training of the networks: tasks, loop, export.

PyTorch is imported here and in `studies` only.
"""
