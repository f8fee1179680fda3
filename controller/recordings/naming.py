"""Names of recordings: `sub-ID_ses-DATE_run-NN.npz`, by the BIDS standard.

The journal of an unsealed recording has the same name, so that name counts as taken.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from controller.recordings.recording import RecordingError

SEALED: Final = ".npz"
JOURNAL: Final = ".journal"
DAMAGED: Final = ".damaged"  # appended to the name of a damaged journal
LONGEST: Final = 64  # characters of an ID: three parts fit the 255 of file systems
_RUN: Final = re.compile(r"(.*_run-)(\d{1,9})")


def first(user: str, session: str) -> str:
    """Return the name of a session's first run, without its suffix."""
    return f"{_stem(user, session)}01"


def next_free(folder: Path, user: str, session: str) -> Path:
    """Return the file of the next run: after every recording and journal of this session.

    Raises:
        RecordingError: The user or the session has anything but letters and digits in its name.
    """
    for what, name in (("user", user), ("session", session)):
        if not (name.isascii() and name.isalnum() and len(name) <= LONGEST):
            raise RecordingError(
                f"the {what} {name!r} names files, so it must be 1 to {LONGEST} letters (a to z) "
                "and digits; choose another"
            )
    stem = _stem(user, session)
    runs = [0]
    for path in folder.iterdir() if folder.is_dir() else ():
        match = _RUN.match(path.name.lower())  # some file systems ignore case
        if match and match[1] == stem.lower():
            runs.append(int(match[2]))
    return folder / f"{stem}{max(runs) + 1:02d}{SEALED}"


def _stem(user: str, session: str) -> str:
    return f"sub-{user}_ses-{session}_run-"


def alternatives(path: Path) -> Iterator[Path]:
    """Yield `path`, then an infinite sequence of names after it: run-02, run-03 or x-2, x-3."""
    yield path
    run = _RUN.fullmatch(path.stem)
    stem, first = (run[1], int(run[2]) + 1) if run else (f"{path.stem}-", 2)
    width = len(run[2]) if run else 1
    while True:
        yield path.with_name(f"{stem}{first:0{width}d}{path.suffix}")
        first += 1


def journal_of(path: Path) -> Path:
    """Return the path of a recording's journal."""
    return path.with_name((path.stem if path.suffix == SEALED else path.name) + JOURNAL)
