"""Heads of a bundle: arrays that make probabilities of gestures from embeddings of windows.

    head.npz     the head as it was trained
    taught.npz   rows that were taught, of all users and of single ones; a bundle may lack it

A head is two dense layers, with relu and softmax. Taught rows are units beside those of its hidden
layer, and classes below those of its output; no trained number changes.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.container import arrays_of, check_arrays
from controller.shared import npz

EVERYBODY: Final = ""  # the user of what is for all users
_ROWS: Final = "rows-"  # before a user's name: arrays of taught rows

Matrix = NDArray[np.float32]  # (rows, columns), or a vector (n,)


@dataclass(frozen=True, slots=True, eq=False)
class Head:
    """Two dense layers from an embedding to logits, or rows to add to such."""

    hidden: Matrix  # (units, width)
    hidden_bias: Matrix  # (units,)
    out: Matrix  # (classes, units)
    out_bias: Matrix  # (classes,)

    def logits(self, embedding: Matrix) -> Matrix:
        """Return the logits, (n, classes), of embeddings (n, width)."""
        hidden = np.maximum(embedding @ self.hidden.T + self.hidden_bias, 0.0)
        return np.asarray(hidden @ self.out.T + self.out_bias, dtype=np.float32)

    def probabilities(self, embedding: Matrix) -> Matrix:
        """Return the probability of each class, (n, classes), for embeddings (n, width)."""
        return softmax(self.logits(embedding))

    def extended(self, rows: "Head") -> "Head":
        """Return the head whose logits are the sum of both; rows may have further classes."""
        units, classes = len(self.hidden), len(self.out)
        out = np.concatenate([np.zeros((len(rows.out), units), np.float32), rows.out], axis=1)
        out[:classes, :units] = self.out
        bias = rows.out_bias.copy()
        bias[:classes] += self.out_bias
        return Head(
            np.concatenate([self.hidden, rows.hidden]),
            np.concatenate([self.hidden_bias, rows.hidden_bias]),
            out,
            bias,
        )

    def arrays(self) -> npz.Arrays:
        """Return the arrays by name."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    @classmethod
    def of(cls, arrays: npz.Arrays) -> "Head":
        """Return the head in arrays; BundleError if they are none."""
        units, classes = (len(arrays.get(name, ())) for name in ("hidden_bias", "out_bias"))
        shapes = (units, -1), (units,), (classes, units), (classes,)
        names = [one.name for one in fields(cls)]
        check_arrays("a head", arrays, dict(zip(names, shapes, strict=True)))
        return cls(**arrays)


def read(data: bytes) -> Head:
    """Return the head in the part `head.npz`; BundleError if it is damaged."""
    return Head.of(arrays_of(data, "a head"))


def read_rows(data: bytes) -> dict[str, Head]:
    """Return the rows in the part `taught.npz` by user; BundleError if it is damaged."""
    arrays = arrays_of(data, "a head")
    found: dict[str, npz.Arrays] = {}
    for name in arrays:
        if name.startswith(_ROWS):
            user, _, own = name.removeprefix(_ROWS).rpartition(".")
            found.setdefault(user, {})[own] = arrays[name]
    return {user: Head.of(own) for user, own in found.items()}


def row_arrays(rows: Mapping[str, Head]) -> npz.Arrays:
    """Return the arrays of rows by user, for `read_rows`."""
    return {
        f"{_ROWS}{user}.{name}": array
        for user, own in rows.items()
        for name, array in own.arrays().items()
    }


def softmax(logits: Matrix) -> Matrix:
    """Return the softmax of logits, (n, classes)."""
    power = np.exp(logits - logits.max(axis=1, keepdims=True))
    return np.asarray(power / power.sum(axis=1, keepdims=True), dtype=np.float32)
