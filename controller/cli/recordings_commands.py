"""The commands of `controller recordings`: files in, lines and new files out."""

import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from controller.console import TROUBLE, complain, count, printable
from controller.errors import reason
from controller.recordings import (
    csv_export,
    edit,
    import_description,
    importer,
    naming,
    reader,
    recovery,
    summary,
    text_image,
    writer,
)
from controller.recordings.edit import MetadataChange
from controller.recordings.quality import check as quality
from controller.recordings.quality.check import Finding, Level, Report
from controller.recordings.quality.duplicates import FrameIndex
from controller.recordings.quality.labels import LabelDelay
from controller.recordings.recording import Recording, RecordingError

_HIDDEN: Final = "."  # begins the names of files that are not whole yet


def info(files: Iterable[Path], as_json: bool) -> int:
    """Print what recordings are."""
    for number, path in enumerate(files):
        recording = reader.load(path)
        if as_json:
            print(json.dumps(summary.facts(path, recording)))
            continue
        if number:
            print()
        for line in summary.lines(path, recording, _shades()):
            print(printable(line))
    return 0


def check(paths: Sequence[Path], as_json: bool) -> int:
    """Print a verdict for each recording; return that of the worst."""
    register, reports = FrameIndex(), []
    files, journals = _found(paths)
    loaded: list[Path] = []
    for path in files:
        try:
            recording = reader.load(path)
        except RecordingError as error:
            reports.append(Report(path, (Finding(Level.FAILED, str(error)),)))
            continue
        register.add(recording)
        loaded.append(path)
        reports.append(quality.examine(path, recording))
    twice = {loaded[number]: shared for number, shared in register.shared().items()}
    reports = [
        report.also(*quality.twice(twice.get(report.path, {}), loaded)) for report in reports
    ]
    reports += [Report(path, (_left(path),)) for path in journals]
    if not reports:
        where = ", ".join(map(str, paths))
        raise RecordingError(f"there are no recordings in {where}; name files, or a folder of them")
    for report in reports:
        if as_json:
            print(json.dumps(report.plain()))
        else:
            print("\n".join(printable(line) for line in _verdict(report)))
    if not as_json and len(reports) > 1:
        counts = [(sum(r.level is level for r in reports), level.name.lower()) for level in Level]
        print(f"{len(reports)} files: " + ", ".join(f"{n} {word}" for n, word in counts))
    return int(max(report.level for report in reports))


def recover(paths: Sequence[Path]) -> int:
    """Seal the journals that a crash has left, and print what became of each."""
    status, found = 0, False
    for path in paths:
        for journal in recovery.leftovers(path) if path.is_dir() else [path]:
            found = True
            try:
                print(printable(str(recovery.recover(journal))))
            except recovery.LockedError as error:
                status = max(status, 0 if path.is_dir() else 1)
                complain("controller", error, TROUBLE)
            except RecordingError as error:
                status = complain("controller", error, TROUBLE)
    if not found:
        print(f"no journal is left in {', '.join(map(str, paths))}; nothing to recover")
    return status


def export(files: Iterable[Path], out: Path | None) -> int:
    """Write recordings as tables, and print where each went."""
    for path in files:
        recording = reader.load(path)
        folder = _folder(out or path.parent)
        made = {
            folder / (path.stem + end): text for end, text in csv_export.tables(recording).items()
        }
        for target in made:
            _refuse_taken(target)
        for target, text in made.items():
            _write(target, csv_export.encode(text))
        print(folder / f"{path.stem}.json")
    return 0


def take(source: Path, told: Path | None, out: Path) -> int:
    """Import an exported recording, or another sensor's arrays; print what was written."""
    if source.suffix == ".json":
        if told is not None:
            raise RecordingError("an exported recording describes itself; leave the TOML file out")
        target = _folder(out) / f"{source.stem}.npz"
        _refuse_taken(target)
        _write(target, edit.sealed(csv_export.read(source)))
        print(target)
        return 0
    if told is None:
        raise RecordingError(
            f"{source} does not say what its arrays are; name a TOML file that does "
            "(docs/recording.md)"
        )
    meant = import_description.read(told)
    arrays = importer.read(source, meant)
    folder = _folder(out)
    known = _ids(folder)
    for recording in importer.recordings(arrays, meant):
        origin = recording.origin
        if (there := known.get(origin.id)) is not None:
            print(f"{there} is there already")
            continue
        target = naming.next_free(folder, origin.user, origin.session)
        _write(target, edit.sealed(recording))
        length = summary.duration(len(recording.t) / origin.rate_hz)
        print(f"{target}: {count(len(recording.t), 'frame')}, {length}")
    return 0


