"""Data sets of simulated skins of many shapes, resampled onto one grid and rate."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from controller.recordings.recording import Recording
from controller.simulator.faults import Fault
from controller.simulator.orb import OrbModel
from models.data.simulate import DataSet

TAXELS: Final = (3, 12)  # rows, and columns, of a skin
SPAN_MM: Final = (25.0, 75.0)  # length of its longer side, between the outer taxels
RATES_HZ: Final = (10.0, 15.0, 20.0, 25.0, 40.0)
STRETCH: Final = (1.25, 1.75)  # of its apex: a stiffer or softer dome
STRENGTH: Final = 0.35  # deviation of ln of what a touch does to its readings: thickness, unit
NOISY: Final = 0.4  # share of skins that are as noisy as the preset `paper-snr`
PITCH_MM: Final = 8.0  # of all as resampled: recordings of a training have one
SKIN: Final = 79  # tag of the seeds of skins


@dataclass(frozen=True, slots=True)
class Skins(DataSet):
    """A data set in which each session has a skin of its own, resampled onto `rows` × `columns`."""

    minutes: float = 3.0
    rate_hz: float = 20.0
    rows: int = 6
    columns: int = 6
    stretch: float = 1.5  # of the inflated apex of a skin

    def model(self) -> OrbModel:
        """Return the model of a skin."""
        model = DataSet.model(self)
        return replace(model, mechanics=replace(model.mechanics, apex_stretch=self.stretch))

    def session(self, user: int, number: int, faults: Iterable[Fault] = ()) -> Recording:
        """Simulate a session on a skin drawn for it; users and sessions count from 0."""
        rng = np.random.default_rng([SKIN, self.seed, user, number])
        made = DataSet.session(self.skin(rng), user, number, faults)
        rest, strength = np.median(made.frames, axis=0), np.exp(rng.normal(0.0, STRENGTH))
        stronger = replace(made, frames=rest + strength * (made.frames - rest))
        return resampled(stronger, self.rows, self.columns, self.rate_hz)

    def skin(self, rng: np.random.Generator) -> "Skins":
        """Return the settings of a skin drawn at random, which is not resampled."""
        rows, columns = (int(side) for side in rng.integers(*TAXELS, 2, endpoint=True))
        return replace(
            self, preset="paper-snr" if rng.random() < NOISY else "nominal",
            rate_hz=float(rng.choice(RATES_HZ)), rows=rows, columns=columns,
            pitch_mm=float(rng.uniform(*SPAN_MM)) / (max(rows, columns) - 1),
            stretch=float(rng.uniform(*STRETCH)),
        )  # fmt: skip


def resampled(made: Recording, rows: int, columns: int, rate_hz: float) -> Recording:
    """Return a simulated recording, without its fingers' paths, of a grid (rows, columns) and rate.

    Readings are linear between taxels and between frames; labels are the nearest frame's.
    """
    assert made.truth is not None
    old, frames = made.origin, np.asarray(made.frames, dtype=np.float64)
    count = int((len(frames) - 1) * rate_hz / old.rate_hz) + 1
    times = np.arange(count, dtype=np.float64) * (old.rate_hz / rate_hz)
    near, size = np.rint(times).astype(np.int64), (rows, columns)
    sides = [np.linspace(0.0, n - 1.0, m) for n, m in zip(frames.shape[1:], size, strict=True)]
    for axis, places in enumerate((times, *sides)):
        frames = np.apply_along_axis(
            lambda row, at: np.interp(at, np.arange(len(row)), row), axis, frames, places
        )
    scale = (columns - 1) / (old.columns - 1), (rows - 1) / (old.rows - 1)
    touch = np.multiply(made.truth.touch[near], scale, dtype=np.float32)
    unseen = np.empty((count, 0, 3), dtype=np.float32)
    kept = ("label", "button", "key", "cue", "excluded", "touch")
    return replace(
        made,
        origin=replace(old, rows=rows, columns=columns, rate_hz=rate_hz, pitch_mm=PITCH_MM),
        frames=frames.astype(np.float32),
        t=(times + 1.0) / np.float64(old.rate_hz),
        sequence=np.arange(1, count + 1, dtype=np.int64),
        truth=replace(made.truth, touch=touch, contact=unseen),
        **{name: getattr(made, name)[near] for name in kept},
    )
