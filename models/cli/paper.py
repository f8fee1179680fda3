"""`models paper`: figures 7 and 9 of the paper and its section 6, repeated and corrected."""

import argparse
from pathlib import Path
from typing import Final

from controller.shared import errors
from models.cli import _options as options

DESCRIPTION: Final = (
    "Teach by a simulated user as in section 4.2 of the paper, train by both recipes on both "
    "presets, and draw figure 7; repeat section 6 and figure 9, correct it, and bound the "
    "information of a bundle's answers on other days (orbtouch docs paper). With recordings, "
    "section 6 and the bound are those of the recordings. Results are kept and not measured "
    "again; half an hour on one core."
)
EXAMPLE: Final = "Try it (two minutes): models paper --out report --only section6"
PARTS: Final = ("figure7", "section6", "bound")


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.set_defaults(resumes=True)
    add = parser.add_argument
    add("bundle", type=Path, nargs="?", help="of the bound (default: the one that ships)")
    add("data", type=Path, nargs="*", metavar="DIR", help="recordings, or folders of them")
    words = "folder for results and drawings; made if need be"
    add("--out", type=Path, required=True, metavar="DIR", help=words)
    add("--only", nargs="+", choices=PARTS, default=[], help="some parts (default: all)")
    add("--full", action="store_true", help="figure 7 by the paper's own amounts: some hours")


def run(arguments: argparse.Namespace) -> int:
    """Measure, draw, and print."""
    options.require("repeating the paper", "torch", "sklearn", "matplotlib")
    from controller.bundles import bundle
    from controller.simulator.orb import PRESETS
    from models.data import examples
    from models.results import storage
    from models.studies.paper import drawings, figure7, study, tables

    out = errors.output_folder(arguments.out)
    kept = out / study.MEASURED
    sets: dict[str, study.Paths] = dict.fromkeys(PRESETS, ())
    if arguments.data:
        files = examples.recording_sets(arguments.data)
        sets = {name.replace("|", "_"): tuple(own) for name, own in files.items()}
    found = study.measure(
        sets,
        arguments.only,
        arguments.bundle or bundle.default_path(),
        figure7.PAPERS_OWN if arguments.full else figure7.Settings(),
        kept,
        errors.say,
    )
    storage.write_json(kept, found)
    print(tables.text(found))
    for path in [kept, *drawings.draw(found, out)]:
        errors.say(f"wrote {path}")
    return 0
