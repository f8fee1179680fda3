"""`models rehearse`: give a bundle what it needs to learn more on the device."""

import argparse
from pathlib import Path
from typing import Final

from controller.arguments import whole
from models.cli import _options as options

SUMMARY: Final = "give a bundle something to rehearse, so that it can learn more on the device"
DESCRIPTION: Final = (
    "Take some minutes from labelled recordings into a bundle. `controller teach --add` rehearses "
    "them while it learns a new gesture from a few examples, so that the old ones stay "
    "(docs/teach.md)."
)
EXAMPLE: Final = (
    "Try it (a minute): models simulate --out data --users 8 --sessions 1, then models rehearse "
    "models/orbtouch.orb data --out mine.orb"
)
MOST: Final = 100_000


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    from models.training.rehearsal import FRAMES

    add = parser.add_argument
    add("bundle", type=Path, help="the bundle")
    add("data", type=Path, nargs="+", metavar="DIR", help="labelled recordings, or folders of them")
    add("--out", type=Path, metavar="FILE", required=True, help="bundle to write")
    words = f"frames to keep, about (default: {FRAMES}, some 120 kB)"
    add("--frames", type=whole(100, MOST), default=FRAMES, metavar="N", help=words)


def run(arguments: argparse.Namespace) -> int:
    """Choose and write."""
    from controller import errors
    from controller.bundles import bundle
    from models.data.examples import read_training
    from models.results import storage
    from models.training import rehearsal

    storage.bundle_target(arguments.out)
    options.require("writing a bundle", "tomli_w")
    loaded = bundle.read(arguments.bundle)
    recordings = read_training(arguments.data)  # seeds that are for tests are refused
    options.say_each(recordings.notes)
    chosen = rehearsal.choose(loaded, recordings, arguments.frames)
    made = rehearsal.write(arguments.out, arguments.bundle, chosen)
    options.say(
        f"{arguments.out} is written with {len(chosen.images)} frames of "
        f"{errors.count(len(recordings), 'recording')} to rehearse, SHA-256 {made.hash[:16]}…"
    )
    return 0
