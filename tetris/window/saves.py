"""Saved games: replays as files, figures in the best lists."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Final

from tetris.engine.game import Finish, Phase
from tetris.history.high_scores import Entry, HighScores
from tetris.history.replay_file import SUFFIX, ReplayError, save
from tetris.window.game_session import Session

_FOLDER: Final = "replays"
_FILMS: Final = "films"
_MOST: Final = 1000  # replays kept; a few kilobytes each
_LEAST_PIECES: Final = 10  # of a game that was left, for its replay to be kept


@dataclass(frozen=True, slots=True)
class SavedGame:
    """Result of saving a game.

    Attributes:
        place: Its place in the best list, from 1; None when it has none.
        notice: A sentence if it could not be kept, "" when all is well.
    """

    place: int | None = None
    notice: str = ""


class Saves:
    """The player's games."""

    def __init__(self, folder: Path | None) -> None:
        """Keep them in a folder; None keeps nothing."""
        self._folder = folder
        self._records = None if folder is None else HighScores(folder)

    def keep(self, session: Session) -> SavedGame:
        """Put a game on the store that is over; or one that was left, as far as it went.

        A game that was left has no place, unless it is of a mode that has no end of its own.
        """
        game, mode = session.game, session.mode
        if self._folder is None or self._records is None:
            return SavedGame()
        over = game.phase is Phase.OVER
        if not over and game.pieces_placed < _LEAST_PIECES:
            return SavedGame()
        path = _free(self._folder / _FOLDER, mode.name, SUFFIX)
        notice = ""
        try:
            save(path, session.recorder.replay())
            _forget(self.replays()[_MOST:])
        except OSError as error:
            notice = f"cannot save the replay: {error.strerror or error}"
        except ReplayError as error:
            notice = str(error)
        if not session.ranked or not (over or not game.config.gravity):
            return SavedGame(notice=notice)
        place = self._records.add(
            mode,
            session.summary,
            won=isinstance(game.result, Finish),
            seed=session.recorder.seed,
            date=f"{datetime.now():%Y-%m-%d %H:%M}",
            replay="" if notice else path.name,
        )
        return SavedGame(place, notice or self._records.trouble)

    def best(self, mode: str) -> tuple[Entry, ...]:
        """Return a mode's best games, the best first."""
        return self._records.best(mode) if self._records else ()

    @property
    def trouble(self) -> str:
        """A sentence if the best lists could not be read, "" when all is well."""
        return self._records.trouble if self._records else ""

    def film_namer(self, mode: str) -> Callable[[str], Path] | None:
        """Return what names a new film's file by its suffix; None where nothing is kept."""
        if self._folder is None:
            return None
        return partial(_free, self._folder / _FILMS, mode or "game")

    def replays(self) -> list[Path]:
        """Return the replays' files, the newest first."""
        if self._folder is None:
            return []
        return sorted((self._folder / _FOLDER).glob(f"*{SUFFIX}"), reverse=True)


def _free(folder: Path, mode: str, suffix: str) -> Path:
    """Return a file's name with date and mode, which no other file has."""
    now = f"{datetime.now():%Y-%m-%d_%H-%M-%S}"
    number, path = 1, folder / f"{now}_{mode}{suffix}"
    while path.exists():
        number += 1
        path = folder / f"{now}-{number}_{mode}{suffix}"
    return path


def _forget(paths: Iterable[Path]) -> None:
    for path in paths:
        path.unlink(missing_ok=True)
