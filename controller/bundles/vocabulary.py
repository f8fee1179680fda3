"""Parse vocabularies: gestures to train, their symmetries and commands.

A vocabulary is a TOML file beside the recordings (docs/teach-terminal.md):

    name = "mine"
    extends = "paper"               # optional: the paper's gestures come first

    [[gesture]]                     # in the order of the network's outputs; "null" comes first
    label = "press"
    say = "press with one finger"   # text of the cue
    rotations = "all"               # symmetries: docs/gestures.md; none by default
    mirror = "self"
    located = true                  # its position is learned, too
    command = "drop"                # or rules, as in docs/mapping.md

    [[gesture]]
    label = "knock"
    file = "knock.toml"             # movement of the virtual hand
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from controller.recognition import mapping
from controller.recognition.mapping import Mapping, MappingError
from controller.shared import config
from controller.shared.config import ConfigError
from controller.shared.errors import UserError, reason
from controller.shared.files import read_text

FILE: Final = "gestures.toml"  # the file's name beside recordings
ROTATIONS: Final = ("none", "half", "all")  # fewest first
SELF, NO_MIRROR = "self", "none"
PAPER: Final = "paper"  # the vocabulary that others may extend
MAX_GESTURES: Final = 60  # with "null" they fit in a bundle

_MAX_BYTES: Final = 256 * 1024
_MAX_LINE: Final = 80  # letters
_LABEL: Final = {
    "pattern": r"(?!null$)[a-z][a-z0-9_]{0,39}",  # 40 characters fit in a packet
    "expected": "a name of small letters, digits and _, not null",
}


class VocabularyError(UserError, ValueError):
    """The file is no vocabulary; the message names the entry and the expected value."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One gesture of a vocabulary."""

    label: str = field(metadata=_LABEL)
    say: str = ""  # text of the cue; by default the label in words
    # rotations under which the gesture is invariant: "all", "half" or "none"
    rotations: str = field(default="none", metadata={"choices": ROTATIONS})
    mirror: str = NO_MIRROR  # its mirror image: "self", another label, or "none" (no gesture)
    located: bool = False  # whether its position is learned
    # its command, as in a mapping; None: nothing
    command: str | tuple[dict[str, Any], ...] | None = None
    file: Path | None = None  # movement of the simulated hand; None: that of the shipped gesture
    shifts: bool = False  # whether it is the same gesture anywhere on the sensor

    def __post_init__(self) -> None:
        if not self.say.isprintable() or len(self.say) > _MAX_LINE:
            raise ValueError(f"say = {self.say!r}; write one line of {_MAX_LINE} letters at most")
        if not self.say:
            object.__setattr__(self, "say", self.label.replace("_", " "))
        if self.mirror == self.label:
            object.__setattr__(self, "mirror", SELF)


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """Gestures, in the order of the network's outputs."""

    name: str
    entries: tuple[Entry, ...]  # the gestures, without "null"
    text: str = ""  # content of the file, to copy it beside recordings

    @property
    def labels(self) -> tuple[str, ...]:
        """Every label, "null" first."""
        return ("null", *(entry.label for entry in self.entries))

    @property
    def located(self) -> tuple[str, ...]:
        """The gestures whose position is learned."""
        return tuple(entry.label for entry in self.entries if entry.located)

    @property
    def files(self) -> tuple[Path, ...]:
        """Movements of the simulated hand, for gestures that are not shipped."""
        return tuple(entry.file for entry in self.entries if entry.file is not None)

    @property
    def table(self) -> dict[str, Any]:
        """Commands of the gestures, as a table of a mapping."""
        return {
            entry.label: list(entry.command) if isinstance(entry.command, tuple) else entry.command
            for entry in self.entries
            if entry.command is not None
        }

    @property
    def mapping(self) -> Mapping:
        """Commands of the gestures."""
        return mapping.parse(self.table, self.labels)


