"""`models sweep`: many trainings from one file, on this machine's cores or on a cluster."""

import argparse
import os
import signal
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from models.cli import _options as options
from models.studies.sweep import example

if TYPE_CHECKING:
    from models.studies.sweep.plan import Plan
    from models.studies.sweep.study import Sweep

SUMMARY: Final = "run many trainings: learning curves, cross-validation, grids"
DESCRIPTION: Final = (
    "Train every combination of the axes in a TOML file (docs/sweeps.md), judge each on people or "
    "sessions that it never saw, and write results and a report. Runs on this machine's cores, or "
    "on a Dask cluster; the results are the same. Interrupted, the same command goes on where it "
    "was."
)
EXAMPLE: Final = "Try it (a minute): models sweep --example > try.toml, then models sweep try.toml"


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add("file", type=Path, nargs="?", metavar="FILE.toml", help="what to train (docs/sweeps.md)")
    add(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder for results (default: beside the file, NAME.sweep)",
    )
    add(
        "--cluster",
        default="",
        metavar="ADDRESS",
        help="of a Dask scheduler, HOST:PORT (default: this machine's cores)",
    )
    add(
        "--workers",
        type=options.whole(1, 1024),
        default=0,
        metavar="N",
        help="processes on this machine (default: one for each core)",
    )
    add("--list", action="store_true", help="say which trainings these are, and train none")
    add(
        "--example",
        metavar="NAME",
        nargs="?",
        const=example.FIRST,
        choices=example.NAMES,
        help="print a file to begin with: "
        + "; ".join(f"{name} ({what})" for name, what in example.NAMES.items())
        + f" (default: {example.FIRST})",
    )


def run(arguments: argparse.Namespace) -> int:
    """Train what is missing, and report."""
    from models.cli import _extras as extras

    if arguments.example:
        print(example.text(arguments.example), end="")
        return 0
    if arguments.file is None:
        raise ValueError("name a file; models sweep --example prints one")
    if arguments.cluster and arguments.workers:
        raise ValueError(
            "--workers are this machine's; a cluster's are counted by whoever starts them"
        )
    extras.require("sweeping", "torch", "joblib", extra="train,sweep")
    if arguments.cluster:
        extras.require("a cluster", "distributed", extra="sweep")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from models.studies.sweep import plan, recipes

    made = plan.read(arguments.file, recipes.allow)
    sweep = _sweep(made, arguments)
    if arguments.list:
        return _list(sweep)
    return _sweep_through(sweep, arguments)


def _sweep_through(sweep: "Sweep", arguments: argparse.Namespace) -> int:
    from models import user_files
    from models.studies.sweep import cluster, kept, local, report, study, told

    workers = arguments.workers or os.cpu_count() or 1

    def engine(orders: Sequence[str]) -> Iterator[str]:
        if arguments.cluster:
            return cluster.run(orders, arguments.cluster, sweep.places, options.say)
        return local.run(orders, workers, options.say)

    try:
        found = study.run(sweep, engine, options.say)
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # it ends by itself, in a second or two
        raise
    except cluster.GoneError as error:
        options.say(f"models: {error}; start it again, and the same command goes on from here")
        return 1
    print(told.table(found))
    page = sweep.folder / kept.REPORT
    spent = study.times(sweep.named(), kept.answers(sweep.folder))
    user_files.write_text(page, report.html(found, spent))
    options.say(f"wrote {sweep.folder / kept.RESULTS}, and {page} to look at")
    return int(any("failed" in job for job in found["jobs"]))


def _sweep(plan: "Plan", arguments: argparse.Namespace) -> "Sweep":
    """Return what was asked for, its recordings looked through."""
    from models.data import examples, load
    from models.studies.sweep.study import Sweep

    file: Path = arguments.file
    out = arguments.out or file.with_suffix(".sweep")
    if plan.simulated:
        return Sweep(plan, out)
    places = [(file.parent / folder).resolve() for folder in plan.data["folders"]]
    for place, said in zip(places, plan.data["folders"], strict=True):
        if not place.exists():
            raise ValueError(f"{file}: there is no folder {said} (looked for {place})")
    recordings = examples.read_training(places)
    known = load.fingerprint(
        examples.digest(survey.path for survey in recordings.surveys),
        load.vocabulary_of(places, recordings.labels),
    )
    return Sweep(plan, out, known, tuple(map(str, places)))


def _list(sweep: "Sweep") -> int:
    from models.studies.sweep import jobs, kept

    there = kept.answers(sweep.folder)
    for name, job in sweep.named().items():
        print(f"{name} {'done' if name in there else '    '} {jobs.words(job)}")
    return 0


def resumes(arguments: argparse.Namespace) -> bool:
    """Whether the same command goes on where Ctrl-C ended it."""
    return True
