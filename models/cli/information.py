"""`models information`: how much an orb can say, by section 6 of the paper and beyond it."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Final

from models.cli import _options as options

if TYPE_CHECKING:
    from models.studies.information.sets import RecordingSet

SUMMARY: Final = "estimate how much an orb can say: entropies, information, capacity"
DESCRIPTION: Final = (
    "Reproduce section 6 of the paper on recordings, correct it, and estimate what it calls "
    "intractable: the information of whole windows about gestures, by neighbours and by what is "
    "recognised on a day that was held out; how it grows with taxels, window, rate and bits; and "
    "what played games carry in bits per minute (docs/information.md). Without recordings, both "
    "presets of the virtual orb are simulated."
)
EXAMPLE: Final = "Try it (a minute): models information --quick --only histogram classifier"
GAMES: Final = "host --demo --headless --speed 0 --json > FILE"


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add("data", type=Path, nargs="*", metavar="DIR", help="recordings, or folders of them")
    add(
        "--labels",
        choices=("auto", "true", "button", "key", "cue"),
        default="auto",
        help="whose labels count; auto: the truth where it is known, else what people said, "
        "moved to where the touches were (default: auto)",
    )
    add(
        "--games",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE",
        help=f"played games, or folders of them, one player each: {GAMES}",
    )
    add(
        "--only",
        nargs="+",
        default=[],
        metavar="PART",
        help="histogram, neighbours, classifier, contrast, growth, places, vocabulary, none",
    )
    add("--check", action="store_true", help="also try the estimators on cases that are known")
    add("--quick", action="store_true", help="a third of the simulated minutes")
    add("--workers", type=options.whole(1, 64), default=os.cpu_count() or 1, help="processes")
    add(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder for the report, its figures (PNG and SVG), and what was measured, which is "
        "not measured again",
    )
    add("--paper", type=Path, metavar="FILE", help="Markdown whose tables of this are made anew")


def run(arguments: argparse.Namespace) -> int:
    """Measure, print, and draw."""
    from models import user_files
    from models.cli import _extras as extras
    from models.reports import markdown

    extras.require("estimating information", "torch", "sklearn", "matplotlib")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from models.studies.information import games, results, study, tables

    if arguments.out and not arguments.out.is_dir():
        raise ValueError(f"{arguments.out} is no directory; make it first")
    if arguments.paper:
        markdown.check(arguments.paper, tables.BEGIN, tables.END)
    kept = arguments.out / results.MEASURED if arguments.out else None
    sets = _sets(arguments)
    players = _players(arguments.games)
    found = study.measure(
        sets, _wanted(arguments.only), arguments.workers, kept, options.say,
        checked=arguments.check,
    )  # fmt: skip
    for name, played in players.items():
        found["games"][name] = games.figures(games.gather(played))
    results.keep(kept, found)
    print(tables.text(found))
    if arguments.out:
        from models.studies.information import figures, report

        for path in figures.draw(found, arguments.out):
            options.say(f"wrote {path}")
        options.say(f"wrote {report.write(arguments.out, found)}")
    if arguments.paper:
        page = user_files.read_text(arguments.paper)
        user_files.write_text(arguments.paper, tables.into(page, found))
    return 0


def _sets(arguments: argparse.Namespace) -> "list[RecordingSet]":
    """Return each folder as a set, and all loose files as one; without any, both presets."""
    from controller.recordings import reader
    from models.data import examples
    from models.studies.information.sets import RecordingSet, simulated

    if not arguments.data:
        return simulated(arguments.quick)
    made = []
    loose = [path for path in arguments.data if not path.is_dir()]
    folders = [path for path in arguments.data if path.is_dir()]
    short = [path.name or str(path) for path in folders]
    if len(set(short)) < len(short):  # two folders of one name
        short = [str(path) for path in folders]
    for name, paths in zip([*short, "recordings"], [*([path] for path in folders), loose],
                           strict=True):  # fmt: skip
        if paths:
            files = tuple(examples.recording_files(paths))
            for file in files:
                reader.survey(file)  # what cannot be read is told before anything is begun
            made.append(RecordingSet(name.replace("|", "_"), files, "", arguments.labels))
    return made


def _wanted(only: list[str]) -> list[str]:
    """Return the parts that somebody asked for.

    Raises:
        ValueError: There is no such part.
    """
    known = ("histogram", "neighbours", "classifier", "contrast", "growth", "places",
             "vocabulary", "none")  # fmt: skip
    for name in only:
        if name not in known:
            raise ValueError(f"there is no part {name!r}; there are {', '.join(known)}")
    return only


def _players(paths: list[Path]) -> dict[str, list[dict[str, object]]]:
    """Return the games of each folder, and of all loose files."""
    from models.studies.information import games

    made: dict[str, list[dict[str, object]]] = {}
    for path in paths:
        files = sorted(path.rglob("[!.]*.json")) if path.is_dir() else [path]
        if not files:
            raise ValueError(f"there are no games in {path}; make one with: {GAMES}")
        name = path.name if path.is_dir() else "games"
        made.setdefault(name, []).extend(games.read(file) for file in files)
    return made


def resumes(arguments: argparse.Namespace) -> bool:
    """Whether the same command goes on where Ctrl-C ended it."""
    return arguments.out is not None
