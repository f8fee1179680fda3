"""Best lists per mode, in one file that a crash cannot spoil.

The file is written beside the old one and renamed; one that cannot be read is put aside and
kept, and a sentence says so. Another program's additions are read before ours are written.
"""

import dataclasses
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, get_type_hints

from tetris.engine.modes import Mode, Ranking
from tetris.files import load, read_bytes, write_beside
from tetris.history.stats import Summary

FILE_NAME: Final = "records.json"
PLACES: Final = 10
_FORM: Final = 1
_FIGURES: Final = ("score", "lines", "level", "pieces", "time_s", "commands", "faultless")
_MOST_BYTES: Final = 4_000_000
_MOST_NUMBER: Final = 2**64
_MOST_WORD: Final = 100


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


_TYPES: Final = get_type_hints(Entry)
_KEYS: Final[Mapping[Ranking, Callable[[Entry], float]]] = {
    "score": lambda entry: -entry.score,
    "lines": lambda entry: -entry.lines,
    "time": lambda entry: entry.time_s,
}


class HighScores:
    """The best lists of one player.

    Attributes:
        trouble: A sentence about the last reading or writing that went wrong; "" if none did.
    """

    def __init__(self, folder: Path) -> None:
        """Read them; a folder or a file that is not there yet is no trouble."""
        self._path = folder / FILE_NAME
        self.trouble = ""
        self._best: dict[str, list[Entry]] = {}
        self._read()

    def best(self, mode: str) -> tuple[Entry, ...]:
        """Return a mode's best games, the best first, ten at most."""
        return tuple(self._best.get(mode, ()))

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
        if mode.ranking == "time" and not won:
            return None
        self._read()
        figures = {name: getattr(summary, name) for name in _FIGURES}
        entry = Entry(won=won, seed=seed, date=date, replay=replay, **figures)
        best = self._best.setdefault(mode.name, [])
        key = _KEYS[mode.ranking]
        place = sum(key(other) <= key(entry) for other in best)  # of equals the earlier one leads
        best.insert(place, entry)
        del best[PLACES:]
        self._write()
        return place + 1 if place < PLACES else None

    # -- the file ----------------------------------------------------------------------

    def _read(self) -> None:
        self._best, self.trouble = load(self._path, _load, self._best)

    def _write(self) -> None:
        modes = {
            name: {"best": [dataclasses.asdict(entry) for entry in best]}
            for name, best in self._best.items()
        }
        text = json.dumps({"form": _FORM, "modes": modes}, indent=1)
        try:
            write_beside(self._path, text.encode("ascii"))
        except OSError as error:
            self.trouble = f"cannot write {self._path}: {error.strerror or error}"


def _load(path: Path) -> dict[str, list[Entry]]:
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
            name: [_entry(given) for given in mode["best"]]
            for name, mode in document["modes"].items()
        }
    except (TypeError, KeyError, AttributeError) as error:
        raise ValueError("no best lists") from error


def _entry(given: dict[str, Any]) -> Entry:
    """Make an entry of a JSON object with exactly its fields, each of its type."""
    for name, kind in _TYPES.items():
        value = given[name]
        if type(value) is not kind and (kind is not float or type(value) is not int):
            raise ValueError(f"{name} is {value!r:.40}")
        # No number is not a number or endless.
        if len(value) > _MOST_WORD if kind is str else not 0 <= value <= _MOST_NUMBER:
            raise ValueError(f"{name} is {value!r:.40}")
    return Entry(**given)
