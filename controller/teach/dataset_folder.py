"""The folder that a person teaches into: recordings, vocabulary, and what comes next: training."""

import re
import shlex
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from controller.bundles import vocabulary as vocabularies
from controller.bundles.vocabulary import FILE, Vocabulary
from controller.config import MAX_BYTES
from controller.errors import how_to_install, reason
from controller.files import atomic_write, read_bytes
from controller.recordings import reader
from controller.recordings.recording import Mark, RecordingError
from controller.teach import TeachError
from controller.teach.protocols import LOCATIONS, USERS

NEEDED: Final = ("torch", "onnx", "tomli_w")  # what training imports: the [train] extra
FEWEST: Final = 3  # sessions, from which on one is spared for the evaluation
DAYS: Final = 2  # sessions of each person, from which on people can be told apart
_ASKED: Final = re.compile(r"(go|again) ([a-z][a-z0-9_]*)[ :]?.*")  # a cue's mark

Command = list[str]  # the words after `models`


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


# --- the next step --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class NextStep:
    """Next step after recording."""

    # the words after `models`, in order; none: there is too little yet
    commands: tuple[Command, ...]
    bundle: Path  # what becomes of it
    note: str  # what their figures are worth, or what is missing, a sentence
    # what is asked before they are run
    question: str = "Train, tune and evaluate now? It takes minutes."


def course(out: Path, taken: Sequence[ExistingRecording]) -> NextStep:
    """Return how to make a bundle of a folder's recordings, the oldest first.

    The newest session of gestures is spared: nothing is trained or tuned on it, and so its figures
    are those of another day.
    """
    bundle = _bundle(out)
    report = str(bundle.with_suffix(".html"))
    sittings = list(dict.fromkeys(
        (one.user, one.session) for one in taken if one.protocol != LOCATIONS
    ))  # fmt: skip
    if len(sittings) >= FEWEST:
        spared = [one for one in taken if _is(one, sittings[-1])]
        learned = [str(one.path) for one in taken if not _is(one, sittings[-1])]
        judged = [str(one.path) for one in spared]
        note = (
            "the newest session is spared: evaluate shows how well a session is understood that "
            "nothing was learned from"
        )
    else:
        learned = judged = [str(out)]
        note = (
            f"evaluate uses the sessions that were learned from, so it flatters; from {FEWEST} "
            "sessions on, the newest is spared for it"
        )
    name = str(bundle)
    return NextStep(
        (
            ["train", *learned, "--out", name],
            ["tune", name, *learned, "--out", name, "--html", report],
            ["evaluate", name, *judged, "--html", report],
        ),
        bundle,
        note,
    )


def course_of_people(out: Path, taken: Sequence[ExistingRecording]) -> NextStep:
    """Return how to make a bundle that tells the people of a folder's recordings apart."""
    bundle = _bundle(out)
    days: dict[str, set[str]] = {}
    for one in taken:
        if one.protocol != LOCATIONS:
            days.setdefault(one.user, set()).add(one.session)
    if len(days) < 2:
        reason = f"only {' '.join(days)} was recorded; people are told apart from two on"
        return NextStep((), bundle, reason)
    few = [name for name, sessions in days.items() if len(sessions) < DAYS]
    if few:
        again = f"controller teach --protocol {USERS} --user {','.join(days)} --out {out}"
        reason = (
            f"{' and '.join(few)} came on one day only, and a network would learn that day; "
            f"on another one: {again} (docs/users.md)"
        )
        return NextStep((), bundle, reason)
    return NextStep(
        (["train", str(out), "--task", "user", "--out", str(bundle)],),
        bundle,
        "the last session of each is judged, and then learned from as well; add recordings of "
        "people who shall be nobody with --others DIR (docs/users.md)",
        "Train it to tell them apart now? It takes a minute or two.",
    )


def offer(
    planned: NextStep,
    *,
    agree: Callable[[str], bool] | None,
    say: Callable[[str], None],
    call: Callable[[Sequence[str]], int] = subprocess.call,
    installed: Callable[[], bool] | None = None,
    yes: bool = False,
) -> int:
    """Offer to make the bundle, or say how; return the exit status.

    `agree` asks a question for yes or no (None: nobody can be asked), `call` runs a command,
    `installed` tells whether training can run here; `yes`: it is wanted without a question.
    """
    if not planned.commands:
        say(planned.note)
        return 0
    here = (installed or trainable)()
    if here and (yes or (agree is not None and agree(planned.question))):
        for words in planned.commands:
            say(f"models {shlex.join(words)}")
            if status := call([sys.executable, "-m", "models", *words]):
                say("the same commands go on from here:")
                _tell(planned, say)
                return 1 if status < 0 else status
        say(f"{planned.note}. Play with it: host -- --bundle {shlex.quote(str(planned.bundle))}")
        return 0
    if here:
        say("make a bundle of it with:")
    else:
        say(f"training needs more packages than playing does: {how_to_install('train')}; then:")
    _tell(planned, say)
    return 0 if here or not yes else 1


def trainable() -> bool:
    """Whether training can run here; nothing is imported."""
    return all(find_spec(name) is not None for name in NEEDED)


def _bundle(out: Path) -> Path:
    return out.with_name(f"{out.resolve().name}.orb") if out.name else Path("my.orb")


def _tell(planned: NextStep, say: Callable[[str], None]) -> None:
    for words in planned.commands:
        say(f"  models {shlex.join(words)}")
    say(f"({planned.note})")


def _is(one: ExistingRecording, sitting: tuple[str, str]) -> bool:
    return (one.user, one.session) == sitting and one.protocol != LOCATIONS
