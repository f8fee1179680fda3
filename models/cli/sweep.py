"""`models sweep`: many trainings from one plan file, on this machine's cores or on a cluster."""

import argparse
import os
import signal
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final

from controller.shared import errors
from controller.shared.arguments import whole
from models.cli import _options as options

if TYPE_CHECKING:
    from models.studies.sweep.run import Sweep

DESCRIPTION: Final = (
    "Train every combination of the axes in a TOML file (orbtouch docs sweeps), judge each on "
    "people or sessions that it never saw, and write results and a table. Runs on this machine's "
    "cores, or on a Dask cluster; the results are the same. Interrupted, the same command goes on "
    "where it was."
)
EXAMPLE: Final = (
    "Try it (a minute): models simulate --out people --users 6 --minutes 1 --rate 10; models sweep "
    "> try.toml; models sweep try.toml"
)
EXAMPLE_FILE: Final = files("models.studies.sweep").joinpath("example.toml")


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.set_defaults(resumes=True)
    add = parser.add_argument
    workers = whole(1, 1024)
    cores = "this machine's cores"
    words = "what to train (orbtouch docs sweeps); default: print a file to begin with"
    add("file", type=Path, nargs="?", metavar="FILE.toml", help=words)
    add("--out", type=Path, metavar="DIR", help="folder for results (default: NAME.sweep)")
    add("--cluster", default="", metavar="HOST:PORT", help=f"Dask scheduler (default: {cores})")
    add("--workers", type=workers, default=0, metavar="N", help=f"processes (default: {cores})")


def run(arguments: argparse.Namespace) -> int:
    """Train what is missing, and report."""
    if arguments.file is None:
        print(EXAMPLE_FILE.read_text(encoding="utf-8"), end="")
        return 0
    if arguments.cluster and arguments.workers:
        raise ValueError("--workers are this machine's, not a cluster's (orbtouch docs sweeps)")
    options.require("sweeping", "torch", "sklearn")
    if arguments.cluster:
        options.require("a cluster", "distributed", extra="sweep")
    return finish(_sweep(arguments))


def _sweep(arguments: argparse.Namespace) -> "Sweep":
    """Return the sweep of a plan file."""
    from models.studies.sweep import plan
    from models.studies.sweep.run import Sweep

    file: Path = arguments.file
    made = plan.read(file)
    places = [(file.parent / folder).resolve() for folder in made.data.folders]
    for place, folder in zip(places, made.data.folders, strict=True):
        if not place.exists():
            raise ValueError(f"{file}: there is no folder {folder} (looked for {place})")
    workers = arguments.workers or os.cpu_count() or 1
    out = arguments.out or file.with_suffix(".sweep")
    return of_recordings(Sweep(made, out, workers=workers, cluster=arguments.cluster), places)


def of_recordings(sweep: "Sweep", places: Sequence[Path]) -> "Sweep":
    """Return a sweep over the recordings at these absolute paths, with a hash of them."""
    from models.data import examples, load

    recordings = examples.read_training(places)
    known = load.fingerprint(
        examples.digest(survey.path for survey in recordings.surveys),
        load.vocabulary_of(
            places, recordings.labels, orb=load.of_orb(recordings.surveys[0].origin)
        ),
    )
    return replace(sweep, digest=known, places=tuple(map(str, places)))


def finish(sweep: "Sweep") -> int:
    """Train what is missing, print the table, and return the exit status."""
    from models.studies.sweep import report, run

    try:
        found = run.run(sweep, errors.say)
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # it ends by itself, in a second or two
        raise
    print(report.table(found))
    errors.say(f"wrote {sweep.folder / run.RESULTS}")
    return int(any("failed" in job for job in found["jobs"]))
