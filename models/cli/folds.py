"""`models folds`: cross-validation over people, by a sweep whose plan ships."""

import argparse
import os
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Final

from controller.shared.arguments import whole
from models.cli import _options as options
from models.cli import sweep

SUMMARY: Final = "train and judge in folds: each person by a network that never saw them"
DESCRIPTION: Final = (
    "Cross-validate on recordings of any sensor: in each fold CNN-3D, or CNN-2D, learns from all "
    "but some people and is judged on those; of gestures trees on features are, too. It is a sweep "
    "with the plan models/studies/sweep/folds.toml; to change more than the number of folds, copy "
    "that file and use models sweep. Interrupted, the same command goes on where it was."
)
EXAMPLE: Final = (
    "Try it (some minutes): models simulate --out data --users 4 --sessions 1, then models folds "
    "data --folds 4 --out folds"
)


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.set_defaults(resumes=True)
    add = parser.add_argument
    add("paths", type=Path, nargs="+", metavar="DIR", help="folders of recordings")
    add("--out", type=Path, required=True, metavar="DIR", help="folder for results")
    words = "judge gestures, or places of touches (default: gesture)"
    add("--task", choices=("gesture", "location"), default="gesture", help=words)
    words = "trainings of each model; no more than there are people (default: 5)"
    add("--folds", type=whole(2, 1000), default=5, metavar="N", help=words)


def run(arguments: argparse.Namespace) -> int:
    """Train what is missing, judge, and print the table."""
    options.require("training in folds", "torch", "sklearn", "joblib", extra="train,sweep")
    from controller.shared.config import parse_toml
    from models.data import examples
    from models.studies.sweep import plan
    from models.studies.sweep.run import Sweep

    table = parse_toml(files("models.studies.sweep").joinpath("folds.toml").read_text("utf-8"))
    places = [path.absolute() for path in arguments.paths]
    table["data"]["folders"] = list(map(str, places))
    table["train"]["task"] = arguments.task
    if arguments.task == "location":
        table["axes"] = {}
    surveys = examples.read_training(places).surveys
    if surveys[0].origin.signal.ratio:
        table["train"]["recipe"] = "default"  # as `models train` does
    made = plan.parse(table, "folds")
    people = len({(one.origin.seed, one.origin.user or one.path) for one in surveys})
    if people < 2:
        place = arguments.paths[0]
        raise ValueError(f"{place} holds recordings of one person; give those of two or more")
    made = replace(made, test=replace(made.test, folds=min(people, arguments.folds)))
    planned = Sweep(made, arguments.out, workers=os.cpu_count() or 1)
    return sweep.finish(sweep.of_recordings(planned, places))
