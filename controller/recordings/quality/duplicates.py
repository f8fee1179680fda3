"""Duplicate frames: within one recording, or in two of a set."""

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.recording import Recording

RUN: Final = 10  # consecutive frames; equal runs of this length are copies


def repeated(recording: Recording, touched: NDArray[np.bool_]) -> int:
    """Return the number of touched frames equal to the one before, bit for bit.

    Untouched frames are not counted: a sensor of whole counts may repeat a reading at rest.

    Args:
        recording: n frames.
        touched: Whether each frame is touched, (n,).
    """
    frames = recording.frames
    same = (frames[1:] == frames[:-1]).all(axis=(1, 2))
    return int((same & touched[1:]).sum())


@dataclass
class FrameIndex:
    """Index of the runs of frames in a set of recordings."""

    _count: int = 0
    _first: dict[int, int] = field(default_factory=dict)  # run, the first recording that has it
    _pairs: Counter[tuple[int, int]] = field(default_factory=Counter)  # runs that two share

    def add(self, recording: Recording) -> None:
        """Add the next recording; they are numbered from 0."""
        for run in _runs(recording.frames):
            first = self._first.setdefault(run, self._count)
            if first != self._count:
                self._pairs[first, self._count] += 1
        self._count += 1

    def shared(self) -> dict[int, dict[int, int]]:
        """Return the approximate numbers of shared frames, by pairs of recordings."""
        found: dict[int, dict[int, int]] = defaultdict(dict)
        for (a, b), runs in sorted(self._pairs.items()):
            found[a][b] = found[b][a] = runs + RUN - 1
        return dict(found)


def _runs(frames: NDArray[np.float32]) -> set[int]:
    """Return a hash of every run of `RUN` frames, (n, rows, columns), in which one changes."""
    hashes = [hash(frame.tobytes()) for frame in frames]
    runs = (tuple(hashes[i : i + RUN]) for i in range(len(hashes) - RUN + 1))
    return {hash(run) for run in runs if len(set(run)) > 1}
