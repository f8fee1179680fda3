"""`models folds`: cross-validation over people, by a sweep whose plan ships."""

import argparse
import os
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final

from controller.shared.arguments import whole
from models.cli import _options as options
from models.cli import sweep

if TYPE_CHECKING:
    from models.studies.sweep.run import Sweep

DESCRIPTION: Final = (
    "Cross-validate on recordings of any sensor: in each fold CNN-3D, or CNN-2D, learns from all "
    "but some people and is judged on those, and so are trees on features. It is a sweep with "
    "the plan models/studies/sweep/folds.toml; to change more than the number of folds, copy that "
    "file and use models sweep. Interrupted, the same command goes on where it was."
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
    words = "compare with plain models, too (orbtouch docs people); each DIR has its own table"
    add("--peers", action="store_true", help=words)


def run(arguments: argparse.Namespace) -> int:
    """Train what is missing, judge, and print the table."""
    options.require("training in folds", "torch", "sklearn")
    if not arguments.peers:
        return sweep.finish(_planned(arguments, arguments.paths, arguments.out, "folds"))
    if arguments.task == "location":
        raise ValueError("--peers are of gestures; places are judged beside trees without it")
    sets = {path.resolve().name: path for path in arguments.paths}
    if len(sets) < len(arguments.paths):
        raise ValueError("two folders have one name, which their results would share; rename one")
    made = [_planned(arguments, [path], arguments.out / name, name) for name, path in sets.items()]
    return max([sweep.finish(one) for one in made])


def _planned(arguments: argparse.Namespace, paths: Sequence[Path], out: Path, name: str) -> "Sweep":
    """Return the sweep over some of the folders, with as many folds as they have people at most."""
    from controller.shared.config import parse_toml
    from models.data import examples
    from models.studies.sweep import plan
    from models.studies.sweep.run import Sweep

    table = parse_toml(files("models.studies.sweep").joinpath("folds.toml").read_text("utf-8"))
    places = [path.absolute() for path in paths]
    table["data"]["folders"] = list(map(str, places))
    table["train"]["task"] = arguments.task
    if arguments.peers:
        table["axes"]["model"] = list(plan.MODELS)
    surveys = examples.read_training(places).surveys
    if surveys[0].origin.signal.ratio:
        table["train"]["recipe"] = "default"  # as `models train` does
    made = plan.parse(table, name)
    people = len({(one.origin.seed, one.origin.user or one.path) for one in surveys})
    if people < 2:
        raise ValueError(f"{paths[0]} holds recordings of one person; give those of two or more")
    made = replace(made, test=replace(made.test, folds=min(people, arguments.folds)))
    return sweep.of_recordings(Sweep(made, out, workers=os.cpu_count() or 1), places)
