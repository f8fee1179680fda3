"""Windows of gestures with their users, for the user network."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from models.data.examples import Examples

AFTER: Final = 3  # frames behind a gesture whose windows still show it, as the device uses them
_APART: Final = 2  # frames: an unclear edge parts no gesture
Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Touched:
    """Gestures, and the windows that show them.

    Attributes:
        examples: Where the windows are from.
        ends: Last frame of each window, in order, (windows,).
        event: Which gesture each shows, from 0, (windows,).
        label: Class of each gesture, (events,).
        session: Recording of each gesture, (events,).
    """

    examples: Examples
    ends: Index
    event: Index
    label: Index
    session: Index

    @classmethod
    def of(cls, examples: Examples, labels: Iterable[int]) -> "Touched":
        """Return the gestures of these classes."""
        ends = examples.ends
        label = examples.label[ends]
        session = examples.session[ends].astype(np.int64)
        wanted = np.flatnonzero(np.isin(label, list(labels)))
        begins = np.ones(len(wanted), dtype=np.bool_)
        begins[1:] = (
            (np.diff(ends[wanted]) > _APART)
            | (np.diff(label[wanted]) != 0)
            | (np.diff(session[wanted]) != 0)
        )
        event = np.full(len(ends), -1, dtype=np.int64)
        event[wanted] = np.cumsum(begins) - 1
        first = wanted[begins]
        for _ in range(AFTER):  # the rest that follows belongs to it
            before = event[:-1]
            follows = (
                (event[1:] < 0) & (before >= 0) & (label[1:] == 0) & (np.diff(ends) == 1)
                & (session[1:] == session[:-1])
            )  # fmt: skip
            event[1:][follows] = before[follows]
        kept = np.flatnonzero(event >= 0)
        order = kept[np.argsort(event[kept], kind="stable")]
        return cls(examples, ends[order], event[order], label[first], session[first])

    def some(self, events: NDArray[np.bool_]) -> "Touched":
        """Return some of the gestures, numbered anew."""
        number = np.cumsum(events) - 1
        kept = events[self.event]
        return Touched(
            self.examples,
            self.ends[kept],
            number[self.event[kept]].astype(np.int64),
            self.label[events],
            self.session[events],
        )

    def longer(self, ends: Index, spare: int) -> NDArray[np.float32]:
        """Cut windows with some images before them; none from before the recording's first."""
        examples = self.examples
        start = np.flatnonzero(np.diff(examples.session, prepend=-1))
        first = start[np.searchsorted(start, ends, side="right") - 1]
        index = ends[:, None] + np.arange(1 - examples.window - spare, 1)
        cut: NDArray[np.float32] = examples.images[np.maximum(index, first[:, None])]
        return cut


def mean(values: NDArray[np.floating], event: Index, events: int) -> NDArray[np.float64]:
    """Return the mean of windows' values over each gesture, (events, ...)."""
    total = np.zeros((events, *values.shape[1:]))
    np.add.at(total, event, values)
    count = np.bincount(event, minlength=events)
    return np.asarray(total / np.maximum(count, 1)[:, None])
