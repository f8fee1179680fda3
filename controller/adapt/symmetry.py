"""Guess of a gesture's symmetries from its examples.

Examples of a gesture that any direction suits differ among themselves as much as from a turned
one. So the turned (or mirrored) examples belong to the gesture if each is about as near to another
example as the examples are to each other.
"""

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.adapt.examples import Example, between

LEAST: Final = 3  # examples of which anything can be said
MOMENTS: Final = 4  # of a touch that are compared, evenly between its beginning and end
LIKE: Final = 1.6  # times the usual distance: farther away it is another gesture
CLOSE: Final = 0.6  # distance of what is the same in any case; that of nothing in common is 1.4

Shape = NDArray[np.float64]  # (examples, MOMENTS, rows, columns), each of length 1
Turn = tuple[int, bool]  # quarter turns, and whether it is mirrored before


def guess(examples: Sequence[Example]) -> tuple[str, bool]:
    """Return the rotations, as in `Example`, and whether the mirror image is the same gesture.

    Args:
        examples: Of one gesture and grid, with their spans; fewer than `LEAST` give "none", False.
    """
    if len(examples) < LEAST:
        return "none", False
    shapes = np.stack([_shape(one) for one in examples])
    turns, rotations = [0], "none"
    if _same(shapes, [(0, False)], [(2, False)]):
        turns, rotations = [0, 2], "half"
        quarters = [(1, False), (3, False)]
        if shapes.shape[2] == shapes.shape[3] and _same(shapes, [(0, False), (2, False)], quarters):
            turns, rotations = [0, 1, 2, 3], "all"
    mirrored = _same(shapes, [(k, False) for k in turns], [(k, True) for k in turns])
    return rotations, mirrored


def _same(shapes: Shape, known: Iterable[Turn], other: Iterable[Turn]) -> bool:
    """Return whether examples turned otherwise are as near to others as in the known turns."""
    return _distance(shapes, other) <= max(CLOSE, LIKE * _distance(shapes, known))


def _distance(shapes: Shape, turns: Iterable[Turn]) -> float:
    """Return the mean distance of each example, turned, to the nearest other one."""
    flat = shapes.reshape(len(shapes), -1)
    nearest = np.full(len(shapes), np.inf)
    for quarters, mirrored in turns:
        turned = np.rot90(shapes[..., ::-1] if mirrored else shapes, quarters, (2, 3))
        alike = turned.reshape(flat.shape) @ flat.T
        np.fill_diagonal(alike, -np.inf)
        nearest = np.minimum(nearest, np.sqrt(np.maximum(0.0, 2.0 - 2.0 * alike.max(axis=1))))
    return float(nearest.mean())


def _shape(example: Example) -> Shape:
    """Return an example's images at some moments of its touch, of length 1 together."""
    assert example.span is not None
    at = np.linspace(*example.span, MOMENTS + 2)[1:-1]
    last = len(example.images) - 1.001
    images = between(example.images, np.clip(at, 0.0, last)).astype(np.float64) - 1.0
    return np.asarray(images / max(1e-9, float(np.linalg.norm(images))))