def shipped() -> Vocabulary:
    """Return the paper's gestures."""
    text = (files("controller.bundles") / FILE).read_text(encoding="utf-8")
    return parse(text, FILE, Path())


def of(labels: Sequence[str], *, orb: bool = True) -> Vocabulary:
    """Return a vocabulary for labels, "null" first, with the symmetries of the shipped gestures.

    On another sensor than the orb, a shipped label lends no symmetry: its gesture may be another.
    """
    known = {entry.label: entry for entry in shipped().entries}
    if not orb:
        known = {
            label: replace(entry, rotations=ROTATIONS[0], mirror=NO_MIRROR, shifts=False)
            for label, entry in known.items()
        }
    entries = tuple(known.get(label) or Entry(label) for label in labels[1:])
    mirrored = tuple(
        entry if entry.mirror in (SELF, NO_MIRROR, *labels) else Entry(entry.label, entry.say)
        for entry in entries
    )
    return Vocabulary("labels", mirrored)


def read(path: Path) -> Vocabulary:
    """Return the vocabulary in a file; VocabularyError if it cannot be read, or is none."""
    try:
        text = read_text(path, _MAX_BYTES)
    except OSError as error:
        raise VocabularyError(f"cannot read {path}: {reason(error)}") from None
    return parse(text, str(path), path.parent)


def parse(text: str, source: str, folder: Path) -> Vocabulary:
    """Return the vocabulary in a TOML text; VocabularyError, with the source, if it is none."""
    try:
        table = config.parse_toml(text, _MAX_BYTES)
    except ConfigError as error:
        raise VocabularyError(f"{source}, {error}") from None
    given = table.pop("gesture", None)
    try:
        head = config.settings(_Head, {"name": Path(source).stem, **table})
    except ConfigError as error:
        raise VocabularyError(f"{source} {error}") from None
    if not isinstance(given, list) or not 1 <= len(given) <= MAX_GESTURES:
        raise VocabularyError(
            f"{source} has no gestures; write 1 to {MAX_GESTURES} tables [[gesture]]"
        )
    entries = tuple(_entry(f"{source}, gesture {i}", g, folder) for i, g in enumerate(given, 1))
    inherited = shipped().entries if head.extends == PAPER else ()
    vocabulary = Vocabulary(head.name, (*inherited, *entries), text)
    _check(source, vocabulary)
    return vocabulary


@dataclass(frozen=True, slots=True)
class _Head:
    """The entries of a vocabulary other than its gestures."""

    name: str = field(metadata={"pattern": ".{1,80}", "expected": "one line of 1 to 80 letters"})
    extends: str = field(default="", metadata={"choices": (PAPER,)})


def _check(source: str, vocabulary: Vocabulary) -> None:
    """Refuse gestures that contradict each other."""
    labels = vocabulary.labels
    by_label = {entry.label: entry for entry in vocabulary.entries}
    if len(by_label) < len(vocabulary.entries):
        repeated = next(label for label in labels if labels.count(label) > 1)
        raise VocabularyError(f"{source} has two gestures {repeated!r}; rename one")
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
        raise VocabularyError(f"{source}: {error} (orbtouch docs mapping)") from None


def _entry(where: str, table: Any, folder: Path) -> Entry:
    """Return one gesture, with every entry of its table checked."""
    if not isinstance(table, dict):
        raise VocabularyError(f"{where} is {table!r}; write [[gesture]] above its lines")
    if isinstance(label := table.get("label"), str):
        where = f"{where} ({label})"
    command, file = table.get("command"), table.get("file")
    if file is not None and (not isinstance(file, str) or not file):
        raise VocabularyError(f"{where}: file is {file!r}, not the name of a gesture's file")
    own = {
        "command": tuple(command) if isinstance(command, list) else command,
        "file": None if file is None else folder / file,
    }
    try:
        return config.settings(Entry, {**table, **own})
    except ConfigError as error:
        raise VocabularyError(f"{where} {error}") from None
