"""Information of an orb: section 6, bounds, play.

    python -m tests.benchmarks.information [--keep FOLDER] [--quick] [--json]

Both presets: section 6 of the paper on two class-block sessions of one user, 34,795 frames, button
labels, z = C / C0 with C0 the mean of the first ten seconds, for five users; everything else that
`models information` measures, on four days of one user; and games of the demo and of the same
player at a keyboard (tests/benchmarks/information_games.py). Some CPU-minutes; with --keep what was
measured is not measured again (docs/pictures keeps what docs/paper.md shows). --quick: a few
minutes, on less.
"""

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from models.studies.information import channel, study, tables
from models.studies.information.histogram import BITS, PAPER_H_Z, PAPER_INFORMATION, PAPER_STATIC
from models.studies.information.tables import MEASURED, keep

from . import information_games
from .results import Results, command_line, say

GAMES = 5
MINUTES = 6.0
GOALS = {"p_static": PAPER_STATIC, "h_z": PAPER_H_Z, "information": PAPER_INFORMATION}


def main() -> None:
    parser = command_line(__doc__, quick=False)
    parser.add_argument("--keep", type=Path, metavar="FOLDER")
    arguments = parser.parse_args()
    kept = arguments.keep / MEASURED if arguments.keep else None
    found = study.measure(study.simulated(arguments.quick), (), 2, kept, say)
    if not found["games"]:
        found["games"] = played(1 if arguments.quick else GAMES)
        keep(kept, found)
    print(tables.text(found))
    results(found).finish(arguments.json)


def played(count: int) -> dict[str, Any]:
    """Play the demo on both presets, and at a keyboard; return what each carries."""
    with tempfile.TemporaryDirectory() as folder:
        information_games.play_all(Path(folder), count, MINUTES)
        return {
            who: channel.figures(
                channel.gather(
                    channel.read(path) for path in sorted((Path(folder) / who).iterdir())
                )
            )
            for who in information_games.PLAYERS
        }


def results(found: Mapping[str, Any]) -> Results:
    """Print and return the figures that have a name."""
    listed = Results("information")
    for preset, figures in tables.part(found, "histogram").items():
        for name, figure in figures.items():
            unit = "1" if name == "p_static" else "nats"
            listed.note(name, figure, unit, preset=preset, goal=GOALS.get(name))
    for preset, part in tables.part(found, "classifier").items():
        best = max(row["gesture"][0] for row in part["rows"].values())
        listed.note("bits_per_gesture_another_day", best * BITS, "bits", preset=preset)
    for who, one in found["games"].items():
        listed.note("bits_per_command", one["played"][0] * BITS, "bits", preset=who)
        listed.note("bits_per_minute", one["played_per_min"] * BITS, "bits/min", preset=who)
    return listed


if __name__ == "__main__":
    main()
