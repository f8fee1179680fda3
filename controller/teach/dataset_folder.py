"""The folder that a person teaches into: recordings, and the vocabulary beside them."""

import re
from collections import Counter
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Final

from controller.bundles import vocabulary as vocabularies
from controller.bundles.vocabulary import FILE, Vocabulary
from controller.config import MAX_BYTES
from controller.errors import reason
from controller.files import atomic_write, read_bytes
from controller.recordings import reader
from controller.recordings.recording import Mark, RecordingError
from controller.teach import TeachError

_ASKED: Final = re.compile(r"(go|again) ([a-z][a-z0-9_]*)[ :]?.*")  # a cue's mark


@dataclass(frozen=True, slots=True)
class ExistingRecording:
    """A recording that is there already."""

    path: Path  # its file
    user: str  # who touched the sensor
    session: str  # which of their sessions
    protocol: str  # what was asked for
    started: str  # when, UTC as ISO 8601
    examples: dict[str, int]  # how many of each label count


def vocabulary(out: Path, named: Path | None) -> Vocabulary:
    """Return the named vocabulary, else the folder's, else the paper's."""
    own = out / FILE
    if named is None and not own.is_file():
        return vocabularies.shipped()
    return vocabularies.read(named or own)


def lay(out: Path, wanted: Vocabulary) -> Vocabulary:
    """Lay a vocabulary beside the recordings, with the files that it names; return it as it lies.

    Raises:
        TeachError: The folder's recordings are of other gestures, or it cannot be written to, or a
            gesture's file would not be found there.
    """
    if (out / FILE).exists():
        lies = vocabularies.read(out / FILE)
        if _plain(lies) != _plain(wanted):
            raise TeachError(
                f"{out} holds recordings of other gestures, or they are declared otherwise "
                f"({out / FILE}); choose another --out"
            )
        return lies
    try:
        out.mkdir(parents=True, exist_ok=True)
        for entry in wanted.entries:
            if entry.file is not None and not (out / entry.file.name).exists():
                data = read_bytes(entry.file, MAX_BYTES)
                atomic_write(out / entry.file.name, data, replace=False)
        atomic_write(out / FILE, _flat(wanted).encode(), replace=False)
    except OSError as error:
        raise TeachError(
            f"cannot teach into {out}: {error.filename}: {reason(error)}; choose another --out"
        ) from None
    lies = vocabularies.read(out / FILE)
    if _plain(lies) != _plain(wanted):
        raise TeachError(f'write the files of {wanted.name!r} as file = "NAME.toml"')
    return lies


def taken(out: Path) -> list[ExistingRecording]:
    """Return the recordings of a folder that can be read, the oldest first."""
    found = []
    for path in sorted(out.glob("[!.]*.npz")):
        try:
            recording = reader.load(path)
        except RecordingError:
            continue
        origin = recording.origin
        found.append(
            ExistingRecording(path, origin.user, origin.session, origin.protocol, origin.started,
                  count(recording.marks))
        )  # fmt: skip
    return sorted(found, key=lambda one: (one.started, one.path.name))


def count(marks: tuple[Mark, ...]) -> dict[str, int]:
    """Return how many examples count, as the cues of a recording tell it."""
    counted: Counter[str] = Counter()
    for mark in marks:
        match = _ASKED.fullmatch(mark.text) if mark.kind == "cue" else None
        if match:
            counted[match[2]] += 1 if match[1] == "go" else -1
    return {label: number for label, number in counted.items() if number > 0}


def example(out: Path) -> list[Path]:
    """Write a vocabulary to begin with, and a gesture; TeachError if they cannot be written."""
    source = files("controller.teach") / "example"
    made = []
    try:
        for name in (FILE, "knock.toml"):
            atomic_write(out / name, (source / name).read_bytes(), replace=False)
            made.append(out / name)
    except OSError as error:
        raise TeachError(f"cannot write {error.filename}: {reason(error)}") from None
    return made


def _plain(one: Vocabulary) -> tuple[object, ...]:
    """Return what two vocabularies that are the same have in common, wherever their files lie."""
    return tuple(
        replace(entry, file=None if entry.file is None else Path(entry.file.name))
        for entry in one.entries
    )


def _flat(wanted: Vocabulary) -> str:
    """Return the text, with each gesture's file beside it."""
    text = wanted.text
    for entry in wanted.entries:
        if entry.file is not None:
            name = re.escape(entry.file.name)
            text = re.sub(rf"(?m)^(\s*file\s*=\s*)([\"'])[^\"'\n]*?{name}\2",
                          rf"\1\2{entry.file.name}\2", text)  # fmt: skip
    return text
