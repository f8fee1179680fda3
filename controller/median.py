"""The median and the mean of a few numbers: what NumPy gives, sooner.

The first call of `numpy.median` imports all of masked arrays: 6 ms in the middle of a control step,
at the first touch. `ndarray.mean` goes through NumPy's Python, at three times the cost of the sum.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def median(values: NDArray[np.floating], axis: int | None = None) -> Any:
    """Return the middle value, or the mean of the two in the middle; NaN where any value is.

    Args:
        values: At least one, of any shape.
        axis: Along which; None: of all together.
    """
    if axis is None:
        return _of_all(values)
    ordered = np.sort(values, axis=axis)  # NaN comes last
    count = ordered.shape[axis]
    low, high = ordered.take((count - 1) // 2, axis), ordered.take(count // 2, axis)
    last = ordered.take(-1, axis)
    return np.where(np.isnan(last), last, (low + high) / 2)[()]


def _of_all(values: NDArray[np.floating]) -> Any:
    """Return the median of all: a control step asks for two, of numbers in one list."""
    ordered = np.sort(values, axis=None)
    count = len(ordered)
    if np.isnan(ordered[-1]):
        return ordered[-1]
    return (ordered[(count - 1) // 2] + ordered[count // 2]) / 2


def mean(values: NDArray[np.floating]) -> float:
    """Return the mean of all, to the last bit that of `values.mean()`."""
    total = np.add.reduce(values, axis=None)
    return float(total.dtype.type(total / values.size))  # NumPy 1 divides to more digits
