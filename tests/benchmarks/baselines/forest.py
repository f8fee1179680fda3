"""A random forest as plain arrays: trained by scikit-learn, kept and asked without it.

Trees are kept as tables of nodes, never pickled.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

AT_ONCE: Final = 4096  # rows that walk down the trees together


@dataclass(frozen=True, slots=True, eq=False)
class Forest:
    """Trees side by side, as long as the largest of them; node 0 is the root."""

    # next node where the feature is not above the threshold, (trees, nodes); a leaf leads to itself
    left: NDArray[np.int32]
    right: NDArray[np.int32]  # next node otherwise
    feature: NDArray[np.int32]  # which feature is asked for
    threshold: NDArray[np.float32]  # what it is compared with
    value: NDArray[np.float32]  # what a node answers, (trees, nodes, outputs)
    depth: int  # steps after which every row is at a leaf

    @classmethod
    def of(cls, trained: Any) -> "Forest":
        """Return a forest of scikit-learn's, classifier or regressor, as arrays."""
        trees = [estimator.tree_ for estimator in trained.estimators_]
        nodes = max(tree.node_count for tree in trees)
        outputs = trees[0].value.shape[2 if hasattr(trained, "classes_") else 1]
        itself = np.tile(np.arange(nodes, dtype=np.int32), (len(trees), 1))
        left, right = itself.copy(), itself.copy()
        feature = np.zeros((len(trees), nodes), dtype=np.int32)
        threshold = np.zeros((len(trees), nodes), dtype=np.float32)
        value = np.zeros((len(trees), nodes, outputs), dtype=np.float32)
        for number, tree in enumerate(trees):
            own, inner = slice(0, tree.node_count), np.flatnonzero(tree.children_left >= 0)
            left[number, inner] = tree.children_left[inner]
            right[number, inner] = tree.children_right[inner]
            feature[number, inner] = tree.feature[inner]
            # Values are compared as float32, so the threshold is the next one below or equal.
            limit = tree.threshold[inner].astype(np.float32)
            over = limit.astype(np.float64) > tree.threshold[inner]
            limit[over] = np.nextafter(limit[over], np.float32(-np.inf))
            threshold[number, inner] = limit
            value[number, own] = tree.value.reshape(tree.node_count, outputs)
        if hasattr(trained, "classes_"):
            value /= np.maximum(value.sum(axis=2, keepdims=True), 1e-12)
        return cls(left, right, feature, threshold, value, max(t.max_depth for t in trees))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return it as arrays by name."""
        return {field.name: np.asarray(getattr(self, field.name)) for field in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> "Forest":
        """Return what `arrays` returned as a forest."""
        tables = {name: array for name, array in arrays.items() if name != "depth"}
        return cls(**tables, depth=int(arrays["depth"]))

    def __call__(self, rows: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the mean answer of the trees to each row, (rows, outputs)."""
        answers = np.zeros((len(rows), self.value.shape[2]), dtype=np.float64)
        for start in range(0, len(rows), AT_ONCE):
            some = rows[start : start + AT_ONCE]
            line = np.arange(len(some))
            for tree in range(len(self.left)):
                node = np.zeros(len(some), dtype=np.int32)
                for _ in range(self.depth):
                    up = some[line, self.feature[tree, node]] > self.threshold[tree, node]
                    following = np.where(up, self.right[tree, node], self.left[tree, node])
                    if (following == node).all():
                        break
                    node = following
                answers[start : start + AT_ONCE] += self.value[tree, node]
        return np.asarray(answers / len(self.left), dtype=np.float32)
