"""Re-baselining: the level to which a busy sensor settles repeatedly between touches."""

from collections import deque
from collections.abc import Iterable
from typing import Final

import numpy as np

from controller.recognition.images import drift
from controller.recognition.images.frames import PreprocessSettings, z_image
from controller.shared.aliases import Reading

STILL_S: Final = 0.3  # time for which a busy sensor must stay at a level
_BUSY: Final = 1 / 3  # of `adopt_s`
_RETURNS: Final = 3
_PEAK: Final = 2.0  # times the deviation there: least peak of a touch between two returns
# Hysteresis lowers the whole dome: its unevenness is 0.23 at most in simulated play. A finger's is
# 0.32 and more, even on a lowered dome, on which fast play presses before it has recovered.
_MOST_UNEVENNESS: Final = 0.28


class Rebaseline:
    """Re-baselining: levels to which a busy sensor settled since it was last quiet.

    Attributes:
        settings: Time constants, gate and scale.
        spell: The latest frames.
        places: Mean frames of these levels, oldest first.
        peak: Greatest deviation since the latest level.
        busy_run: Frames since the sensor was quiet.
    """

    def __init__(self, settings: PreprocessSettings) -> None:
        """Begin with a quiet sensor."""
        self.settings = settings
        self._soft = settings.normalise == "ratio"
        self._busy = round(_BUSY * round(settings.adopt_s * settings.rate_hz))
        self.spell: deque[Reading] = deque(maxlen=still_frames(settings))
        self.places: deque[Reading] = deque(maxlen=_RETURNS)
        self.peak = 0.0
        self.busy_run = 0

    @property
    def old(self) -> bool:
        """Whether the sensor has been busy too long for its baseline to be reliable."""
        return self.busy_run >= self._busy

    def restore(
        self, spell: Iterable[Reading], places: Iterable[Reading], peak: float, busy_run: int
    ) -> None:
        """Continue with the state of another one; frames are (rows, columns)."""
        self.spell.clear()
        self.places.clear()
        self.spell.extend(spell)
        self.places.extend(places)
        self.peak, self.busy_run = peak, busy_run

    def forget(self) -> None:
        """Reset: the sensor is quiet."""
        self.spell.clear()
        self.places.clear()
        self.peak, self.busy_run = 0.0, 0

    def step(self, values: Reading, deviation: float, rest: Reading, gate: float) -> Reading | None:
        """Take a frame of a busy sensor; return the new baseline, (rows, columns), if there is one.

        Args:
            values: The frame, (rows, columns).
            deviation: Its mean |z - 1|.
            rest: The baseline so far, same shape.
            gate: Greatest difference of two frames of an untouched sensor.
        """
        self.busy_run += 1
        self.spell.append(values)
        self.peak = max(self.peak, deviation)
        if len(self.spell) < (self.spell.maxlen or 0):
            return None
        here = np.mean(self.spell, axis=0)
        if self.peak < _PEAK * difference(here, rest, self.settings) and not (
            self.old and self._common(here, rest)
        ):
            return None
        if not self._steady(self.spell, here, gate):
            return None
        self.spell.clear()
        self.peak = 0.0
        self.places.append(here)
        if len(self.places) < _RETURNS or not self.old:
            return None
        if not self._steady(self.places, here, gate):
            return None
        found = np.mean(self.places, axis=0)
        return found if not self._soft or self._even(found, rest, gate) else None

    def _even(self, here: Reading, rest: Reading, gate: float) -> bool:
        """Return whether a level, (rows, columns), differs from rest in all taxels alike."""
        change = z_image(here, rest, self.settings) - 1.0
        uneven = drift.unevenness(change)
        return uneven < _MOST_UNEVENNESS and uneven * drift.mean_of(np.abs(change)) < gate

    def _common(self, here: Reading, rest: Reading) -> bool:
        """Return whether a level differs from rest, (rows, columns), by pressure or temperature."""
        return self._soft and drift.shape(z_image(here, rest, self.settings) - 1.0) == "common"

    def _steady(self, frames: Iterable[Reading], here: Reading, gate: float) -> bool:
        """Return whether frames differ from a level, (rows, columns), only by noise."""
        return all(difference(frame, here, self.settings) < gate for frame in frames)


def difference(one: Reading, other: Reading, settings: PreprocessSettings) -> float:
    """Return the difference of two frames, (rows, columns): mean |z - 1| of one by the other."""
    return drift.mean_of(np.abs(z_image(one, other, settings) - 1.0))


def still_frames(settings: PreprocessSettings) -> int:
    """Return the length of a steady run, frames."""
    return max(2, round(STILL_S * settings.rate_hz))
