"""Command line of `controller recordings`: inspect, check, correct and convert recordings."""

import argparse
import json
from argparse import Namespace
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from controller.arguments import Parser
from controller.errors import TROUBLE, complain, count, printable, reason
from controller.recordings import edit, importer, journal_file, reader, summary, writer
from controller.recordings.description import Description, described
from controller.recordings.quality import check as quality
from controller.recordings.quality.check import Finding, FrameIndex, Level, Report
from controller.recordings.recording import LABELLERS, Recording, RecordingError

_HIDDEN: Final = "."  # begins the names of unfinished files


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of the commands; return the exit status: 0 success, 1 trouble, 2 wrong usage."""
    arguments = parser().parse_args(argv)
    return int(arguments.run(arguments))


def parser() -> argparse.ArgumentParser:
    """Return the grammar of the command line."""
    grammar = Parser(
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
        group, "info", _info, "user, time, length, labels, and a small picture",
        "Print a summary with a picture of the mean touched image of each class: the darker, the "
        "more a taxel changed.",
        example="info assets/demo.npz",
    )  # fmt: skip
    info.add_argument("files", metavar="FILE", nargs="+", type=Path, help="a recording")
    info.add_argument("--json", action="store_true", help="a line of JSON for each file")
    check = _add(
        group, "check", _check, "check the quality of recordings",
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
        group, "recover", _recover, "recover recordings after a crash",
        "Turn journals that a crash or a power cut has left into recordings. Damaged journals are "
        "kept beside them; a recording under way is left alone.",
    )  # fmt: skip
    recover.add_argument(
        "paths", metavar="PATH", nargs="*", type=Path, default=[Path()],
        help="a journal, or a folder of them (default: this folder)",
    )  # fmt: skip
    importing = _add(
        group, "import", _import_arrays, "import arrays of other sensors",
        "Turn the arrays of another sensor (.npz or .npy) into recordings, one for each person "
        "and session, as a short TOML file describes them (docs/recording.md). Existing files are "
        "kept, so an interrupted import continues where it was.",
    )  # fmt: skip
    importing.add_argument("sources", metavar="SOURCE", nargs="+", type=Path, help="arrays")
    importing.add_argument("description", metavar="DESCRIPTION", type=Path, help="TOML about them")
    importing.add_argument(
        "--out", metavar="DIR", type=Path, default=Path(),
        help="the folder to write into (default: this one)",
    )  # fmt: skip


def _add_correction(group: Any) -> None:
    trim = _add(
        group, "trim", _trim, "cut a range of time out, into a new file",
        "Write the frames of a range of time into a new recording, with the commands, marks and "
        "labels that belong to them. Times stay what they were.",
        example="trim assets/demo.npz --from 5 --to 20 --out piece.npz",
    )  # fmt: skip
    _add_range(trim)
    relabel = _add(
        group, "relabel", _relabel, "correct the labels of a range, into a new file",
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
    run: Callable[[Namespace], int],
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


# --- commands -------------------------------------------------------------------------------------


def _info(options: Namespace) -> int:
    """Print summaries of recordings."""
    for number, path in enumerate(options.files):
        recording = reader.load(path)
        if options.json:
            print(json.dumps(summary.facts(path, recording)))
            continue
        if number:
            print()
        for line in summary.lines(path, recording):
            print(printable(line))
    return 0


def _check(options: Namespace) -> int:
    """Print a verdict for each recording; return that of the worst."""
    files, journals = _found(options.paths)
    reports = [*_examined(files), *(Report(path, (_unfinished(path),)) for path in journals)]
    if not reports:
        where = ", ".join(map(str, options.paths))
        raise RecordingError(f"there are no recordings in {where}; name files, or a folder of them")
    for report in reports:
        lines = [json.dumps(report.plain())] if options.json else summary.verdict(report)
        for line in lines:
            print(printable(line))
    if not options.json and len(reports) > 1:
        counts = [(sum(r.level is level for r in reports), level.name.lower()) for level in Level]
        print(f"{len(reports)} files: " + ", ".join(f"{n} {word}" for n, word in counts))
    return int(max(report.level for report in reports))


def _examined(files: Iterable[Path]) -> list[Report]:
    """Return the reports on recordings, with shared frames."""
    index, reports = FrameIndex(), []
    loaded: list[Path] = []
    for path in files:
        try:
            recording = reader.load(path)
        except RecordingError as error:
            reports.append(Report(path, (Finding(Level.FAILED, str(error)),)))
            continue
        index.add(recording)
        loaded.append(path)
        reports.append(quality.examine(path, recording))
    by_path = {loaded[number]: shared for number, shared in index.shared().items()}
    return [
        report.also(*quality.duplicated(by_path.get(report.path, {}), loaded)) for report in reports
    ]


def _recover(options: Namespace) -> int:
    """Recover the journals that a crash has left, and print the outcome of each."""
    status, found = 0, False
    for path in options.paths:
        for journal in journal_file.leftovers(path) if path.is_dir() else [path]:
            found = True
            try:
                print(printable(journal_file.recover(journal).line))
            except journal_file.LockedError as error:
                status = max(status, 0 if path.is_dir() else 1)
                complain("controller", error, TROUBLE)
            except RecordingError as error:
                status = complain("controller", error, TROUBLE)
    if not found:
        where = ", ".join(map(str, options.paths))
        print(f"no journal is left in {where}; nothing to recover")
    return status


def _import_arrays(options: Namespace) -> int:
    """Import another sensor's arrays; print the new files, and the sources that cannot be read."""
    description = described(options.description)
    folder = _folder(options.out)
    known, status = _ids(folder), 0
    for source in options.sources:
        try:
            _import_one(source, description, folder, known)
        except RecordingError as error:
            if len(options.sources) == 1:
                raise
            status = complain("controller", f"{source} is left out: {error}", TROUBLE)
    return status


