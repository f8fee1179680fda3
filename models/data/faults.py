"""Sessions on which something is broken: every taxel, every electrode, every fault there is.

A simulated orb is broken before the session begins. A recording can be broken afterwards as far as
its frames allow: a taxel that does not react reads what it read when nothing touched.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.quality.taxels import respond
from controller.recordings.recording import Recording
from controller.simulator.faults import KINDS, Fault

DEAD: Final = "dead"
OPEN: Final = ("open_row", "open_column")
_RECENT: Final = 20  # untouched frames that a dead taxel repeats


def taxels(rows: int, columns: int) -> list[str]:
    """Return the faults of every single taxel that does not react."""
    return [f"{DEAD}:{row},{column}" for row in range(rows) for column in range(columns)]


def electrodes(rows: int, columns: int) -> list[str]:
    """Return the faults of every single electrode whose lead is off."""
    return [f"{OPEN[0]}:{i}" for i in range(rows)] + [f"{OPEN[1]}:{i}" for i in range(columns)]


def others(rows: int, columns: int) -> list[str]:
    """Return one fault of every other kind, in the middle of the sensor where it has a place."""
    middle = {"taxel": f":{rows // 2},{columns // 2}", "": ""}
    found = []
    for name, kind in KINDS.items():
        if name in (DEAD, *OPEN):
            continue
        side = rows if name.endswith("row") else columns
        found.append(name + middle.get(kind.place, f":{(side - 1) // 2}"))
    return found


def meaning(fault: str) -> str:
    """Return the description of a fault."""
    name = fault.partition(":")[0]
    return KINDS[name].meaning.partition("; size")[0]


def broken(recording: Recording, fault: Fault) -> Recording:
    """Return a recording in which some taxels do not react.

    Their readings during touches are replaced by untouched ones from just before, the latest first,
    with their noise and drift. An electrode is a whole line of such taxels.

    Raises:
        ValueError: The effect of the fault cannot be derived from frames.
    """
    if fault.kind not in (DEAD, *OPEN):
        raise ValueError(f"{fault.kind} cannot be applied to frames; simulate it instead")
    hit = np.zeros(recording.frames.shape[1:], dtype=np.bool_)
    if fault.kind == DEAD:
        hit[fault.row, fault.column] = True
    elif fault.kind == OPEN[0]:
        hit[fault.row] = True
    else:
        hit[:, fault.column] = True
    frames = recording.frames.copy()
    for touched, untouched in _pairs(respond(recording).touched):
        frames[touched] = np.where(hit, recording.frames[untouched], frames[touched])
    return replace(recording, frames=frames)


def _pairs(touched: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield each touched frame of (frames,) with the untouched one that takes its place."""
    still = np.flatnonzero(~touched)
    if not len(still):
        return
    for frame in np.flatnonzero(touched).tolist():
        before = int(np.searchsorted(still, frame))
        if not before:
            yield frame, int(still[0])
            continue
        back = (frame - 1 - int(still[before - 1])) % min(_RECENT, before)
        yield frame, int(still[before - 1 - back])
