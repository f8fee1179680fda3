"""`models figures`: figure 7 of the paper, for both recipes and presets."""

import argparse
from pathlib import Path
from typing import Final

from models.cli import _options as options

SUMMARY: Final = "measure and draw figure 7 of the paper again"
DESCRIPTION: Final = (
    "Teach by a simulated user as in section 4.2 of the paper, train both networks and the user "
    "network by both recipes on both presets, judge them by the paper's protocol and on unseen "
    "days and people, and draw figure 7 (docs/paper.md). Results are kept beside the picture and "
    "not measured again; half an hour on one core."
)
EXAMPLE: Final = (
    "The paper's own amounts (some hours): models figures --out big --minutes 29 --epochs 500 "
    "--place-epochs 2000"
)


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.set_defaults(resumes=True)
    add = parser.add_argument
    words = "folder to write into (default: docs/pictures)"
    add("--out", type=Path, default=Path("docs/pictures"), metavar="DIR", help=words)
    add("--minutes", type=options.minutes, default=12.0, help="of teaching (default: 12)")
    words = "of CNN-3D by the paper's recipe (default: 40)"
    add("--epochs", type=options.count, default=40, metavar="N", help=words)
    words = "of CNN-2D by the paper's recipe (default: 400)"
    add("--place-epochs", type=options.count, default=400, metavar="N", help=words)
    add("--seed", type=options.seed, default=7, help="of everything random (default: 7)")


def run(arguments: argparse.Namespace) -> int:
    """Measure and draw."""
    options.require("drawing figures", "torch", "matplotlib")
    from models.studies.figure7 import report, study
    from models.studies.figure7.experiments import Settings
    from models.training.loop import prepare_torch

    if not arguments.out.is_dir():
        raise ValueError(f"{arguments.out} is no directory; make it first")
    prepare_torch(arguments.seed)
    settings = Settings(arguments.minutes, arguments.epochs, arguments.place_epochs, arguments.seed)
    found = study.measure(settings, arguments.out / report.MEASURED, options.say)
    for path in report.draw(found, arguments.out):
        options.say(f"wrote {path}")
    print(report.text(found))
    return 0
