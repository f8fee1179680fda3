"""Test sessions: recordings, or simulated people and orbs that no training had, whole or broken.

A simulated orb is broken before the session begins. A recording can be broken afterwards as far as
its frames allow: a taxel that does not react reads what it read when nothing touched.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.recordings import reader
from controller.recordings.quality.taxels import respond
from controller.recordings.recording import Recording
from controller.simulator.dome.faults import KINDS, Fault
from controller.simulator.session import TEST_SEEDS
from models.data.simulate import DataSet, Hand

# Seeds that no training accepts: what is looked at again and again, and what only reports see.
EVALUATE_SEED: Final = TEST_SEEDS.start
BENCHMARK_SEED: Final = TEST_SEEDS.start + 10

DEAD: Final = "dead"
OPEN: Final = ("open_row", "open_column")
_RECENT: Final = 20  # untouched frames that a dead taxel repeats


@dataclass(frozen=True, slots=True)
class People:
    """Simulated people at play."""

    data: DataSet  # settings of their sessions
    users: int  # number of users; sessions go round among them

    @classmethod
    def of(
        cls,
        bundle: Bundle,
        preset: str,
        seed: int,
        minutes: float,
        *,
        users: int,
        hand: Hand = "person",
    ) -> "People":
        """Return people who make a bundle's gestures; ValueError if the simulated hand cannot."""
        data = DataSet(
            seed=seed,
            minutes=minutes,
            preset=preset,
            hand=hand,
            rate_hz=bundle.rate_hz,
            rows=bundle.rows,
            columns=bundle.columns,
            pitch_mm=bundle.pitch_mm,
            gestures=bundle.labels[1:],
        )
        try:
            data.repertoire()
        except ValueError as error:
            raise ValueError(f"{error}; judge this bundle on recordings: add DIR") from None
        return cls(data, users)

    def sessions(self, count: int, faults: Sequence[str] = ()) -> Iterator[tuple[str, Recording]]:
        """Yield named sessions with faults from the first frame on."""
        ill = [Fault.parse(one, self.data.rows, self.data.columns) for one in faults]
        for number in range(count):
            user, session = number % self.users, number // self.users
            name = f"{self.data.preset} {user + 1:02d}-{session + 1:02d}"
            yield name, self.data.session(user, session, ill)


def named(
    files: Iterable[Path], grid: tuple[int, int], faults: Sequence[str] = ()
) -> Iterator[tuple[str, Recording]]:
    """Yield recordings of a sensor of (rows, columns) with their names, one at a time, broken."""
    for file in files:
        recording = reader.load(file)
        for fault in faults:
            recording = broken(recording, Fault.parse(fault, *grid))
        yield file.stem, recording


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
    """Return a recording in which some taxels do not react; ValueError for any other fault.

    Their readings during touches are replaced by untouched ones from just before, the latest first,
    with their noise and drift. An electrode is a whole line of such taxels.
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
