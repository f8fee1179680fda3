"""Frames that stand twice: in one recording, or in two of a set."""

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.recording import Recording

RUN: Final = 10  # so many equal frames in a row are no accident, wherever they stand
_CHUNK: Final = 1024  # frames at once; bounds memory
_SEED: Final = 20_160_101  # of the numbers that tell frames apart; any will do


def repeated(recording: Recording, touched: NDArray[np.bool_]) -> int:
    """Return how many frames are the one before once more, bit for bit.

    A sensor that reads whole counts may well repeat itself while nothing touches it, so only
    touched frames count.
    """
    frames = recording.frames
    same = (frames[1:] == frames[:-1]).all(axis=(1, 2))
    return int((same & touched[1:]).sum())


@dataclass
class FrameIndex:
    """Which runs of frames were seen in which recordings; eight bytes a frame."""

    _prints: list[NDArray[np.uint64]] = field(default_factory=list)

    def add(self, recording: Recording) -> None:
        """Take the next recording; they are numbered from 0."""
        self._prints.append(_prints(recording.frames))

    def shared(self) -> dict[int, dict[int, int]]:
        """Return, for each recording that shares frames: with which, and about how many."""
        if not self._prints:
            return {}
        prints = np.concatenate(self._prints)
        owner = np.repeat(np.arange(len(self._prints)), [len(own) for own in self._prints])
        order = np.argsort(prints, kind="stable")
        prints, owner = prints[order], owner[order]
        edges = np.flatnonzero(np.diff(prints)) + 1
        pairs: Counter[tuple[int, int]] = Counter()
        bounds = zip([0, *edges.tolist()], [*edges.tolist(), len(prints)], strict=True)
        for first, end in ((first, end) for first, end in bounds if end - first > 1):
            earliest, *others = sorted(set(owner[first:end].tolist()))
            pairs.update(pair for b in others for pair in ((earliest, b), (b, earliest)))
        found: dict[int, dict[int, int]] = defaultdict(dict)
        for (a, b), runs in sorted(pairs.items()):
            found[a][b] = runs + RUN - 1
        return dict(found)


def _prints(frames: NDArray[np.float32]) -> NDArray[np.uint64]:
    """Return one number for every run of `RUN` frames, but for runs in which nothing changes."""
    count = len(frames) - RUN + 1
    if count < 1:
        return np.empty(0, dtype=np.uint64)
    rng = np.random.default_rng(_SEED)
    bits = np.ascontiguousarray(frames).reshape(len(frames), -1).view(np.uint32)
    taxels, places = _odd(rng, bits.shape[1]), _odd(rng, RUN)
    each = np.empty(len(bits), dtype=np.uint64)
    for first in range(0, len(bits), _CHUNK):
        part = slice(first, first + _CHUNK)
        each[part] = (bits[part] * taxels).sum(axis=1, dtype=np.uint64)  # modulo 2**64, as it shall
    each ^= each >> np.uint64(32)
    runs = np.lib.stride_tricks.sliding_window_view(each, RUN)
    changing = (runs != runs[:, :1]).any(axis=1)
    return np.asarray((runs * places).sum(axis=1, dtype=np.uint64)[changing])


def _odd(rng: np.random.Generator, count: int) -> NDArray[np.uint64]:
    return rng.integers(0, 2**63, count, dtype=np.uint64) * np.uint64(2) + np.uint64(1)
