"""A vocabulary: the gestures that somebody teaches, and what each of them asks for.

It is a TOML file that lies beside the recordings (docs/teach.md):

    name = "mine"

    [[gesture]]                     # in the order of the network's outputs; "null" comes first
    label = "press"
    say = "press with one finger"   # what the cue says
    rotations = "all"               # symmetries: docs/gestures.md; silence means none
    mirror = "self"
    located = true                  # where it is made is learned and told as well
    command = "drop"                # or rules, as in docs/mapping.md

    [[gesture]]
    label = "knock"
    file = "knock.toml"             # how the virtual orb's own hand does it
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from controller.config import ConfigError, parse_toml
from controller.errors import UserError, reason
from controller.files import read_text
from controller.recognition import mapping
from controller.recognition.mapping import Mapping, MappingError

FILE: Final = "gestures.toml"  # its name beside recordings
ROTATIONS: Final = ("none", "half", "all")  # fewest first
SELF, NO_MIRROR = "self", "none"
MAX_GESTURES: Final = 60  # with "null" they fit in a bundle

_MAX_BYTES: Final = 256 * 1024
_LABEL: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")  # 40 characters fit in a packet
_MAX_SAY: Final = 80  # one line of a terminal


class VocabularyError(UserError, ValueError):
    """The file is no vocabulary; the message says where, and what belongs there."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One gesture of a vocabulary.

    Attributes:
        label: Its name.
        say: What the cue says.
        rotations: Turns of the sensor that leave it the same gesture: "all", "half" or "none".
        mirror: What its mirror image is: "self", another label, or "none" (no gesture).
        located: Whether its place is learned.
        command: What it asks for, as in a mapping; None: nothing.
        file: How the virtual orb's hand does it; None: as the gesture that ships.
        shifts: Whether it is the same gesture anywhere on the sensor.
    """

    label: str
    say: str
    rotations: str = "none"
    mirror: str = NO_MIRROR
    located: bool = False
    command: str | tuple[dict[str, Any], ...] | None = None
    file: Path | None = None
    shifts: bool = False


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """Gestures, in the order of the network's outputs.

    Attributes:
        name: Of the whole.
        entries: The gestures, without "null".
        text: The file as it was written, so that it can be laid beside recordings.
    """

    name: str
    entries: tuple[Entry, ...]
    text: str = ""

    @property
    def labels(self) -> tuple[str, ...]:
        """Every label, "null" first."""
        return ("null", *(entry.label for entry in self.entries))

    @property
    def located(self) -> tuple[str, ...]:
        """The gestures whose place is learned."""
        return tuple(entry.label for entry in self.entries if entry.located)

    @property
    def files(self) -> tuple[Path, ...]:
        """How the virtual orb's hand does them, where it is not as they ship."""
        return tuple(entry.file for entry in self.entries if entry.file is not None)

    @property
    def table(self) -> dict[str, Any]:
        """What each gesture asks for, as a table of a mapping."""
        return {
            entry.label: entry.command if isinstance(entry.command, str) else list(entry.command)
            for entry in self.entries
            if entry.command is not None
        }

    @property
    def mapping(self) -> Mapping:
        """The same, ready for use."""
        return mapping.parse(self.table, self.labels)

    def rotations(self, rows: int, columns: int) -> str:
        """Return the turns that every gesture and the grid allow: "all", "half" or "none"."""
        turns = ["all" if rows == columns else "half", *(e.rotations for e in self.entries)]
        return next(kind for kind in ROTATIONS if kind in turns)

    @property
    def mirrors(self) -> dict[str, str] | None:
        """Label -> label of its mirror image, where it differs; None if any gesture has none."""
        if any(entry.mirror == NO_MIRROR for entry in self.entries):
            return None
        return {e.label: e.mirror for e in self.entries if e.mirror not in (SELF, e.label)}


def shipped() -> Vocabulary:
    """Return the paper's gestures."""
    text = (files("controller.bundles") / FILE).read_text(encoding="utf-8")
    return parse(text, FILE, Path())


def of(labels: Sequence[str]) -> Vocabulary:
    """Return a vocabulary for labels of which nothing else is known, "null" first.

    What a gesture that ships declares is taken from there; others declare nothing.
    """
    known = {entry.label: entry for entry in shipped().entries}
    entries = tuple(known.get(label) or Entry(label, _words(label)) for label in labels[1:])
    mirrored = tuple(
        entry if entry.mirror in (SELF, NO_MIRROR, *labels) else Entry(entry.label, entry.say)
        for entry in entries
    )
    return Vocabulary("labels", mirrored)


