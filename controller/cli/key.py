"""`controller key`: write a new pre-shared key file."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from controller.protocol import psk


def main(argv: Sequence[str]) -> int:
    """Run `controller key` and return its exit status."""
    parser = argparse.ArgumentParser(
        prog="controller key",
        description="Write a random key into a new file that only you can read. Copy it to the "
        "other machine (scp keeps it yours), and name it with --key on both: docs/link.md.",
    )
    parser.add_argument("file", metavar="FILE", type=Path)
    path = parser.parse_args(argv).file
    psk.make(path)
    print(path)
    return 0
