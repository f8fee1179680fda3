"""Command line of `controller recordings`: inspect, check, correct and convert recordings."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from controller.cli import recordings_commands as commands
from controller.recordings.recording import LABELLERS


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of the commands; return the exit status: 0 success, 1 trouble, 2 wrong usage."""
    arguments = parser().parse_args(argv)
    return int(arguments.run(arguments))


def parser() -> argparse.ArgumentParser:
    """Return the grammar of the command line."""
    grammar = argparse.ArgumentParser(
        prog="controller recordings",
        description="Inspect, check, correct and convert recordings. No file is ever replaced.",
        epilog="Try it: controller recordings info assets/demo.npz",
    )
    group = grammar.add_subparsers(required=True, metavar="COMMAND")
    _add_inspection(group)
    _add_conversion(group)
    _add_correction(group)
    return grammar


def _add_inspection(group: Any) -> None:
    info = _add(
        group, "info", commands.info, "user, time, length, labels, and a small picture",
        "Print a summary with a picture of the mean touched image of each class: the darker, the "
        "more a taxel changed.",
        example="info assets/demo.npz",
    )  # fmt: skip
    info.add_argument("files", metavar="FILE", nargs="+", type=Path, help="a recording")
    info.add_argument("--json", action="store_true", help="a line of JSON for each file")
    check = _add(
        group, "check", commands.check, "check the quality of recordings",
        "Give each recording a verdict (good, doubtful or failed) and its reasons. Rows and "
        "columns of taxels count from the top left, from 0. The exit status is that of the worst "
        "file: 0 good, 1 doubtful, 2 failed.",
        example="check assets",
    )  # fmt: skip
    check.add_argument(
        "paths", metavar="PATH", nargs="+", type=Path, help="a recording, or a folder of them"
    )
    check.add_argument("--json", action="store_true", help="a line of JSON for each file")


def _add_conversion(group: Any) -> None:
    recover = _add(
        group, "recover", commands.recover, "recover recordings after a crash",
        "Turn journals that a crash or a power cut has left into recordings. Damaged journals are "
        "kept beside them; a recording under way is left alone.",
    )  # fmt: skip
    recover.add_argument(
        "paths", metavar="PATH", nargs="*", type=Path, default=[Path()],
        help="a journal, or a folder of them (default: this folder)",
    )  # fmt: skip
    export = _add(
        group, "export", commands.export, "export tables (CSV) that any program reads",
        "Write NAME.csv (a row for each frame), NAME_events.csv (true gestures, where known), "
        "NAME_commands.csv, NAME_marks.csv and NAME.json (all the rest).",
    )  # fmt: skip
    export.add_argument("files", metavar="FILE", nargs="+", type=Path, help="a recording")
    export.add_argument(
        "--out", metavar="DIR", type=Path,
        help="the folder to write into (default: beside the recording)",
    )  # fmt: skip
    importing = _add(
        group, "import", commands.import_arrays, "import arrays of other sensors",
        "Turn the arrays of another sensor (.npz or .npy) into recordings, one for each person "
        "and session, as a short TOML file describes them (docs/recording.md). Existing files are "
        "kept, so an interrupted import continues where it was.",
    )  # fmt: skip
    importing.add_argument("source", metavar="SOURCE", type=Path, help="a file of arrays")
    importing.add_argument(
        "description", metavar="DESCRIPTION", type=Path, help="TOML that describes the arrays"
    )
    importing.add_argument(
        "--out", metavar="DIR", type=Path, default=Path(),
        help="the folder to write into (default: this one)",
    )  # fmt: skip


def _add_correction(group: Any) -> None:
    trim = _add(
        group, "trim", commands.trim, "cut a range of time out, into a new file",
        "Write the frames of a range of time into a new recording, with the commands, marks and "
        "labels that belong to them. Times stay what they were.",
        example="trim assets/demo.npz --from 5 --to 20 --out piece.npz",
    )  # fmt: skip
    _add_range(trim)
    relabel = _add(
        group, "relabel", commands.relabel, "correct the labels of a range, into a new file",
        "Write a new recording in which a range of time has another label, or is excluded from "
        "training. A mark in it records the change.",
        example="relabel assets/demo.npz --from 5 --to 6 --label press --out corrected.npz",
    )  # fmt: skip
    _add_range(relabel)
    relabel.add_argument("--label", metavar="NAME", help='one of its labels, or "unknown"')
    relabel.add_argument(
        "--column", default="label", choices=LABELLERS,
        help="the column: label is the truth, the others are the sources at the time "
        "(default: label)",
    )  # fmt: skip
    which = relabel.add_mutually_exclusive_group()
    which.add_argument("--exclude", dest="excluded", action="store_true", default=None,
                       help="leave these frames out of training")  # fmt: skip
    which.add_argument("--include", dest="excluded", action="store_false", default=None,
                       help="the opposite")  # fmt: skip


def _add_range(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("file", metavar="FILE", type=Path, help="a recording; stays as it is")
    add("--from", dest="begin_s", metavar="S", type=float, default=float("-inf"),
        help="first time, in seconds of the recording (default: its beginning)")  # fmt: skip
    add("--to", dest="end_s", metavar="S", type=float, default=float("inf"),
        help="the time before which it ends (default: its end)")  # fmt: skip
    add("--out", metavar="NEW", type=Path, required=True, help="the file to write, .npz")


def _add(
    group: Any,
    name: str,
    run: Callable[[argparse.Namespace], int],
    help: str,
    description: str,
    example: str = "",
) -> argparse.ArgumentParser:
    """Add and return the parser of one command."""
    command: argparse.ArgumentParser = group.add_parser(
        name,
        help=help,
        description=description,
        epilog=f"Try it: controller recordings {example}" if example else None,
    )
    command.set_defaults(run=run)
    return command
