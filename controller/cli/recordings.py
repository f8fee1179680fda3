"""Command line of `controller recordings`: recover, judge and import recordings."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from controller.recordings import edit, importer, journal_file, reader, summary, writer
from controller.recordings.description import Description, described
from controller.recordings.quality.check import (
    Finding,
    FrameIndex,
    Level,
    Report,
    duplicated,
    examine,
)
from controller.recordings.recording import Recording, RecordingError
from controller.shared.arguments import Parser
from controller.shared.errors import TROUBLE, complain, count, output_folder, printable, reason

_HIDDEN: Final = "."  # begins the names of unfinished files


def main(argv: Sequence[str]) -> int:
    """Run `controller recordings`; return its exit status."""
    return _import(argv[1:]) if argv[:1] == ["import"] else _check(argv)


# --- recover and check ----------------------------------------------------------------------------


def _check(argv: Sequence[str]) -> int:
    """Recover journals and judge recordings; return the worst verdict as exit status."""
    grammar = Parser(
        prog="controller recordings",
        usage="controller recordings PATH ...\n"
        "       controller recordings import SOURCE ... DESCRIPTION [--out DIR]",
        description="Recover what a crash has left, then give each recording a verdict (good, "
        "doubtful or failed) with its reasons, and a file that is named a summary. "
        "Rows and columns of taxels count from the top left, from 0. The exit "
        "status is that of the worst file: 0 good, 1 doubtful, 2 failed.",
        epilog="Try it: orbtouch examples OUT; controller recordings OUT/demo.npz. Other sensors' "
        "arrays: "
        "controller recordings import --help",
    )
    text = "a recording, or a folder of them"
    grammar.add_argument("paths", metavar="PATH", nargs="+", type=Path, help=text)
    options = grammar.parse_args(argv)
    places, kept = _recovered(options.paths)
    found = [*_examined(places), *map(_Found, kept)]
    if not found:
        where = ", ".join(map(str, options.paths))
        raise RecordingError(f"there are no recordings in {where}; name files, or a folder of them")
    for one in found:
        for line in summary.lines(one.report, one.recording):
            print(printable(line))
    if len(found) > 1:
        levels = [one.report.level for one in found]
        counts = [(levels.count(level), level.name.lower()) for level in Level]
        print(f"{len(found)} files: " + ", ".join(f"{n} {word}" for n, word in counts))
    return int(max(one.report.level for one in found))


@dataclass(frozen=True)
class _Found:
    """A file with its verdict."""

    report: Report
    recording: Recording | None = None  # where its summary is wanted


def _examined(paths: Sequence[Path]) -> list["_Found"]:
    """Return the recordings at these places, each once, and judge frames that they share."""
    index, loaded, found = FrameIndex(), list[Path](), list[_Found]()
    files = dict.fromkeys(file for place in paths for file in _files(place))
    for path in files:
        try:
            recording = reader.load(path, mapped=True)
        except RecordingError as error:
            found.append(_Found(Report(path, (Finding(Level.FAILED, str(error)),))))
            continue
        loaded.append(path)
        if len(files) > 1:
            index.add(recording)
        try:
            report = examine(path, recording)
        except OSError as error:
            room = "set TMPDIR to a folder with as much room as it unpacks to"
            raise RecordingError(f"cannot check {path}: {reason(error)}; {room}") from None
        found.append(_Found(report, recording if path in paths else None))
    by_path = {loaded[number]: shared for number, shared in index.shared().items()}
    return [
        replace(one, report=one.report.also(*duplicated(by_path.get(one.report.path, {}), loaded)))
        for one in found
    ]


def _files(place: Path) -> Iterator[Path]:
    """Yield the recordings at a place, in order: a file, or those in a folder."""
    for file in sorted(place.rglob("*.npz")) if place.is_dir() else [place]:
        if not file.name.startswith(_HIDDEN) and writer.JOURNAL not in file.name:
            yield file


def _recovered(places: Sequence[Path]) -> tuple[list[Path], list[Report]]:
    """Recover journals; return the places of recordings, and reports on journals that remain."""
    recordings: list[Path] = []
    reports: list[Report] = []
    for place in places:
        journals = sorted(place.rglob(f"*{writer.JOURNAL}")) if place.is_dir() else []
        if writer.JOURNAL in place.name:
            journals = [place]
        else:
            recordings.append(place)
        for journal in journals:
            try:
                done = journal_file.recover(journal)
            except journal_file.LockedError as error:
                reports.append(Report(journal, (Finding(Level.GOOD, str(error)),)))
            except RecordingError as error:
                reports.append(Report(journal, (Finding(Level.FAILED, str(error)),)))
            else:
                recordings += [done.path] if done.path is not None and journal == place else []
                print(printable(done.line))
    return recordings, reports


# --- import ---------------------------------------------------------------------------------------


def _import(argv: Sequence[str]) -> int:
    """Import another sensor's arrays; print the new files, and the sources that cannot be read."""
    grammar = Parser(
        prog="controller recordings import",
        description="Turn arrays or tables of another sensor (.npz, .npy, .csv) into recordings, "
        "one for each person and session, as a short TOML file describes them. Existing files "
        "are kept, so an interrupted import continues where it was: orbtouch docs recording.",
    )
    add = grammar.add_argument
    add("sources", metavar="SOURCE", nargs="+", type=Path, help="arrays, or a table")
    add("description", metavar="DESCRIPTION", type=Path, help="TOML about them")
    text = "the folder to write into (default: this one)"
    add("--out", metavar="DIR", type=Path, default=Path(), help=text)
    options = grammar.parse_args(argv)
    description = described(options.description)
    folder = output_folder(options.out)
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
        try:
            writer.write_beside(target, edit.sealed(recording))
        except OSError as error:
            raise RecordingError(
                f"cannot write {target}: {reason(error)}; choose another --out"
            ) from None
        frames = len(recording.t)
        length = summary.duration(frames / origin.rate_hz)
        found = "as described" if description.sign else "as found from the frames"
        effect = "raises" if origin.sign > 0 else "lowers"
        print(f"{target}: {count(frames, 'frame')}, {length}; touch {effect} readings, {found}")


def _ids(folder: Path) -> dict[str, Path]:
    """Return the recordings in a folder, by id."""
    known: dict[str, Path] = {}
    for path in sorted(folder.glob("[!.]*.npz")):
        with suppress(RecordingError):  # another file
            known[reader.survey(path).origin.id] = path
    known.pop("", None)
    return known
