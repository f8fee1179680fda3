"""Arrays of a table: CSV with a line for each frame, and a column for each taxel."""

import csv
import re
from collections import Counter
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.description import Description
from controller.recordings.recording import RecordingError
from controller.shared import files
from controller.shared.errors import reason

MAX_BYTES: Final = 64 << 20  # of a table; in memory it takes ten times as much
_DELIMITERS: Final = ",;\t"
_ANY: Final = "*?["  # in `frames`
_COLUMN_NUMBER: Final = re.compile(r"\d+")  # in the name of a column


def read(path: Path, description: Description) -> dict[str, NDArray[Any]]:
    """Return the described columns of a table as arrays; RecordingError with its line if unfit.

    Texts of the label column are numbered, and their names are the array LABEL_names; empty ones
    are unknown, -1.
    """
    try:
        lines = files.read_text(path, MAX_BYTES).rstrip().splitlines()
        head = lines[0] if lines else ""
        delimiter = max(_DELIMITERS, key=head.count)
        cells = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=delimiter)]
    except (OSError, csv.Error) as error:
        why = reason(error) if isinstance(error, OSError) else str(error)
        raise RecordingError(f"cannot read {path}: {why}; name a table of numbers") from None
    names, *rows = cells or [[]]
    return _Table(path, names, rows, decimal_comma=delimiter != ",").arrays(description)


class _Table:
    """The cells of a table."""

    def __init__(
        self, path: Path, names: list[str], rows: list[list[str]], *, decimal_comma: bool
    ) -> None:
        """Take the cells; RecordingError if they are no table."""
        self._path, self._comma = path, decimal_comma
        if twice := [name for name, times in Counter(names).items() if times > 1]:
            raise RecordingError(f"{path} has the column {twice[0]!r} twice; rename one")
        for line, row in enumerate(rows, 2):
            if len(row) != len(names):
                raise RecordingError(
                    f"{path}, line {line}: {len(row)} cells, the header has {len(names)}; "
                    "fill or remove the line"
                )
        if not rows:
            raise RecordingError(f"{path} has no line under its header; name a table with frames")
        self._cells = dict(zip(names, zip(*rows, strict=True), strict=True))

    def arrays(self, description: Description) -> dict[str, NDArray[Any]]:
        """Return the described columns; frames are (n, taxels)."""
        told = description
        others = [told.time, told.label, told.subject, *told.session, told.marks]
        found: dict[str, NDArray[Any]] = {told.frames: self._frames(told.frames)}
        for name in filter(None, others):
            cells = self._text(name)
            if name == told.time:
                found[name] = self._numbers(name)
            elif name == told.label and isinstance(told.label_names, str):
                words = np.char.replace(cells, " ", "_")
                names, numbers = np.unique(words, return_inverse=True)
                unknown = int(names[0] == "")  # which sorts first
                found[told.label_names], found[name] = names[unknown:], numbers - unknown
            elif name != told.marks and all(cell.lstrip("-").isdecimal() for cell in cells):
                found[name] = cells.astype(np.int64)
            else:
                found[name] = cells
        return found

    def _frames(self, pattern: str) -> NDArray[np.float64]:
        """Return the columns whose names match a pattern, (n, taxels), in order of their numbers.

        Names that differ by more than numbers are in the order of the table.
        """
        named = [name for name in self._cells if fnmatchcase(name, pattern)]
        if len({_COLUMN_NUMBER.sub("", name) for name in named}) == 1:
            named.sort(key=lambda name: [int(number) for number in _COLUMN_NUMBER.findall(name)])
        if not named or not set(pattern) & set(_ANY):
            raise RecordingError(
                f"{self._path} has {len(named)} columns like frames = {pattern!r}; expected is a "
                "pattern of all taxels, such as 'c*'"
            )
        return np.stack([self._numbers(name) for name in named], axis=1)

    def _text(self, name: str) -> NDArray[Any]:
        """Return the cells of a column as texts, (n,)."""
        if name not in self._cells:
            columns = ", ".join(list(self._cells)[:8])
            raise RecordingError(
                f"{self._path} has no column {name!r}, which the description names; "
                f"it has {columns}"
            )
        return np.array(self._cells[name])

    def _numbers(self, name: str) -> NDArray[np.float64]:
        """Return the cells of a column as finite numbers, (n,)."""
        found = np.empty(len(self._text(name)))
        for i, cell in enumerate(self._cells[name]):
            try:
                found[i] = float(cell.replace(",", ".") if self._comma else cell)
            except ValueError:
                found[i] = np.nan
            if not np.isfinite(found[i]):
                raise RecordingError(
                    f"{self._path}, line {i + 2}, column {name!r}: {cell!r} is no number; "
                    "fill it, or remove the line"
                )
        return found
