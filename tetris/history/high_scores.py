"""Best lists and numbers of games per mode, in one file that a crash cannot spoil.

The file is written beside the old one and renamed; one that cannot be read is put aside and
kept, and a sentence says so. Another program's additions are read before ours are written.
"""

import dataclasses
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, get_type_hints

from tetris.engine.modes import PACE_LINES, Mode, Ranking
from tetris.files import load, read_bytes, write_beside

FILE_NAME: Final = "records.json"
PLACES: Final = 10
_FORM: Final = 1
_MOST_BYTES: Final = 4_000_000
_MOST_NUMBER: Final = 2**64
_MOST_WORD: Final = 100


@dataclass(frozen=True, slots=True)
class Entry:
    """One game of a best list."""

    score: int
    lines: int
    pieces: int
    time_s: float
    date: str = ""  # when it ended, as the caller writes dates
    pace_hz: float = 0.0  # commands a second for which its last gravity left time; 0 for none

    @property
    def pieces_per_s(self) -> float:
        """Pieces a second; 0 for a game without time."""
        return self.pieces / self.time_s if self.time_s > 0 else 0.0


@dataclass(slots=True)
class _Record:
    best: list[Entry] = field(default_factory=list)
    games: int = 0  # that ended
    won: int = 0  # of which the goal was reached, or the time was over


_KEYS: Final[Mapping[Ranking, Callable[[Entry], float]]] = {
    "score": lambda entry: -entry.score,
    "lines": lambda entry: -entry.lines,
    "time": lambda entry: entry.time_s,
    "pace": lambda entry: -entry.pace_hz,
}


class HighScores:
    """The best lists of one player.

    Attributes:
        trouble: A sentence about the last reading or writing that went wrong; "" if none did.
    """

    def __init__(self, folder: Path | None) -> None:
        """Read them; a file that is not there yet is no trouble. Without a folder none are kept."""
        self._path = None if folder is None else folder / FILE_NAME
        self.trouble = ""
        self._records: dict[str, _Record] = {}
        self._read()

    def best(self, mode: str, level: int = 1) -> tuple[Entry, ...]:
        """Return a mode's best games from a start level, the best first, ten at most."""
        return tuple(self._records.get(_name(mode, level), _Record()).best)

    def games(self, mode: str, level: int = 1) -> tuple[int, int]:
        """Return how many games ended, and how many of them reached their goal, like `best`."""
        record = self._records.get(_name(mode, level), _Record())
        return record.games, record.won

    def add(self, mode: Mode, entry: Entry, *, won: bool, level: int = 1) -> int | None:
        """Add a finished game, write the file, and return its place from 1; None below ten.

        A game by time has a place if it was won, one by pace if the pace has risen.
        Where the file cannot be written, `trouble` is set, and the game is still listed
        until the program ends.
        """
        self._read()
        record = self._records.setdefault(_name(mode.name, level), _Record())
        record.games += 1
        record.won += won
        place = PLACES
        if {"time": won, "pace": entry.lines >= PACE_LINES}.get(mode.ranking, True):
            key = _KEYS[mode.ranking]
            place = sum(key(other) <= key(entry) for other in record.best)  # the earlier one leads
            record.best.insert(place, entry)
            del record.best[PLACES:]
        self._write()
        return place + 1 if place < PLACES else None

    # -- the file ----------------------------------------------------------------------

    def _read(self) -> None:
        if self._path is not None:
            self._records, self.trouble = load(self._path, _load, self._records)

    def _write(self) -> None:
        if self._path is None:
            return
        modes = {
            name: {
                "best": [dataclasses.asdict(entry) for entry in record.best],
                "totals": {"games": record.games, "won": record.won},
            }
            for name, record in self._records.items()
        }
        text = json.dumps({"form": _FORM, "modes": modes}, indent=1)
        try:
            write_beside(self._path, text.encode("ascii"))
        except OSError as error:
            self.trouble = f"cannot write {self._path}: {error.strerror or error}"


def _name(mode: str, level: int) -> str:
    """Return the name of a list: each start level has one, and level 1 that of the mode."""
    return mode if level == 1 else f"{mode}.{level}"


def _load(path: Path) -> dict[str, _Record]:
    """Read a file, every value checked.

    Raises:
        OSError: It cannot be read.
        ValueError: Something is not as we write it.
    """
    document = json.loads(read_bytes(path, _MOST_BYTES))
    try:
        if document["form"] != _FORM or any(
            len(mode["best"]) > PLACES for mode in document["modes"].values()
        ):
            raise ValueError("of another form")
        return {name: _record(given) for name, given in document["modes"].items()}
    except (TypeError, KeyError, AttributeError) as error:
        raise ValueError("no best lists") from error


def _record(given: dict[str, Any]) -> _Record:
    """Make a record of a JSON object, each value of its type."""
    counts = [_checked(name, int, given["totals"][name]) for name in ("games", "won")]
    kinds = get_type_hints(Entry)
    best = [
        Entry(**{name: _checked(name, kind, entry[name]) for name, kind in kinds.items()})
        for entry in given["best"]
    ]
    return _Record(best, *counts)


def _checked(name: str, kind: type, value: Any) -> Any:
    fits = type(value) in ((float, int) if kind is float else (kind,))
    # No number is not a number or endless.
    if not fits or not (len(value) <= _MOST_WORD if kind is str else 0 <= value <= _MOST_NUMBER):
        raise ValueError(f"{name} is {value!r:.40}")
    return value
