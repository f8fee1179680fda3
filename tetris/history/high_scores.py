"""Best lists and totals per mode, in one file that a crash cannot spoil.

The file is written beside the old one and renamed; one that cannot be read is put aside and
kept, and a sentence says so. Another program's additions are read before ours are written.
"""

import dataclasses
import json
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
    """One game of a best list."""

    score: int
    lines: int
    level: int
    pieces: int
    time_s: float
    commands: int
    faultless: int
    won: bool  # whether the goal was reached, or the time was over
    seed: int
    date: str = ""  # when it ended, as the caller writes dates
    replay: str = ""  # the name of its replay's file; "" for none

    @property
    def pieces_per_s(self) -> float:
        """Pieces a second; 0 for a game without time."""
        return self.pieces / self.time_s if self.time_s > 0 else 0.0


@dataclass(frozen=True, slots=True)
class Totals:
    """All games of a mode together."""

    games: int = 0
    won: int = 0
    time_s: float = 0.0
    pieces: int = 0
    lines: int = 0
    commands: int = 0
    faultless: int = 0
    clears: Mapping[str, int] = field(default_factory=dict)  # how often, by their names


@dataclass(slots=True)
class _Record:
    best: list[Entry] = field(default_factory=list)
    totals: Totals = field(default_factory=Totals)


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
        self._records: dict[str, _Record] = {}
        self._read()

    def best(self, mode: str) -> tuple[Entry, ...]:
        """Return a mode's best games, the best first, ten at most."""
        return tuple(self._records.get(mode, _Record()).best)

    def totals(self, mode: str) -> Totals:
        """Return all of a mode's games together."""
        return self._records.get(mode, _Record()).totals

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
        record = self._records.setdefault(mode.name, _Record())
        before = record.totals
        sums = {name: getattr(before, name) + getattr(summary, name) for name in _SUMMED}
        clears = dict(Counter(before.clears) + Counter(summary.clears))
        record.totals = Totals(before.games + 1, before.won + won, clears=clears, **sums)
        place = PLACES
        if won or mode.ranking != "time":
            figures = {name: getattr(summary, name) for name in ("score", "level", *_SUMMED)}
            entry = Entry(won=won, seed=seed, date=date, replay=replay, **figures)
            key = _KEYS[mode.ranking]
            place = sum(key(other) <= key(entry) for other in record.best)  # the earlier one leads
            record.best.insert(place, entry)
            del record.best[PLACES:]
        self._write()
        return place + 1 if place < PLACES else None

    # -- the file ----------------------------------------------------------------------

    def _read(self) -> None:
        self._records, self.trouble = load(self._path, _load, self._records)

    def _write(self) -> None:
        modes = {name: dataclasses.asdict(record) for name, record in self._records.items()}
        text = json.dumps({"form": _FORM, "modes": modes}, indent=1)
        try:
            write_beside(self._path, text.encode("ascii"))
        except OSError as error:
            self.trouble = f"cannot write {self._path}: {error.strerror or error}"


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
        return {
            name: _Record(
                [_made(Entry, given) for given in mode["best"]], _made(Totals, mode["totals"])
            )
            for name, mode in document["modes"].items()
        }
    except (TypeError, KeyError, AttributeError) as error:
        raise ValueError("no best lists") from error


_Made = TypeVar("_Made", Entry, Totals)


def _made(kind: type[_Made], given: dict[str, Any]) -> _Made:
    """Make a value of a JSON object with exactly its fields, each of its type."""
    for name, of_kind in get_type_hints(kind).items():
        if of_kind == Mapping[str, int]:
            if len(given[name]) > _MOST_NAMES:
                raise ValueError(f"{name} are more than {_MOST_NAMES}")
            for count in given[name].values():
                _check(name, int, count)
        else:
            _check(name, of_kind, given[name])
    return kind(**given)


def _check(name: str, kind: type, value: Any) -> None:
    if type(value) not in ((float, int) if kind is float else (kind,)):
        raise ValueError(f"{name} is {value!r:.40}")
    # No number is not a number or endless.
    if len(value) > _MOST_WORD if kind is str else not 0 <= value <= _MOST_NUMBER:
        raise ValueError(f"{name} is {value!r:.40}")
