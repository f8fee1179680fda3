"""Best lists and totals per mode, in one file that a crash cannot spoil.

The file is written beside the old one and renamed; one that cannot be read is put aside and
kept, and a sentence says so. Another program's additions are read before ours are written.
"""

import dataclasses
import json
import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeVar, get_type_hints

from tetris.engine.modes import Mode, Ranking
from tetris.files import load, read_bytes, write_beside
from tetris.history.stats import Summary

FILE_NAME: Final = "records.json"
PLACES: Final = 10
_FORM: Final = 1
_SUMMED: Final = ("lines", "pieces", "time_s", "commands", "faultless")  # of a summary
_MOST_BYTES: Final = 4_000_000
_MOST_NUMBER: Final = 2**64
_MOST_WORD: Final = 100
_MOST_NAMES: Final = 100


@dataclass(frozen=True, slots=True)
class Entry:
    """One game of a best list.

    Attributes:
        won: Whether the goal was reached, or the time was over.
        seed: Of the game.
        date: When it ended, as the caller writes dates.
        replay: The name of its replay's file; "" for none.
    """

    score: int
    lines: int
    level: int
    pieces: int
    time_s: float
    commands: int
    faultless: int
    won: bool
    seed: int
    date: str = ""
    replay: str = ""

    @property
    def pieces_per_s(self) -> float:
        """Pieces a second; 0 for a game without time."""
        return self.pieces / self.time_s if self.time_s > 0 else 0.0


@dataclass(frozen=True, slots=True)
class Totals:
    """All games of a mode together.

    Attributes:
        clears: How often each clear was made, by its name.
    """

    games: int = 0
    won: int = 0
    time_s: float = 0.0
    pieces: int = 0
    lines: int = 0
    commands: int = 0
    faultless: int = 0
    clears: Mapping[str, int] = field(default_factory=dict)


_KEYS: Final[Mapping[Ranking, Callable[[Entry], float]]] = {
    "score": lambda entry: -entry.score,
    "lines": lambda entry: -entry.lines,
    "time": lambda entry: entry.time_s,
}


class HighScores:
    """The best lists and totals of one player.

    Attributes:
        trouble: A sentence about the last reading or writing that went wrong; "" if none did.
    """

    def __init__(self, folder: Path) -> None:
        """Read them; a folder or a file that is not there yet is no trouble."""
        self._path = folder / FILE_NAME
        self.trouble = ""
        self._best: dict[str, list[Entry]] = {}
        self._totals: dict[str, Totals] = {}
        self._read()

    def best(self, mode: str) -> tuple[Entry, ...]:
        """Return a mode's best games, the best first, ten at most."""
        return tuple(self._best.get(mode, ()))

    def totals(self, mode: str) -> Totals:
        """Return all of a mode's games together."""
        return self._totals.get(mode, Totals())

    def add(
        self,
        mode: Mode,
        summary: Summary,
        *,
        won: bool,
        seed: int,
        date: str = "",
        replay: str = "",
    ) -> int | None:
        """Add a finished game, write the file, and return its place from 1; None below ten.

        Where the file cannot be written, `trouble` is set, and the game is still listed
        until the program ends.
        """
        self._read()
        before = self.totals(mode.name)
        sums = {name: getattr(before, name) + getattr(summary, name) for name in _SUMMED}
        self._totals[mode.name] = Totals(
            games=before.games + 1,
            won=before.won + won,
            clears=dict(Counter(before.clears) + Counter(summary.clears)),
            **sums,
        )
        figures = {name: getattr(summary, name) for name in ("score", "level", *_SUMMED)}
        entry = Entry(won=won, seed=seed, date=date, replay=replay, **figures)
        place = self._rank(mode, entry)
        self._write()
        return place

    def _rank(self, mode: Mode, entry: Entry) -> int | None:
        if mode.ranking == "time" and not entry.won:
            return None
        best = self._best.setdefault(mode.name, [])
        key = _KEYS[mode.ranking]
        place = sum(key(other) <= key(entry) for other in best)  # of equals the earlier one leads
        best.insert(place, entry)
        del best[PLACES:]
        return place + 1 if place < PLACES else None

    # -- the file ----------------------------------------------------------------------

    def _read(self) -> None:
        known = self._best, self._totals
        (self._best, self._totals), self.trouble = load(self._path, _load, known)

    def _write(self) -> None:
        modes = {
            name: {
                "best": [dataclasses.asdict(entry) for entry in self._best.get(name, ())],
                "totals": dataclasses.asdict(totals),
            }
            for name, totals in self._totals.items()
        }
        text = json.dumps({"form": _FORM, "modes": modes}, indent=1)
        try:
            write_beside(self._path, text.encode("ascii"))
        except OSError as error:
            self.trouble = f"cannot write {self._path}: {error.strerror or error}"


def _load(path: Path) -> tuple[dict[str, list[Entry]], dict[str, Totals]]:
    """Read a file, every value checked.

    Raises:
        OSError: It cannot be read.
        ValueError: Something is not as we write it.
    """
    document = json.loads(read_bytes(path, _MOST_BYTES))
    if not isinstance(document, dict) or document.get("form") != _FORM:
        raise ValueError("not ours, or of another form")
    best: dict[str, list[Entry]] = {}
    totals: dict[str, Totals] = {}
    for name, mode in _dict(document.get("modes")).items():
        entries = _dict(mode).get("best")
        if not isinstance(entries, list) or len(entries) > PLACES:
            raise ValueError("no best list")
        best[name] = [_made(Entry, entry) for entry in entries]
        totals[name] = _made(Totals, _dict(mode).get("totals"))
    return best, totals


_Made = TypeVar("_Made", Entry, Totals)


def _made(kind: type[_Made], given: object) -> _Made:
    """Make a value class of a JSON object with exactly its fields, each of its type."""
    values, types = _dict(given), get_type_hints(kind)
    if values.keys() != types.keys():
        raise ValueError(f"not the fields of {kind.__name__}")
    checked: dict[str, Any] = {name: _value(types[name], values[name]) for name in types}
    return kind(**checked)


def _value(kind: object, given: object) -> object:
    if kind is bool and isinstance(given, bool):
        return given
    if kind is str and isinstance(given, str) and len(given) <= _MOST_WORD:
        return given
    if kind in (int, float) and _is_number(given, whole=kind is int):
        return given
    if kind == Mapping[str, int]:
        counts = _dict(given)
        if len(counts) <= _MOST_NAMES and all(_is_number(n, whole=True) for n in counts.values()):
            return counts
    raise ValueError(f"{given!r:.40} is not {kind}")


def _is_number(given: object, *, whole: bool) -> bool:
    if isinstance(given, bool) or not isinstance(given, int if whole else int | float):
        return False
    return math.isfinite(given) and 0 <= given <= _MOST_NUMBER


def _dict(given: object) -> dict[str, Any]:
    if not isinstance(given, dict):
        raise ValueError("no object")
    return given
