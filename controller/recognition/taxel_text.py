"""Taxels in words: whole rows or columns, single ones, or how many; counted from the top left."""

from collections.abc import Iterable
from typing import Final

import numpy as np
from numpy.typing import NDArray

NAMED: Final = 6  # more taxels than that are counted, not listed


def names(mask: NDArray[np.bool_]) -> str:
    """Return the taxels of a mask in words: whole rows or columns, single ones, or how many."""
    if mask.all():
        return "all taxels"
    for word, lines in (("row", mask), ("column", mask.T)):
        whole = lines.all(axis=1)
        if whole.any() and not lines[~whole].any():
            return f"{word}{'s' * int(whole.sum() > 1)} {_list(np.flatnonzero(whole).tolist())}"
    places = np.argwhere(mask).tolist()
    if len(places) == 1:
        return f"taxel row {places[0][0]}, column {places[0][1]}"
    if len(places) > NAMED:
        return f"{len(places)} of {mask.size} taxels"
    return f"taxels {_list(f'({row},{column})' for row, column in places)}"


def _list(items: Iterable[object]) -> str:
    """Return "a, b and c"."""
    *most, last = map(str, items)
    return f"{', '.join(most)} and {last}" if most else last
