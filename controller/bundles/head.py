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

from controller.shared import npz

EVERYBODY: Final = ""  # the user of what is for all users
_ROWS: Final = "rows-"  # before a user's name: arrays of taught rows

Matrix = NDArray[np.float32]  # (rows, columns), or a vector (n,)


class HeadError(ValueError):
    """The arrays are no head; the message has no subject."""


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
        """Return the head in arrays; HeadError if they are none."""
        names = [one.name for one in fields(cls)]
        if set(arrays) != set(names):
            raise HeadError(f"has a head of {', '.join(arrays)}, not {', '.join(names)}")
        units, classes = len(arrays["hidden_bias"]), len(arrays["out_bias"])
        shapes = (units, arrays["hidden"].shape[-1]), (units,), (classes, units), (classes,)
        for name, shape in zip(names, shapes, strict=True):
            array = arrays[name]
            if array.dtype != np.float32 or array.shape != shape or not np.isfinite(array).all():
                raise HeadError(
                    f"has a head with {name} of {array.dtype} {array.shape}; "
                    f"expected are finite float32 {shape}"
                )
        return cls(**arrays)


def read(data: bytes, limit_bytes: int) -> Head:
    """Return the head in the part `head.npz`; HeadError if it is damaged."""
    return Head.of(_unpacked(data, limit_bytes))


def read_rows(data: bytes, limit_bytes: int) -> dict[str, Head]:
    """Return the rows in the part `taught.npz` by user; HeadError if it is damaged."""
    arrays = _unpacked(data, limit_bytes)
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


def _unpacked(data: bytes, limit_bytes: int) -> npz.Arrays:
    try:
        return npz.unpack(data, limit_bytes)
    except npz.NpzError as error:
        raise HeadError(f"has a head whose file {error}") from None
