"""`models simulate`: write a data set of simulated sessions."""

import argparse
import os
from pathlib import Path
from typing import Final

from controller.shared import errors
from controller.shared.arguments import number
from models.cli import _options as options

DESCRIPTION: Final = (
    "Simulate users at play, with the truth beside every frame: a recording per user and session "
    "(orbtouch docs data). Interrupted, it goes on where it was."
)
EXAMPLE: Final = (
    "Try it (ten seconds): models simulate --out data --users 2 --sessions 2 --minutes 2"
)


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.set_defaults(resumes=True)
    add = parser.add_argument
    add("--out", type=Path, required=True, metavar="DIR", help="folder to write into")
    add("--users", type=options.count, default=10, metavar="N", help="how many play (default: 10)")
    add("--sessions", type=options.count, default=3, metavar="N", help="of each user (default: 3)")
    words = "of each session (default: 6 in free play, 29 in blocks, as in the paper)"
    add("--minutes", type=options.minutes, metavar="M", help=words)
    words = "gestures in any order, or class by class as in the paper (default: free)"
    add("--protocol", choices=("free", "blocks"), default="free", help=words)
    words = "quality of the orbs: nominal, paper-snr (default: nominal)"
    add("--preset", default="nominal", metavar="NAME", help=words)
    words = "a hand on the dome, or a mouse on the panel's picture of it (default: person)"
    add("--hand", choices=("person", "pointer"), default="person", help=words)
    words = "all users touch one orb, on days of their own (default: each session has another)"
    add("--one-orb", action="store_true", help=words)
    words = (
        "labels to play and files of your own (orbtouch docs gestures), separated by commas: "
        "press,swipe,wave.toml (default: press,pinch,twist_cw,twist_ccw)"
    )
    add("--gestures", metavar="LIST", default="press,pinch,twist_cw,twist_ccw", help=words)
    options.take(parser, "seed")
    words = "processes (default: one per core)"
    add("--workers", type=options.count, default=os.cpu_count() or 1, metavar="W", help=words)
    add(
        "--rate",
        dest="rate_hz",
        type=number(1.0, 200.0),
        default=40.0,
        metavar="HZ",
        help="frames per second, 1 to 200 (default: 40)",
    )
    words = "share of turns in which several quick gestures follow each other (default: 0)"
    add("--quick", type=number(0.0, 1.0), default=0.0, metavar="SHARE", help=words)
    words = "share of the other turns with slides, winding up, resting hands (default: 0)"
    add("--unruly", type=number(0.0, 1.0), default=0.0, metavar="SHARE", help=words)
    words = "domes of other thickness, friction and pressure in each session"
    add("--varied", action="store_true", help=words)
    words = "taxels, up to 32x32, and their distance in mm (default: 5x5; the grid is 40 mm long)"
    add("--grid", type=_grid, default={}, metavar="ROWSxCOLUMNS[xPITCH]", help=words)


def run(arguments: argparse.Namespace) -> int:
    """Write the data set."""
    from controller.simulator.hand.gesture_file import label_in
    from models.data.simulate import DataSet, generate

    listed = arguments.gestures.split(",")
    files = tuple(Path(entry) for entry in listed if entry.endswith(".toml"))
    own = {
        **arguments.grid,
        "minutes": arguments.minutes or (6.0 if arguments.protocol == "free" else 29.0),
        "gestures": tuple(
            label_in(Path(entry)) if entry.endswith(".toml") else entry for entry in listed
        ),
        "files": files,
    }
    data = DataSet(**options.chosen(arguments, DataSet) | own)
    out, users, sessions = arguments.out, arguments.users, arguments.sessions
    generate(data, out, users, sessions, arguments.workers, errors.say)
    print(arguments.out)
    return 0


def _grid(words: str) -> dict[str, float]:
    """Return rows, columns and pitch_mm, if it is given, of a grid such as "16x20x2.5"."""
    parts, kinds = words.split("x"), (options.taxels, options.taxels, number(0.5, 34.0))
    if len(parts) not in (2, 3):
        raise argparse.ArgumentTypeError(f"{words[:40]} must be rows x columns, such as 16x20")
    read = zip(("rows", "columns", "pitch_mm"), kinds, parts, strict=False)
    return {name: kind(part) for name, kind, part in read}
