"""The player's settings, kept in a TOML file, and the look that they choose.

A file from another version, or edited by hand, is read as far as it makes sense: a value that
is out of its limits or of another kind is as if it were not there. A file that is no TOML at
all is put aside, never overwritten.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final

import tomli_w

from tetris import files
from tetris.kit import bindings, language
from tetris.kit.bindings import Names
from tetris.kit.language import FALLBACK
from tetris.kit.theme import PALETTES

FILE_NAME: Final = "tetris.toml"

Limits = tuple[int, int, int]
Choices = tuple[str, ...]


FIGURES: Final = ("time_s", "pieces_per_s", "pieces", "commands_per_piece", "score", "none")
_VOLUME: Final = (0, 100, 10)


def _of(section: str, usual: Any, *, limits: Limits | None = None, choices: Choices = ()) -> Any:
    """Return a setting in a section of the file; of a number the least, the most and the step."""
    how = {"section": section, "limits": limits, "choices": choices}
    return field(default=usual, metadata=how)


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of the player, in the order of the menu."""

    mode: str = _of("play", "marathon")  # played last, like the next
    orb_mode: str = _of("play", "orb_marathon")  # the same, where an orb plays
    # how an orb plays: by the touched column, or by commands
    control: str = _of("play", "aim", choices=("aim", "buttons"))
    level: int = _of("play", 1, limits=(1, 20, 1))
    introduced: bool = _of("play", False)  # whether the introduction to the orb was offered
    # before a held direction repeats: docs/tetris.md "auto_repeat"
    das_ms: int = _of("handling", 167, limits=(0, 500, 5))
    arr_ms: int = _of("handling", 33, limits=(0, 200, 1))  # between repeats; 0: to the wall at once
    soft_drop: int = _of("handling", 20, limits=(1, 60, 1))  # times as fast as gravity
    # which turns and holds act on a piece as it enters: pressed while none is in play, or all held
    initial: str = _of("handling", "tap", choices=("off", "tap", "hold"))
    # after a lock, in which a hard drop is ignored
    guard_ms: int = _of("handling", 0, limits=(0, 500, 10))
    theme: str = _of("screen", "dark", choices=tuple(PALETTES))
    patterns: bool = _of("screen", False)  # each piece has a mark of its own
    motion: bool = _of("screen", True)  # things move that need not
    ghost: bool = _of("screen", True)
    grid: bool = _of("screen", True)
    scale: int = _of("screen", 100, limits=(80, 160, 10))  # of letters and menus, per cent
    # beside the board, after the three of the mode, like the next
    figure_4: str = _of("screen", "time_s", choices=FIGURES)
    figure_5: str = _of("screen", "pieces_per_s", choices=FIGURES)
    fullscreen: bool = _of("screen", False)
    # its file's name, or "" for the system's
    language: str = _of("screen", "", choices=("", *language.names()))
    effects: int = _of("sound", 70, limits=_VOLUME)  # volume, per cent, like the next
    clicks: int = _of("sound", 40, limits=_VOLUME)  # of menus
    keys: Names = field(default_factory=lambda: bindings.KEYS)
    pads: Names = field(default_factory=lambda: bindings.PADS)

    @property
    def figures(self) -> tuple[str, str]:
        """The figures beside the board that the player chose."""
        return self.figure_4, self.figure_5


class Look:
    """Palette and words that every picture is drawn with, and the settings that chose them."""

    def __init__(self, settings: Settings = Settings(language=FALLBACK)) -> None:  # noqa: B008
        self.settings = settings
        self.palette = PALETTES[settings.theme]
        self.words = language.load(settings.language or language.of_system())

    @property
    def scale(self) -> float:
        """Size of letters beside the board, 1.0 the one that suits the cells."""
        return self.settings.scale / 100


_KNOWN: Final = {one.name: one.metadata for one in fields(Settings) if one.metadata}
LIMITS: Final[dict[str, Limits]] = {
    name: how["limits"] for name, how in _KNOWN.items() if how["limits"]
}
"""Of each number the least, the most, and the step with which a menu changes it."""
CHOICES: Final[dict[str, Choices]] = {
    name: how["choices"] for name, how in _KNOWN.items() if how["choices"]
}
SECTIONS: Final[Mapping[str, tuple[str, ...]]] = {
    section: tuple(name for name, how in _KNOWN.items() if how["section"] == section)
    for section in ("play", "handling", "screen", "sound")
}
"""Names of settings by the part of the file that they stand in."""

_BINDINGS: Final = ("keys", "pads")
_MOST_BYTES: Final = 64 << 10
_MOST_DOTS: Final = 100  # of a line: tomllib takes time and memory quadratic in those of a key


def load(path: Path) -> tuple[Settings, str]:
    """Return the settings of a file, and a sentence for the player, "" when all is well."""

    def read(file: Path) -> Settings:
        words = files.read_bytes(file, _MOST_BYTES).decode("utf-8-sig")
        if any(line.count(".") > _MOST_DOTS for line in words.split("\n")):
            raise ValueError("a line has too many dots")
        return parse(words)

    return files.load(path, read, Settings())


def save(path: Path, settings: Settings) -> str:
    """Write the settings, all or nothing; return a sentence for the player, "" when all is well."""
    try:
        files.write_beside(path, format_toml(settings).encode())
    except OSError as error:
        return f"cannot save {path}: {error.strerror}"
    return ""


def parse(words: str) -> Settings:
    """Read settings as TOML; what makes no sense in them is as if it were not there."""
    read = tomllib.loads(words)
    given: dict[str, Any] = {}
    usual = Settings()
    for section, names in SECTIONS.items():
        values = read.get(section)
        if not isinstance(values, dict):
            continue
        for name in names:
            if _fits(name, values.get(name), getattr(usual, name)):
                given[name] = values[name]
    for name in _BINDINGS:
        if isinstance(read.get(name), dict):
            given[name] = _bindings(read[name], getattr(usual, name))
    return replace(usual, **given)


def _fits(name: str, value: object, usual: object) -> bool:
    if type(value) is not type(usual):
        return False
    if isinstance(value, int) and name in LIMITS:
        least, most, _ = LIMITS[name]
        return least <= value <= most
    return name not in CHOICES or value in CHOICES[name]


def _bindings(read: dict[str, Any], usual: Names) -> Names:
    """Return bindings from a file; an action that it does not name keeps its usual ones."""
    chosen = dict(usual)
    for action in usual:
        given = read.get(action)
        if isinstance(given, list):
            chosen[action] = tuple(
                name for name in given if isinstance(name, str) and bindings.is_name(name)
            )
    return chosen


def format_toml(settings: Settings) -> str:
    """Write settings as `load` reads them."""
    tables: dict[str, dict[str, Any]] = {
        section: {name: getattr(settings, name) for name in names}
        for section, names in SECTIONS.items()
    }
    for section in _BINDINGS:
        bound: Names = getattr(settings, section)
        tables[section] = {action: list(names) for action, names in bound.items()}
    return tomli_w.dumps(tables)


def stepped(settings: Settings, name: str, direction: int) -> Settings:
    """Return settings with one value changed by a step; numbers stay in their limits."""
    value = getattr(settings, name)
    if names := CHOICES.get(name):
        value = names[(names.index(value) + direction) % len(names)]
    elif isinstance(value, bool):
        value = not value
    else:
        least, most, step = LIMITS[name]
        value = max(least, min(most, value + direction * step))
    return replace(settings, **{name: value})
