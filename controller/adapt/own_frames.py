"""Windows of those who teach, outside of the examples: rehearsed, and some judge lessons."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.bundles.head import Head, Matrix
from controller.shared import npz

SHARE: Final = 0.3  # weight of these windows together, relative to all rehearsal data
MOST: Final = 1500  # windows in a bundle
JUDGED: Final = 3  # of so many stretches of a label one judges, and is not learned from
_LEVELS: Final = 255.0


@dataclass(frozen=True, slots=True, eq=False)
class OwnFrames:
    """Windows of the people who taught, with labels, outside of the examples."""

    embedding: Matrix  # (n, width)
    touch: NDArray[np.int32]  # number of the labelled stretch that each shows, (n,)
    label: NDArray[np.str_]  # (n,)

    @classmethod
    def none(cls, width: int) -> "OwnFrames":
        """Return no windows."""
        empty = np.empty(0, dtype=np.int32)
        return cls(np.empty((0, width), dtype=np.float32), empty, empty.astype("U40"))

    def joined(self, other: "OwnFrames") -> "OwnFrames":
        """Return the windows of both."""
        touch = np.concatenate([self.touch, other.touch + 1 + self.touch.max(initial=-1)])
        return OwnFrames(
            np.concatenate([self.embedding, other.embedding]),
            touch.astype(np.int32),
            np.concatenate([self.label, other.label]),
        )

    def thinned(self) -> "OwnFrames":
        """Return `MOST` of the windows at most, evenly chosen."""
        some = slice(None, None, max(1, -(-len(self.touch) // MOST)))
        return OwnFrames(self.embedding[some], self.touch[some], self.label[some])

    def arrays(self) -> npz.Arrays:
        """Return the arrays of the part `taught.npz`."""
        if not len(self.touch):
            return {}
        steps, scale = quantised(self.embedding)
        named: npz.Arrays = {"own_touch": self.touch, "own_label": self.label}
        return {"own_embedding": steps, "own_scale": scale, **named}

    def split(self, labels: Sequence[str]) -> "tuple[OwnWindows, OwnWindows]":
        """Return the windows that are learned from, and those that judge."""
        of = {label: kind for kind, label in enumerate(labels)}
        kinds = np.array([of.get(str(label), -1) for label in self.label], dtype=np.int64)
        judges = np.zeros(len(kinds), dtype=np.bool_)
        for kind in of.values():
            stretches = np.unique(self.touch[kinds == kind])
            judges |= np.isin(self.touch, stretches[JUDGED - 1 :: JUDGED])
        learned, judging = (
            np.flatnonzero((kinds >= 0) & (judges == judge)) for judge in (False, True)
        )
        return OwnWindows(learned, kinds[learned]), OwnWindows(judging, kinds[judging])


class OwnWindows(NamedTuple):
    """Some windows of the teacher, outside of the examples."""

    windows: NDArray[np.int64]  # (n,)
    kinds: NDArray[np.int64]  # their classes, (n,)

    def weights(self) -> NDArray[np.float64]:
        """Return the weight of each window, (n,); each class has the same."""
        count = np.bincount(self.kinds)
        return SHARE / max(1, int(np.count_nonzero(count))) / count[self.kinds]

    def kept(self, embedding: Matrix, before: Head, after: Head) -> float:
        """Return the share of right classes relative to that before, mean of classes, at most 1."""
        old = self.kinds < len(before.out)
        kinds, seen = self.kinds[old], embedding[self.windows[old]]
        if not len(kinds):
            return 1.0
        right = (head.logits(seen).argmax(axis=1) == kinds for head in (before, after))
        count = np.bincount(kinds)
        first, then = (np.bincount(kinds, one)[count > 0] / count[count > 0] for one in right)
        return min(1.0, float(then.mean() / max(first.mean(), 1e-9)))


def quantised(embedding: Matrix) -> tuple[NDArray[np.uint8], Matrix]:
    """Return embeddings (n, width) as bytes, and the scale of each number, (width,)."""
    scale = np.maximum(embedding.max(axis=0), 1e-6) / np.float32(_LEVELS)
    return np.clip(np.rint(embedding / scale), 0.0, _LEVELS).astype(np.uint8), scale
