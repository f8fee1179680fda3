"""Command lines of the device: argparse, call, print.

Only `controller.__main__` imports it.
"""
