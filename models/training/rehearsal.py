"""Rehearsal of a bundle: embeddings of windows of its training, for lessons on the device.

As many touches of each gesture are taken, some windows of each, and windows of rest: half of them
next to these touches, where what begins a gesture is still none, the others at random.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.adapt.lessons import Rehearsal, to_bytes
from controller.bundles.inference import onnxruntime_engine
from controller.shared.aliases import Index
from models.data.examples import Examples

WINDOWS: Final = 2500  # of a bundle, about: some 90 kB
TOUCHED: Final = 0.45  # share of them that show a gesture
EACH: Final = 6  # windows of a touch
NEAR_S: Final = 1.0  # of a touch: windows of rest that count as next to it
_AT_ONCE: Final = 256  # windows that are embedded together


def of(model: bytes, examples: Examples, ends: Index, classes: int, seed: int) -> bytes:
    """Return the part of a bundle with an embedding network; windows end at frames `ends`."""
    chosen, touch = choose(examples, ends, classes, np.random.default_rng((seed, 6)))
    network = onnxruntime_engine.network(model)
    cuts = np.array_split(chosen, -(-len(chosen) // _AT_ONCE))
    embedding = np.concatenate([network(examples.windows(cut)) for cut in cuts])
    firmest = [_firmest(examples, chosen, touch, kind) for kind in range(classes)]
    return Rehearsal(embedding, touch, to_bytes(np.array(firmest))).pack()


def choose(
    examples: Examples, ends: Index, classes: int, rng: np.random.Generator
) -> tuple[Index, NDArray[np.int32]]:
    """Return last frames of some windows, and the number of each one's touch, -1 without, (n,)."""
    ends = np.sort(ends[examples.label[ends] < classes])
    label = examples.label[ends]
    first = np.flatnonzero(examples.begins(ends, gap=1))
    runs = np.split(ends, first[1:])
    kinds = label[first]
    share = round(TOUCHED * WINDOWS / EACH / max(1, len(set(kinds[kinds > 0].tolist()))))
    touches = [
        runs[number][np.linspace(0, len(runs[number]) - 1, EACH).round().astype(int)]
        for kind in range(1, classes)
        for number in rng.permutation(np.flatnonzero(kinds == kind))[:share]
    ]
    touches = [np.unique(touch) for touch in touches]
    shown = np.concatenate([np.empty(0, dtype=np.int64), *touches])
    rest, most = ends[label == 0], round(len(shown) * (1.0 - TOUCHED) / TOUCHED)
    after = np.append(np.sort(shown), np.iinfo(np.int64).max)
    at = np.searchsorted(after, rest)
    gap = np.minimum(after[at] - rest, rest - np.append(0, np.sort(shown))[at])
    near = rng.permutation(rest[gap <= NEAR_S * examples.rate_hz])[: most // 2]
    other = rng.permutation(np.setdiff1d(rest, near))[: most - len(near)]
    number = np.repeat(np.arange(len(touches)), [len(touch) for touch in touches])
    none = np.full(len(near) + len(other), -1)
    return np.concatenate([shown, near, other]), np.concatenate([number, none]).astype(np.int32)


def _firmest(
    examples: Examples, ends: Index, touch: NDArray[np.int32], kind: int
) -> NDArray[np.float32]:
    """Return the mean image of a gesture's touches at their firmest, z, (rows, columns)."""
    own = (examples.label[ends] == kind) & (touch >= 0)
    images, number = examples.images[ends[own]], touch[own]
    if not kind or not own.any():
        return np.ones(examples.images.shape[1:], dtype=np.float32)
    force = np.abs(images - 1.0).mean(axis=(1, 2))
    order = np.lexsort((force, number))
    last = np.append(np.flatnonzero(np.diff(number[order])), len(order) - 1)
    return np.asarray(images[order[last]].mean(axis=0), dtype=np.float32)
