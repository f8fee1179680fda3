"""`models folds`: cross-validation over people or sessions."""

import argparse
import shlex
import sys
from pathlib import Path
from typing import Final

from models.cli import _options as options
from models.data.recipe import FOLD_STEPS

SUMMARY: Final = "train and judge in folds: each person by a network that never saw them"
DESCRIPTION: Final = (
    "Cross-validate on recordings of any sensor: in each fold CNN-3D learns from all but some "
    "people (or sessions) and is judged on those. A plain model, trees on the touch's trajectory, "
    "learns and is judged on the same windows. Interrupted, the same command goes on where it was."
)
EXAMPLE: Final = (
    "Try it (two minutes): models simulate --out data --users 4 --sessions 1, then models folds "
    "data --folds 4 --steps 1500 --out folds.json"
)


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.set_defaults(resumes=True)
    add = parser.add_argument
    add("paths", type=Path, nargs="+", metavar="DIR", help="folders of recordings, or files")
    add("--out", type=Path, required=True, metavar="FILE", help="the figures, as JSON")
    by = ("user", "session")
    add("--by", choices=by, default="user", help="held out together (default: user)")
    add("--folds", type=options.count, default=5, metavar="N", help="trainings (default: 5)")
    words = f"batches that each network learns from, at most (default: {FOLD_STEPS:,})"
    add("--steps", type=options.count, default=FOLD_STEPS, metavar="N", help=words)
    options.take(parser, "labels", "all", "window", "seed")
    words = "try no symmetries beside those in gestures.toml"
    add("--declared", action="store_true", help=words)


def run(arguments: argparse.Namespace) -> int:
    """Train, judge, and print the report."""
    options.require("training in folds", "torch", "sklearn")
    from models.studies import cross_validation, fold_statistics
    from models.studies.cross_validation import Request

    chosen = options.chosen(arguments, Request)
    chosen["paths"] = tuple(arguments.paths)
    request = Request(**chosen, command=f"models {shlex.join(sys.argv[1:])}")
    print(fold_statistics.text(cross_validation.cross(request, options.say)))
    options.say(f"wrote {request.out}")
    return 0
