"""Data sets of the study: recordings in files, or simulated people; loaded by each process."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings import reader
from controller.recordings.recording import Recording
from controller.simulator.presets import PRESETS
from controller.simulator.session import TEST_SEEDS, simulate
from models.data.examples import Choice
from models.data.simulate import DataSet
from models.studies.information.histogram import PAPER_FRAMES
from models.studies.information.windows import REST_S, as_the_paper

SEED: Final = TEST_SEEDS.start + 20  # no training accepts it
DAYS: Final = 4  # of one person
MINUTES: Final = 6.0  # of each
PAPER_MINUTES: Final = 29.2  # two such sessions hold the paper's frames
PAPER_SEEDS: Final = 5  # people and orbs


@dataclass(frozen=True, slots=True)
class RecordingSet:
    """Sessions that belong together.

    Attributes:
        name: What it is called.
        paths: Files; none: people are simulated.
        preset: Quality of the simulated orbs.
        choice: Whose labels count.
        quick: A small part of it, to try things.
    """

    name: str
    paths: tuple[Path, ...] = ()
    preset: str = ""
    choice: Choice = "auto"
    quick: bool = False

    def data(self) -> DataSet:
        """Return how simulated sessions are made."""
        return DataSet(seed=SEED, minutes=2.0 if self.quick else MINUTES, preset=self.preset)

    def recordings(self) -> list[Recording]:
        """Return all sessions."""
        if self.paths:
            return [reader.load(path) for path in self.paths]
        data = self.data()
        return [data.session(0, day) for day in range(DAYS)]

    def as_the_paper(self) -> list[tuple[NDArray[np.float64], NDArray[np.int64]]]:
        """Return z and labels as section 6 has them; simulated ones several times."""
        if self.paths:
            return [as_the_paper(self.recordings())]
        seeds = range(1 if self.quick else PAPER_SEEDS)
        return [paper_sessions(self.preset, seed) for seed in seeds]


def simulated(quick: bool = False) -> list[RecordingSet]:
    """Return a set for each preset."""
    return [RecordingSet(preset, preset=preset, quick=quick) for preset in PRESETS]


def paper_sessions(preset: str, seed: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return z, (PAPER_FRAMES, taxels), and the button's labels of one person's two sessions."""
    signals, labels = [], []
    for run in range(2):
        session = simulate(
            TEST_SEEDS.start + 10 * seed + run,
            PAPER_MINUTES,
            user=seed,
            model=PRESETS[preset],
            protocol="blocks",
        )
        z = session.frames / session.frames[: round(10 * REST_S)].mean(axis=0)
        signals.append(z.reshape(len(z), -1).astype(np.float64))
        labels.append(session.button.astype(np.int64))
    return np.concatenate(signals)[:PAPER_FRAMES], np.concatenate(labels)[:PAPER_FRAMES]
