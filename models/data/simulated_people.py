"""Simulated people and orbs that no training had, with faults from the first frame on."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from controller.bundles.bundle import Bundle
from controller.recordings.recording import Recording
from controller.simulator.dome.faults import Fault
from controller.simulator.session import TEST_SEEDS
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
