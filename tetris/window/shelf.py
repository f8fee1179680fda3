"""Where finished games go: their replays as files, their figures into the best lists."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from tetris.replay import Replay
from tetris.replay_file import SUFFIX, save
from tetris.window.look import Look
from tetris.window.session import Session

_FOLDER: Final = "replays"
_MOST: Final = 500  # replays kept; a few kilobytes each


@dataclass(frozen=True, slots=True)
class Kept:
    """What became of a finished game.

    Attributes:
        place: Its place in the best list, from 1; None when it has none.
        notice: A sentence if it could not be kept, "" when all is well.
    """

    place: int | None = None
    notice: str = ""


class Shelf:
    """The player's finished games."""

    def __init__(self, folder: Path | None) -> None:
        """Keep them in a folder; None keeps nothing."""
        self._folder = folder

    def keep(self, session: Session) -> Kept:
        """Put a finished game on the shelf."""
        if self._folder is None:
            return Kept()
        replay = session.recorder.replay()
        try:
            save(_free(self._folder / _FOLDER, session.mode.name), replay)
        except OSError as error:
            return Kept(notice=f"cannot save the replay: {error.strerror}")
        return Kept()

    def replays(self) -> list[Path]:
        """Return the replays' files, the newest first."""
        if self._folder is None:
            return []
        return sorted((self._folder / _FOLDER).glob(f"*{SUFFIX}"), reverse=True)

    def exporter(self, replay: Replay, path: Path | None, look: Look) -> Callable[[], str] | None:
        """Return what saves a film of a replay and says where; None where that cannot be done."""
        return None


def _free(folder: Path, mode: str) -> Path:
    """Return a file's name that says when and what, and that no other file has."""
    now, number = f"{datetime.now():%Y-%m-%d_%H-%M-%S}", 1
    path = folder / f"{now}_{mode}{SUFFIX}"
    while path.exists():
        number += 1
        path = folder / f"{now}-{number}_{mode}{SUFFIX}"
    return path
