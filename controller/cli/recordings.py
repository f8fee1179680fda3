"""`controller recordings`: look at recordings, judge, mend, convert them; none is ever replaced."""

import argparse
import secrets
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from controller.cli import recordings_commands
from controller.recordings.edit import MetadataChange
from controller.recordings.recording import LABELLERS

_EXAMPLE = "Try it: controller recordings info assets/demo.npz"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of the commands; return the exit status: 0 success, 1 trouble, 2 wrong usage."""
    arguments = parser().parse_args(argv)
    return int(arguments.run(arguments))


def parser() -> argparse.ArgumentParser:
    """Return the grammar of the command line."""
    grammar = argparse.ArgumentParser(
        prog="controller recordings",
        description="Look at recordings, judge, mend and convert them. No file is ever replaced.",
        epilog=_EXAMPLE,
    )
    commands = grammar.add_subparsers(required=True, metavar="COMMAND")
    _looking(commands)
    _saving(commands)
    _changing(commands)
    return grammar


def _looking(commands: Any) -> None:
    info = commands.add_parser(
        "info",
        help="who, when, how long, what, and a small picture",
        description="Say what a recording is, with a picture of the mean touched image of each "
        "class: the darker, the more a taxel changed.",
        epilog=_EXAMPLE,
    )
    info.add_argument("files", metavar="FILE", nargs="+", type=Path, help="a recording")
    info.add_argument("--json", action="store_true", help="a line of JSON for each file")
    info.set_defaults(run=lambda a: recordings_commands.info(a.files, a.json))
    check = commands.add_parser(
        "check",
        help="whether recordings are any good",
        description="Give each recording a verdict (good, doubtful or failed) and its reasons. "
        "Rows and columns of taxels count from the top left, from 0. Labels begin and end late or "
        "early against the touch, where its energy passes one half; the spread is the range of "
        "the middle half of them.",
        epilog="The exit status is that of the worst file: 0 good, 1 doubtful, 2 failed. "
        "Try it: controller recordings check assets",
    )
    check.add_argument(
        "paths", metavar="PATH", nargs="+", type=Path, help="a recording, or a folder of them"
    )
    check.add_argument("--json", action="store_true", help="a line of JSON for each file")
    check.set_defaults(run=lambda a: recordings_commands.check(a.paths, a.json))


def _saving(commands: Any) -> None:
    recover = commands.add_parser(
        "recover",
        help="seal what a crash has left",
        description="Turn journals that a crash or a power cut has left into recordings. What is "
        "damaged is kept beside them; a recording under way is left alone.",
    )
    recover.add_argument(
        "paths", metavar="PATH", nargs="*", type=Path, default=[Path()],
        help="a journal, or a folder of them (default: this folder)",
    )  # fmt: skip
    recover.set_defaults(run=lambda a: recordings_commands.recover(a.paths))
    export = commands.add_parser(
        "export",
        help="into tables (CSV) that any program reads",
        description="Write NAME.csv (a row for each frame), NAME_events.csv (true gestures, where "
        "known), NAME_commands.csv, NAME_marks.csv and NAME.json (all the rest). Nothing is lost: "
        "controller recordings import NAME.json gives the same recording again.",
    )
    export.add_argument("files", metavar="FILE", nargs="+", type=Path, help="a recording")
    _add_out(export, "the folder to write into (default: beside the recording)")
    export.set_defaults(run=lambda a: recordings_commands.export(a.files, a.out))
    take = commands.add_parser(
        "import",
        help="from exported tables, or from other sensors' arrays",
        description="Turn an exported NAME.json and its tables into the recording again; or turn "
        "the arrays of another sensor (.npz or .npy) into recordings, one for each person and "
        "session, as a short TOML file describes them (docs/recording.md). What is there already "
        "is kept, so an interrupted import goes on where it was.",
    )
    take.add_argument("source", metavar="SOURCE", type=Path, help="NAME.json, or a file of arrays")
    take.add_argument(
        "description", metavar="DESCRIPTION", nargs="?", type=Path, help="what the arrays are, TOML"
    )
    _add_out(take, "the folder to write into (default: this one)")
    take.set_defaults(
        run=lambda a: recordings_commands.take(a.source, a.description, a.out or Path())
    )


def _changing(commands: Any) -> None:
    trim = commands.add_parser(
        "trim",
        help="cut a piece out, into a new file",
        description="Write the frames of a range of time into a new recording, with the commands, "
        "marks and labels that belong to them. Times stay what they were.",
        epilog="Try it: controller recordings trim assets/demo.npz --from 5 --to 20 "
        "--out piece.npz",
    )
    _add_range(trim)
    trim.set_defaults(
        run=lambda a: recordings_commands.trim(a.file, a.begin_s, a.end_s, a.out, _change(a.file))
    )
    relabel = commands.add_parser(
        "relabel",
        help="correct the labels of a range, into a new file",
        description="Write a new recording in which a range of time has another label, or is "
        "excluded from learning. A mark in it says what was changed.",
        epilog="Try it: controller recordings relabel assets/demo.npz --from 5 --to 6 "
        "--label press --out corrected.npz",
    )
    _add_range(relabel)
    relabel.add_argument("--label", metavar="NAME", help='one of its labels, or "unknown"')
    relabel.add_argument(
        "--column", default="label", choices=LABELLERS,
        help="whose labels: label is what is held for true, the others what was said at the time "
        "(default: label)",
    )  # fmt: skip
    which = relabel.add_mutually_exclusive_group()
    which.add_argument("--exclude", dest="excluded", action="store_true", default=None,
                       help="nobody shall learn from these frames")  # fmt: skip
    which.add_argument("--include", dest="excluded", action="store_false", default=None,
                       help="the opposite")  # fmt: skip
    relabel.set_defaults(
        run=lambda a: recordings_commands.relabel(
            a.file, a.begin_s, a.end_s, a.out, _change(a.file),
            label=a.label, column=a.column, excluded=a.excluded,
        )
    )  # fmt: skip


def _add_out(command: argparse.ArgumentParser, words: str) -> None:
    command.add_argument("--out", metavar="DIR", type=Path, help=words)


def _add_range(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("file", metavar="FILE", type=Path, help="a recording; stays as it is")
    add("--from", dest="begin_s", metavar="S", type=float, default=float("-inf"),
        help="first time, in seconds of the recording (default: its beginning)")  # fmt: skip
    add("--to", dest="end_s", metavar="S", type=float, default=float("inf"),
        help="the time before which it ends (default: its end)")  # fmt: skip
    add("--out", metavar="NEW", type=Path, required=True, help="the file to write, .npz")


def _change(source: Path) -> MetadataChange:
    """Return who a recording is that is made now, from that one."""
    when = datetime.now(UTC).isoformat(timespec="seconds")
    return MetadataChange(secrets.token_hex(16), source.name, when)
