"""`models information`: information in the signals of an orb, section 6 of the paper and beyond."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Final

from controller.shared.arguments import whole
from models.cli import _options as options

if TYPE_CHECKING:
    from models.studies.information.channel import Session
    from models.studies.information.study import RecordingSet

SUMMARY: Final = "estimate the information in an orb's signals: entropies, bounds, capacity"
DESCRIPTION: Final = (
    "Reproduce section 6 of the paper on recordings, correct it, and estimate what it calls "
    "intractable: the information of whole windows about gestures, by nearest neighbours and by "
    "classifiers on held-out days; and the bits per minute of played games "
    "(docs/information.md). Without recordings, both presets of the virtual orb are simulated."
)
EXAMPLE: Final = "Try it (a minute): models information --quick --only histogram classifier"
PARTS: Final = ("histogram", "neighbours", "classifier", "places", "vocabulary", "none")


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add("data", type=Path, nargs="*", metavar="DIR", help="recordings, or folders of them")
    options.take_labels(
        parser,
        "source of the labels; auto: the truth where it is known, else people's labels, "
        "moved to the touches (default: auto)",
    )
    words = (
        "played games, or folders of them, one player each: "
        "host --demo --headless --speed 0 --json > FILE"
    )
    add("--games", type=Path, nargs="+", default=[], metavar="FILE", help=words)
    add("--only", nargs="+", default=[], metavar="PART", help=", ".join(PARTS))
    add("--quick", action="store_true", help="a third of the simulated minutes")
    add("--workers", type=whole(1, 64), default=os.cpu_count() or 1, help="processes")
    words = "folder for the tables, the drawings, and the results, which are not measured again"
    add("--out", type=Path, metavar="DIR", help=words)


def run(arguments: argparse.Namespace) -> int:
    """Measure, print, and draw."""
    options.require("estimating information", "torch", "sklearn", "matplotlib", "jinja2")
    from models.studies.information import channel, report, study, tables

    out = arguments.out
    arguments.resumes = out is not None
    if out and not out.is_dir():
        raise ValueError(f"{out} is no directory; make it first")
    for name in arguments.only:
        if name not in PARTS:
            raise ValueError(f"there is no part {name!r}; there are {', '.join(PARTS)}")
    kept = out / tables.MEASURED if out else None
    sets, players = _sets(arguments), _players(arguments.games)
    found = study.measure(sets, arguments.only, arguments.workers, kept, options.say)
    for name, played in players.items():
        found["games"][name] = channel.figures(channel.gather(played))
    tables.keep(kept, found)
    print(tables.text(found))
    if out:
        for path in report.write(out, found):
            options.say(f"wrote {path}")
    return 0


def _sets(arguments: argparse.Namespace) -> "list[RecordingSet]":
    """Return each folder as a set, and all single files as one; without any, both presets."""
    from models.data import examples
    from models.studies.information import study

    if not arguments.data:
        return study.simulated(arguments.quick)
    return [
        study.RecordingSet(name.replace("|", "_"), tuple(files), "", arguments.labels)
        for name, files in examples.recording_sets(arguments.data).items()
    ]


def _players(paths: list[Path]) -> "dict[str, list[Session]]":
    """Return the games of each folder, and of all single files."""
    from models.studies.information import channel

    made: dict[str, list[Session]] = {}
    for path in paths:
        files = sorted(path.rglob("[!.]*.json")) if path.is_dir() else [path]
        if not files:
            raise ValueError(f"there are no games in {path}; make one with: {channel.HOW_TO_PLAY}")
        name = path.name if path.is_dir() else "games"
        made.setdefault(name, []).extend(channel.read(file) for file in files)
    return made
