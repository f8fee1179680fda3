"""Command lines of the device: argparse, call, print.

Nothing imports it but `controller.__main__`.
"""
