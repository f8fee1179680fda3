"""Output files of a recording run: one after the other, never replacing existing files."""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Final

from controller.recordings import journal_file, writer
from controller.recordings.journal_file import LockedError
from controller.recordings.recorder import (
    Recorder,
    TakenError,
    refuse_taken,
    refuse_unwritable,
    taken,
)
from controller.recordings.recording import RecordingError

ANONYMOUS: Final = "unknown"  # the user in the names of files, if not given

_log = logging.getLogger("controller")


class RunFiles:
    """The files of one run: a new one for each session, and when one is full."""

    def __init__(self, place: Path, user: str, session: str) -> None:
        """Prepare the files, and recover journals of a crash.

        Args:
            place: A file to write, or a folder of files named by user and session.
            user: ID of the user; "" unknown.
            session: ID of the session.

        Raises:
            RecordingError: Nothing can be recorded there.
        """
        self._place, self._user, self._session = place, user or ANONYMOUS, session
        self._begun = False
        self._named = place.suffix == writer.SEALED and not place.is_dir()
        folder = place.parent if self._named else place
        if not self._named and not place.is_dir():
            raise RecordingError(
                f"there is no folder {place}; make it, or name a file that ends in {writer.SEALED}"
            )
        writer.next_free(folder, self._user, session)  # checks the names
        recover(folder)
        refuse_unwritable(folder)
        if self._named:
            refuse_taken(place)

    def begin(self, record: Callable[[Path], Recorder]) -> Recorder:
        """Return a recorder into the next free file, again if another program takes that file.

        Raises:
            RecordingError: It cannot be written.
        """
        path = self.next()
        while True:
            try:
                recorder = record(path)
            except TakenError:
                before, path = path, self.next()
                if path == before:
                    raise
            else:
                self._begun = True
                return recorder

    def next(self) -> Path:
        """Return the next free file; another program may take it meanwhile."""
        if not self._named:
            return writer.next_free(self._place, self._user, self._session)
        if not self._begun:
            return self._place  # the first file has exactly the given name
        return next(path for path in writer.alternatives(self._place) if not taken(path))


def recover(folder: Path) -> None:
    """Recover the journals that crashes left in a folder, and log it; errors are logged only."""
    for journal in journal_file.leftovers(folder):
        try:
            _log.info("%s", journal_file.recover(journal).line)
        except LockedError:
            continue
        except RecordingError as error:
            _log.warning("%s", error)
