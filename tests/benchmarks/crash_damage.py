"""Journals as a bad disk or a power cut leaves them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from controller.recordings import journal as journals
from controller.recordings.journal import Kind
from controller.recordings.recorder import SYNC_S

from .crash_lives import RATE_HZ

BLOCK: Final = 4096  # bytes; a disk loses or keeps a block in one piece


@dataclass(frozen=True)
class Left:
    """A journal that a killed process left, and how it stood before the last sync."""

    seed: int  # of its frames
    data: bytes  # all of it
    frames: tuple[tuple[int, int], ...]  # (number, end) of each frame
    confirmed: int  # all before this offset was on the disk then; the rest was being synced

    def last(self, cut: int) -> int:
        """Return the number of the last frame that is whole before an offset."""
        return max((number for number, end in self.frames if end <= cut), default=0)


def left(seed: int, data: bytes) -> Left:
    """Return a journal that nothing has damaged; its last sync took what came in `SYNC_S`."""
    ends = [end for kind, _, end in journals._records(data) if kind == Kind.FRAME]
    return Left(seed, data, tuple(enumerate(ends, 1)), ends[-round(SYNC_S * RATE_HZ) - 1])


Damage = Callable[[Left, np.random.Generator, bytes], tuple[bytes, int]]  # content, whole until


def cut(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """Cut anywhere."""
    place = int(rng.integers(len(journal.data)))
    return journal.data[:place], place


def flip(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """Flip a few bits anywhere; what follows the first of them is not read."""
    content = bytearray(journal.data)
    places = rng.integers(len(content), size=rng.integers(1, 9)).tolist()
    for place in places:
        content[place] ^= 1 << int(rng.integers(8))
    return bytes(content), min(places)


def truncate(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """Cut at the last offset that was confirmed."""
    return journal.data[: journal.confirmed], len(journal.data)


def lose(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """Lose some of the blocks that were not confirmed."""
    return _blocks(journal, lambda k, block: block if rng.random() < 0.5 else bytes(len(block)))


def stale(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """See what another journal left in some of the blocks that were not confirmed."""
    old = other * (len(journal.data) // len(other) + 1)
    return _blocks(
        journal, lambda k, block: block if rng.random() < 0.5 else old[k : k + len(block)]
    )


def reorder(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """See the blocks that were not confirmed in another order."""
    start = -(-journal.confirmed // BLOCK) * BLOCK  # the one before is confirmed in part
    data = journal.data
    tail = [data[k : k + BLOCK] for k in range(start, len(data), BLOCK)]
    return data[:start] + b"".join(tail[k] for k in rng.permutation(len(tail))), len(data)


def _blocks(journal: Left, become: Callable[[int, bytes], bytes]) -> tuple[bytes, int]:
    """Return a journal whose unconfirmed blocks have become something else."""
    data = journal.data
    content = data[: journal.confirmed]
    while len(content) < len(data):
        start = len(content)
        content += become(start, data[start : start // BLOCK * BLOCK + BLOCK])
    return content, len(data)


DAMAGES: Final[dict[str, Damage]] = {
    "cut anywhere": cut,
    "bits flipped": flip,
    "cut where synced": truncate,
    "unsynced blocks missing": lose,
    "unsynced blocks stale": stale,
    "unsynced blocks reordered": reorder,
}