def trim(file: Path, begin_s: float, end_s: float, out: Path, change: MetadataChange) -> int:
    """Write a piece of a recording into a new file."""
    return _changed(file, out, lambda whole: edit.trim(whole, begin_s, end_s, change))


def relabel(
    file: Path, begin_s: float, end_s: float, out: Path, change: MetadataChange, **what: Any
) -> int:
    """Write a recording with other labels into a new file; `what` is as for `edit.relabel`."""
    return _changed(file, out, lambda whole: edit.relabel(whole, begin_s, end_s, change, **what))


# --- helpers --------------------------------------------------------------------------------------


def _shades() -> str:
    """Return the signs that the terminal can draw pictures with."""
    try:
        text_image.BLOCKS.encode(sys.stdout.encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return text_image.ASCII
    return text_image.BLOCKS


def _found(paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Return the recordings and the journals at these places, each once, in order."""
    files: dict[Path, None] = {}
    journals: dict[Path, None] = {}
    for path in paths:
        inside = sorted(path.rglob("*")) if path.is_dir() else [path]
        for file in inside:
            if naming.JOURNAL in file.name:
                journals[file] = None
            elif file == path or (file.suffix == ".npz" and not file.name.startswith(_HIDDEN)):
                files[file] = None
    return list(files), list(journals)


def _left(journal: Path) -> Finding:
    """Say what to do with a journal."""
    if journal.name.endswith(naming.JOURNAL):
        what = "a recording under way, or what a crash has left; if none is under way: controller "
        return Finding(Level.DOUBTFUL, f"{what}recordings recover {journal}")
    what = "what was left of a damaged journal after recovery; nothing more is to be done with it"
    return Finding(Level.GOOD, what)


def _verdict(report: Report) -> list[str]:
    """Return what to print of one file."""
    lines = [f"{report.level.name.lower():8}  {report.path}"]
    if (rhythm := report.cadence) is not None:
        lines.append(
            f"  cadence   {summary.duration(report.seconds)} at {rhythm.measured_hz:.2f} Hz "
            f"({rhythm.intended_hz:g} intended), {rhythm.missing} of "
            f"{rhythm.missing + rhythm.frames} frames missing"
            + f", in {rhythm.stretches} stretches"
            * (rhythm.stretches > 1)
        )
        lines.append(
            f"            intervals: median {rhythm.median_ms:.0f} ms, "
            f"95 % up to {rhythm.p95_ms:.0f} ms, worst {rhythm.worst_ms:.0f} ms"
        )
    for one in report.said:
        lines += summary.said(one)
        lags = [f"{edge} {_lag(lag)}" for edge, lag in (("begins", one.begin), ("ends", one.end))
                if lag is not None]  # fmt: skip
        if lags:
            lines.append(f"  {'':9} {', '.join(lags)}")
    for finding in sorted(report.findings, key=lambda each: -each.level):
        word = "note" if finding.level is Level.GOOD else finding.level.name.lower()
        lines.append(f"  {word + ':':9} {finding.text}")
    return lines


def _lag(lag: LabelDelay) -> str:
    when = "late" if lag.median_s >= 0 else "early"
    return f"{abs(lag.median_s):.2f} s {when} (spread {lag.spread_s:.2f} s)"


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
    """Write a new file, whole or not at all."""
    try:
        writer.write_beside(target, data)
    except FileExistsError:
        raise RecordingError(
            f"{target} exists and is kept as it is; choose another --out"
        ) from None


def _ids(folder: Path) -> Mapping[str, Path]:
    """Return the recordings that are in a folder, by id."""
    there = {}
    for path in sorted(folder.glob("[!.]*.npz")):
        try:
            there[reader.survey(path).origin.id] = path
        except RecordingError:
            continue  # whatever it is, it is none of ours and stays
    there.pop("", None)
    return there


def _changed(file: Path, out: Path, change: Callable[[Recording], Recording]) -> int:
    """Write what becomes of a recording into a new file, and print which."""
    if out.suffix != ".npz":
        raise RecordingError(f"{out} would not be found as a recording; end its name in .npz")
    _refuse_taken(out)
    if not out.parent.is_dir():
        raise RecordingError(f"there is no folder {out.parent}; choose another --out")
    _write(out, edit.sealed(change(reader.load(file))))
    print(out)
    return 0