def _import_one(
    source: Path, description: Description, folder: Path, known: dict[str, Path]
) -> None:
    """Import one file of arrays, without recordings that are `known` by their ids."""
    for recording in importer.recordings(importer.read(source, description), description):
        origin = recording.origin
        if (there := known.get(origin.id)) is not None:
            print(f"{there} is there already")
            continue
        target = writer.next_free(folder, origin.user, origin.session)
        _write(target, edit.sealed(recording))
        frames = len(recording.t)
        print(f"{target}: {count(frames, 'frame')}, {summary.duration(frames / origin.rate_hz)}")


def _trim(options: Namespace) -> int:
    """Write a piece of a recording into a new file."""
    return _changed(
        options, lambda whole, source: edit.trim(whole, options.begin_s, options.end_s, source)
    )


def _relabel(options: Namespace) -> int:
    """Write a recording with other labels into a new file."""
    return _changed(
        options,
        lambda whole, source: edit.relabel(
            whole, options.begin_s, options.end_s, source,
            label=options.label, column=options.column, excluded=options.excluded,
        ),
    )  # fmt: skip


# --- helpers --------------------------------------------------------------------------------------


def _found(paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Return the recordings and the journals at these places, each once, in order."""
    files: dict[Path, None] = {}
    journals: dict[Path, None] = {}
    for path in paths:
        inside = sorted(path.rglob("*")) if path.is_dir() else [path]
        for file in inside:
            if writer.JOURNAL in file.name:
                journals[file] = None
            elif file == path or (file.suffix == ".npz" and not file.name.startswith(_HIDDEN)):
                files[file] = None
    return list(files), list(journals)


def _unfinished(journal: Path) -> Finding:
    """Return the finding about a journal."""
    if journal.name.endswith(writer.JOURNAL):
        text = "a recording under way, or what a crash has left; if none is under way: controller "
        return Finding(Level.DOUBTFUL, f"{text}recordings recover {journal}")
    return Finding(Level.GOOD, "a damaged journal after its recovery; nothing is left to do")


def _folder(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(
            f"cannot write into {folder}: {reason(error)}; choose another --out"
        ) from None
    return folder


def _write(target: Path, data: bytes) -> None:
    """Write a new file atomically; RecordingError if it exists or cannot be written."""
    try:
        writer.write_beside(target, data)
    except FileExistsError:
        problem = f"{target} exists and is kept as it is"
    except OSError as error:
        problem = f"cannot write {target}: {reason(error)}"
    else:
        return
    raise RecordingError(f"{problem}; choose another --out")


def _ids(folder: Path) -> dict[str, Path]:
    """Return the recordings in a folder, by id."""
    known: dict[str, Path] = {}
    for path in sorted(folder.glob("[!.]*.npz")):
        with suppress(RecordingError):  # another file
            known[reader.survey(path).origin.id] = path
    known.pop("", None)
    return known


def _changed(options: Namespace, change: Callable[[Recording, str], Recording]) -> int:
    """Write a changed recording into a new file, and print its path."""
    out = options.out
    if out.suffix != ".npz":
        raise RecordingError(f"{out} would not be found as a recording; end its name in .npz")
    _write(out, edit.sealed(change(reader.load(options.file), options.file.name)))
    print(out)
    return 0
