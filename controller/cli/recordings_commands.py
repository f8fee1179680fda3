"""Commands of `controller recordings`: files in, lines and new files out."""

import json
import secrets
from argparse import Namespace
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from controller.errors import TROUBLE, complain, count, printable, reason
from controller.recordings import (
    csv_export,
    edit,
    import_description,
    importer,
    journal_file,
    reader,
    summary,
    writer,
)
from controller.recordings.edit import MetadataChange
from controller.recordings.quality import check as quality
from controller.recordings.quality.check import Finding, FrameIndex, Level, Report
from controller.recordings.recording import Recording, RecordingError

_HIDDEN: Final = "."  # begins the names of unfinished files


def info(options: Namespace) -> int:
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


def check(options: Namespace) -> int:
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


def recover(options: Namespace) -> int:
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


def export(options: Namespace) -> int:
    """Write recordings as tables, and print the path of each."""
    for path in options.files:
        tables = csv_export.tables(reader.load(path))
        folder = _folder(options.out or path.parent)
        for end in tables:
            _refuse_taken(folder / (path.stem + end))
        for end, text in tables.items():
            _write(folder / (path.stem + end), csv_export.encode(text))
        print(folder / f"{path.stem}.json")
    return 0


def import_arrays(options: Namespace) -> int:
    """Import another sensor's arrays; print the new files."""
    description = import_description.read(options.description)
    arrays = importer.read(options.source, description)
    folder = _folder(options.out)
    known = _ids(folder)
    for recording in importer.recordings(arrays, description):
        origin = recording.origin
        if (there := known.get(origin.id)) is not None:
            print(f"{there} is there already")
            continue
        target = writer.next_free(folder, origin.user, origin.session)
        _write(target, edit.sealed(recording))
        length = summary.duration(len(recording.t) / origin.rate_hz)
        print(f"{target}: {count(len(recording.t), 'frame')}, {length}")
    return 0


def trim(options: Namespace) -> int:
    """Write a piece of a recording into a new file."""
    return _changed(
        options,
        lambda whole, change: edit.trim(whole, options.begin_s, options.end_s, change),
    )


def relabel(options: Namespace) -> int:
    """Write a recording with other labels into a new file."""
    return _changed(
        options,
        lambda whole, change: edit.relabel(
            whole, options.begin_s, options.end_s, change,
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


def _refuse_taken(target: Path) -> None:
    if target.exists() or target.is_symlink():
        raise RecordingError(f"{target} exists and is kept as it is; choose another --out")


def _write(target: Path, data: bytes) -> None:
    """Write a new file atomically."""
    try:
        writer.write_beside(target, data)
    except FileExistsError:
        raise RecordingError(
            f"{target} exists and is kept as it is; choose another --out"
        ) from None


def _ids(folder: Path) -> Mapping[str, Path]:
    """Return the recordings in a folder, by id."""
    known = {}
    for path in sorted(folder.glob("[!.]*.npz")):
        with suppress(RecordingError):  # another file
            known[reader.survey(path).origin.id] = path
    known.pop("", None)
    return known


def _changed(options: Namespace, change: Callable[[Recording, MetadataChange], Recording]) -> int:
    """Write a changed recording into a new file, and print its path."""
    out = options.out
    if out.suffix != ".npz":
        raise RecordingError(f"{out} would not be found as a recording; end its name in .npz")
    _refuse_taken(out)
    if not out.parent.is_dir():
        raise RecordingError(f"there is no folder {out.parent}; choose another --out")
    when = datetime.now(UTC).isoformat(timespec="seconds")
    source = MetadataChange(secrets.token_hex(16), options.file.name, when)
    _write(out, edit.sealed(change(reader.load(options.file), source)))
    print(out)
    return 0