def read(path: Path) -> Vocabulary:
    """Return the vocabulary in a file.

    Raises:
        VocabularyError: It cannot be read, or is none; one sentence.
    """
    try:
        text = read_text(path, _MAX_BYTES)
    except OSError as error:
        raise VocabularyError(f"cannot read {path}: {reason(error)}") from None
    return parse(text, str(path), path.parent)


def parse(text: str, source: str, folder: Path) -> Vocabulary:
    """Return the vocabulary in a text.

    Args:
        text: TOML.
        source: What errors begin with.
        folder: What `file` is relative to.

    Raises:
        VocabularyError: It is none.
    """
    try:
        table = parse_toml(text, _MAX_BYTES)
    except ConfigError as error:
        raise VocabularyError(f"{source}, {error}") from None
    odd = sorted(set(table) - {"name", "gesture"})
    if odd:
        raise VocabularyError(f"{source}: {odd[0]!r} is unknown; there are name and [[gesture]]")
    given = table.get("gesture")
    if not isinstance(given, list) or not 1 <= len(given) <= MAX_GESTURES:
        raise VocabularyError(
            f"{source} has no gestures; write 1 to {MAX_GESTURES} tables [[gesture]]"
        )
    entries = tuple(_entry(f"{source}, gesture {i}", g, folder) for i, g in enumerate(given, 1))
    name = table.get("name", Path(source).stem)
    if not isinstance(name, str) or not 0 < len(name) <= _MAX_SAY:
        raise VocabularyError(f"{source}: name is {name!r}, not a text of one line")
    vocabulary = Vocabulary(name, entries, text)
    _check(source, vocabulary)
    return vocabulary


def _check(source: str, vocabulary: Vocabulary) -> None:
    """Refuse gestures that do not go together."""
    labels = vocabulary.labels
    by_label = {entry.label: entry for entry in vocabulary.entries}
    if len(by_label) < len(vocabulary.entries):
        twice = next(label for label in labels if labels.count(label) > 1)
        raise VocabularyError(f"{source} has two gestures {twice!r}; rename one")
    for entry in vocabulary.entries:
        if entry.mirror in (SELF, NO_MIRROR):
            continue
        image = by_label.get(entry.mirror)
        if image is None or image.mirror != entry.label:
            raise VocabularyError(
                f"{source}: the mirror image of {entry.label!r} is {entry.mirror!r}, which does "
                "not name it in turn"
            )
    try:
        mapping.parse(vocabulary.table, labels)
    except MappingError as error:
        raise VocabularyError(f"{source}: {error} (docs/mapping.md)") from None


_KEYS: Final = ("label", "say", "rotations", "mirror", "shifts", "located", "command", "file")


def _entry(where: str, table: Any, folder: Path) -> Entry:
    """Return one gesture, every line checked."""
    if not isinstance(table, dict):
        raise VocabularyError(f"{where} is {table!r}; write [[gesture]] above its lines")
    label = table.get("label")
    if not isinstance(label, str) or not _LABEL.fullmatch(label) or label == "null":
        raise VocabularyError(
            f"{where}: label is {label!r}; write a name of small letters, digits and _, not null"
        )
    where = f"{where} ({label})"
    odd = sorted(set(table) - set(_KEYS))
    if odd:
        raise VocabularyError(f"{where}: {odd[0]!r} is unknown; there are {', '.join(_KEYS)}")
    say = table.get("say", _words(label))
    if not isinstance(say, str) or not 0 < len(say) <= _MAX_SAY or not say.isprintable():
        raise VocabularyError(
            f"{where}: say is {say!r}, write one line, {_MAX_SAY} letters at most"
        )
    rotations = table.get("rotations", "none")
    if rotations not in ROTATIONS:
        raise VocabularyError(f"{where}: rotations is {rotations!r}; it is {', '.join(ROTATIONS)}")
    mirror, located = table.get("mirror", NO_MIRROR), table.get("located", False)
    shifts = table.get("shifts", False)
    if not (isinstance(mirror, str) and isinstance(located, bool) and isinstance(shifts, bool)):
        raise VocabularyError(f"{where}: mirror is a label, located and shifts true or false")
    command, file = table.get("command"), table.get("file")
    if file is not None and (not isinstance(file, str) or not file):
        raise VocabularyError(f"{where}: file is {file!r}, not the name of a gesture's file")
    return Entry(
        label=label,
        say=say,
        rotations=rotations,
        mirror=SELF if mirror == label else mirror,
        located=located,
        command=tuple(command) if isinstance(command, list) else command,
        file=None if file is None else folder / file,
        shifts=shifts,
    )


def _words(label: str) -> str:
    return label.replace("_", " ")
