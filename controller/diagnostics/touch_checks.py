"""Wiring checks from touches: electrodes swapped, mirrored or turned; stiff taxels.

Taxels on both diagonals are pressed, one after the other: so every row and every column is touched
twice, each time with another one. The response is compared with that of a simulated dome.
Pure: frames in, rows of the doctor's table out.
"""

from collections.abc import Iterator
from functools import cache
from itertools import combinations, product
from typing import Final

import numpy as np

from controller.diagnostics.report import Row, fault
from controller.recognition.images.dead_taxels import TaxelInterpolator
from controller.shared.aliases import Array, Mask
from controller.shared.taxel_measures import DEAD_SLOPE, response_slope
from controller.simulator.dome.mechanics import Mechanics, MechanicsModel
from controller.simulator.hand.performance import MECHANICS_HZ

Place = tuple[int, int]  # row, column

DEPTH_MM: Final = 8.0  # of a firm press
RADIUS_MM: Final = 7.0
_HOLD_S: Final = 1.0
FELT_Z: Final = 0.03  # mean |z - 1|: a press of 8 mm makes 0.05 and more
CLEARER: Final = 0.01  # of the likeness: the right wiring leads by .06, at 4 % noise by .01
STIFF_SHARE: Final = 0.35  # least response, of what the dome should feel


def places(rows: int, columns: int) -> tuple[Place, ...]:
    """Return the taxels to press, (row, column): both diagonals, from the top left."""
    steps = max(rows, columns, 2)
    down = np.rint(np.linspace(0, rows - 1, steps)).astype(int).tolist()
    right = np.rint(np.linspace(0, columns - 1, steps)).astype(int).tolist()
    both = [*zip(down, right, strict=True), *zip(down, right[::-1], strict=True)]
    return tuple(dict.fromkeys(both))


@cache
def expected(rows: int, columns: int, pitch_mm: float) -> Array:
    """Return z - 1 of a simulated dome under each press of `places`, (places, rows, columns)."""
    return np.array([pressed(rows, columns, pitch_mm, place) for place in places(rows, columns)])


def pressed(
    rows: int,
    columns: int,
    pitch_mm: float,
    place: Place,
    *,
    off_mm: complex = 0j,
    depth_mm: float = DEPTH_MM,
) -> Array:
    """Return z - 1, (rows, columns), of a simulated dome pressed so deep, so far off a taxel."""
    steps = round(_HOLD_S * MECHANICS_HZ)
    model = MechanicsModel()
    friction = float(np.mean(model.friction))
    dome = Mechanics(model, (rows, columns), pitch_mm, 1.0 / MECHANICS_HZ, 1, friction)
    row, column = place
    at = complex(column - (columns - 1) / 2, (rows - 1) / 2 - row) * pitch_mm + off_mm
    sinking = np.minimum(np.arange(1, steps + 1) / (0.15 * MECHANICS_HZ), 1.0)
    log_c, _ = dome.advance(
        np.full((steps, 1), at), depth_mm * sinking[:, None], np.full((steps, 1), RADIUS_MM)
    )
    return np.asarray(np.expm1(log_c[-1]).reshape(rows, columns))


def unfelt(change: Array) -> bool:
    """Return whether nothing was pressed, as far as a change (rows, columns) tells."""
    return float(np.abs(change).mean()) < FELT_Z


def judge(changes: Array, pitch_mm: float, bad: Mask) -> list[Row]:
    """Return what is wrong, as far as touches tell; [] where nothing is.

    `changes` has z - 1 under each press of `places`, (places, rows, columns), noise averaged out,
    and `bad` the taxels that are known to be of no use, (rows, columns).
    """
    rows, columns = bad.shape
    filler = TaxelInterpolator(rows, columns)
    whole = np.array([filler.fill(change, bad) for change in changes]) if bad.any() else changes
    model = expected(rows, columns, pitch_mm)
    wired = _wiring(whole, model)
    return wired or list(_stiff(whole, model, bad, filler))


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


def _wiring(seen: Array, model: Array) -> list[Row]:
    """Return the faults of the wiring that explains best what was felt, (places, rows, columns).

    Another than the right one has to be clearly better.
    """
    seen, model = _pattern(seen), _pattern(model)
    _, rows, columns = seen.shape
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
        return [fault("turned", "plugs")]
    return [*_swaps(name_r, "row", "top to bottom"), *_swaps(name_c, "column", "left to right")]


def _pattern(changes: Array) -> Array:
    """Return each change, (places, rows, columns), without its mean, of length 1."""
    changes = changes - changes.mean(axis=(1, 2), keepdims=True)
    return np.asarray(changes / np.linalg.norm(changes, axis=(1, 2), keepdims=True))


def _swaps(name: str, word: str, way: str) -> Iterator[Row]:
    """Yield the fault of an order of `_orders` among rows or columns, the `word`."""
    if name == "mirrored":
        yield fault("mirrored", f"{word}s", way)
    elif name:
        one, other = name.split(",")
        found = f"{word} {other}, and the other way round"
        yield fault(f"swapped_{word}s", f"{word} {one}", found)


def _stiff(changes: Array, model: Array, bad: Mask, filler: TaxelInterpolator) -> Iterator[Row]:
    """Yield the taxels that feel too little of `model`, (places, rows, columns)."""
    around = np.array([filler.around(change) for change in changes])
    by_others, by_model = response_slope(changes, around), response_slope(changes, model)
    by_model = by_model / np.nanmedian(by_model[~bad]) if not bad.all() else by_model
    stiff = (by_others < DEAD_SLOPE) & (by_model < STIFF_SHARE) & ~bad
    for row, column in np.argwhere(stiff).tolist():
        percent = f"{100 * max(0.0, by_model[row, column]):.0f}"
        yield fault("stiff", f"taxel ({row},{column})", percent)
