"""Test sessions: recordings, or simulated people and orbs that no training had."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from controller.bundles.bundle import Bundle
from controller.recordings import reader
from controller.recordings.recording import Recording
from controller.simulator.faults import Fault
from controller.simulator.session import TEST_SEEDS
from models.data import faults as faulty
from models.data.simulate import DataSet, Hand

# Seeds that no training accepts: what is looked at again and again, and what only reports see.
EVALUATE_SEED: Final = TEST_SEEDS.start
BENCHMARK_SEED: Final = TEST_SEEDS.start + 10


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
        """Return people who make a bundle's gestures on its kind of sensor.

        Raises:
            ValueError: The simulated hand does not know a gesture.
        """
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
        broken = [Fault.parse(one, self.data.rows, self.data.columns) for one in faults]
        for number in range(count):
            user, session = number % self.users, number // self.users
            name = f"{self.data.preset} {user + 1:02d}-{session + 1:02d}"
            yield name, self.data.session(user, session, broken)


def named(
    files: Iterable[Path], grid: tuple[int, int], faults: Sequence[str] = ()
) -> Iterator[tuple[str, Recording]]:
    """Yield recordings with their names, one at a time.

    Args:
        files: Their paths.
        grid: Rows and columns of the sensor.
        faults: Faults applied to them afterwards.

    Raises:
        RecordingError: One cannot be read.
        ValueError: A fault cannot be seen in frames.
    """
    for file in files:
        recording = reader.load(file)
        for fault in faults:
            recording = faulty.broken(recording, Fault.parse(fault, *grid))
        yield file.stem, recording
