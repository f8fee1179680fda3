"""Wiring checks from touches: electrodes swapped, mirrored or turned; stiff taxels.

Taxels on both diagonals are pressed, one after the other: so every row and every column is touched
twice, each time with another one. The response is compared with the dent of a finger.
Pure: frames in, rows of the doctor's table out.
"""

from collections.abc import Iterator
from itertools import combinations, product
from typing import Final

import numpy as np

from controller.diagnostics.report import Row, Verdict
from controller.recognition.images.dead_taxels import TaxelInterpolator
from controller.shared.aliases import Array, Mask
from controller.shared.notices import notice
from controller.shared.taxel_measures import DENT_TAXELS, response_slope

Place = tuple[int, int]  # row, column

FELT_Z: Final = 0.03  # mean |z - 1|: a press of 8 mm makes 0.05 and more
CLEARER: Final = 0.01  # of the likeness to the dents of fingers
# Least response, of what the neighbours feel. On simulated domes with 2 % noise sound taxels have
# .7 and more, dead ones .2 and less.
STIFF_SHARE: Final = 0.35


def places(rows: int, columns: int) -> tuple[Place, ...]:
    """Return the taxels to press, (row, column): both diagonals, from the top left."""
    steps = max(rows, columns, 2)
    down = np.rint(np.linspace(0, rows - 1, steps)).astype(int).tolist()
    right = np.rint(np.linspace(0, columns - 1, steps)).astype(int).tolist()
    both = [*zip(down, right, strict=True), *zip(down, right[::-1], strict=True)]
    return tuple(dict.fromkeys(both))


def unfelt(change: Array) -> bool:
    """Return whether nothing was pressed, as far as a change (rows, columns) tells."""
    return float(np.abs(change).mean()) < FELT_Z


def judge(changes: Array, bad: Mask) -> list[Row]:
    """Return what is wrong, as far as touches tell; [] where nothing is.

    `changes` has z - 1 under each press of `places`, (places, rows, columns), noise averaged out,
    and `bad` the taxels that are known to be of no use, (rows, columns).
    """
    rows, columns = bad.shape
    filler = TaxelInterpolator(rows, columns)
    whole = np.array([filler.fill(change, bad) for change in changes]) if bad.any() else changes
    around = np.array([filler.around(change) for change in whole])
    slope = response_slope([(whole, around)])
    return _wiring(whole) or [
        _fault("stiff", notice("taxel_at", *place), notice("stiff", 100 * max(0.0, slope[place])))
        for place in map(tuple, np.argwhere((slope < STIFF_SHARE) & ~bad).tolist())
    ]


def _orders(count: int) -> dict[str, list[int]]:
    """Return how electrodes may be wired: straight, two swapped, or all reversed."""
    straight = list(range(count))
    orders = {"": straight}
    for i, k in combinations(straight, 2):
        swapped = straight.copy()
        swapped[i], swapped[k] = k, i
        orders[f"{i},{k}"] = swapped
    if count > 3:
        orders["mirrored"] = straight[::-1]
    elif count == 3:
        orders["mirrored"] = orders.pop("0,2")
    return orders


def _wiring(seen: Array) -> list[Row]:
    """Return the faults of the wiring that explains best what was felt, (places, rows, columns).

    Another than the right one has to be clearly better.
    """
    _, rows, columns = seen.shape
    centres = np.array(places(rows, columns))[:, :, None, None]
    square = np.square(np.indices((rows, columns)) - centres).sum(axis=1)
    seen, model = _pattern(seen), _pattern(-np.exp(-square / (2.0 * DENT_TAXELS**2)))
    straight = float((seen * model).sum())
    best: tuple[float, str, str, bool] = straight + CLEARER * len(seen), "", "", False
    for turned in (False, True) if rows == columns else (False,):
        base = model.transpose(0, 2, 1) if turned else model
        for (name_r, way_r), (name_c, way_c) in product(
            _orders(rows).items(), _orders(columns).items()
        ):
            score = float((seen * base[:, way_r][:, :, way_c]).sum())
            if score > best[0] + 1e-9 and (name_r or name_c or turned):
                best = score, name_r, name_c, turned
    _, name_r, name_c, turned = best
    if turned:
        return [_fault("turned", "plugs", notice("turned"))]
    return [*_swaps(name_r, "row"), *_swaps(name_c, "column")]


def _pattern(changes: Array) -> Array:
    """Return each change, (places, rows, columns), without its mean, of length 1."""
    changes = changes - changes.mean(axis=(1, 2), keepdims=True)
    return np.asarray(changes / np.linalg.norm(changes, axis=(1, 2), keepdims=True))


def _swaps(name: str, word: str) -> Iterator[Row]:
    """Yield the fault of an order of `_orders` among rows or columns, the `word`."""
    if name == "mirrored":
        way = notice("mirrored_down" if word == "row" else "mirrored_right")
        yield _fault("mirrored", f"{word}s", way)
    elif name:
        one, other = name.split(",")
        found, advice = notice("swapped", notice(word, other)), notice("swapped_advice")
        yield Row(notice(word, one), Verdict.FAULT, found, advice, f"swapped_{word}s")


def _fault(code: str, name: str, found: str) -> Row:
    """Return the row of a fault with the advice of its code."""
    return Row(name, Verdict.FAULT, found, notice(f"{code}_advice"), code)
