"""Re-baselining: the level to which a busy sensor repeatedly settles between touches.

Between quick touches the rubber never comes to rest, and in a busy minute what it remembers may
grow beyond the gate. So after long unrest what the sensor comes back to, several times in a row,
is its rest too.
"""

from collections import deque
from collections.abc import Iterable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition import drift
from controller.recognition.frames import PreprocessSettings, z_image

STILL_S: Final = 0.3  # so long it must stay there
_BUSY: Final = 1 / 3  # of `adopt_s`
_RETURNS: Final = 3
_PEAK: Final = 2.0  # times the deviation there: what a touch between two returns has at least
# ... and it is the whole dome that is left deep by then: uneven by 0.2 in simulated sessions, where
# half of all presses are by 0.57 and more. So one hand's press outlasts the other hand's taps.
_LOCAL: Final = 0.45

Reading = NDArray[np.float64]  # (rows, columns), picofarads


class Rebaseline:
    """Where the sensor stayed for a moment, again and again, since it was last quiet.

    Attributes:
        spell: Its latest frames.
        places: Where it stayed, oldest first, mean frames.
        peak: Greatest deviation since it last stayed.
        busy_run: Frames since it was quiet.
    """

    def __init__(self, settings: PreprocessSettings) -> None:
        """Begin with a quiet sensor."""
        self._settings = settings
        self._soft = settings.normalise == "ratio"
        self._busy = round(_BUSY * round(settings.adopt_s * settings.rate_hz))
        self.spell: deque[Reading] = deque(maxlen=still_frames(settings))
        self.places: deque[Reading] = deque(maxlen=_RETURNS)
        self.peak = 0.0
        self.busy_run = 0

    @property
    def old(self) -> bool:
        """Whether the sensor has been busy for so long that its rest cannot be relied on."""
        return self.busy_run >= self._busy

    def restore(
        self, spell: Iterable[Reading], places: Iterable[Reading], peak: float, busy_run: int
    ) -> None:
        """Continue with what another one remembered."""
        self.spell.clear()
        self.places.clear()
        self.spell.extend(spell)
        self.places.extend(places)
        self.peak, self.busy_run = peak, busy_run

    def forget(self) -> None:
        """The sensor is quiet."""
        self.spell.clear()
        self.places.clear()
        self.peak, self.busy_run = 0.0, 0

    def step(self, values: Reading, deviation: float, rest: Reading, gate: float) -> Reading | None:
        """Take a frame of a busy sensor; return what it comes back to if that is its rest now.

        Args:
            values: The frame.
            deviation: Its mean |z - 1|.
            rest: What was rest so far.
            gate: By so much two frames of an untouched sensor differ at most.
        """
        self.busy_run += 1
        self.spell.append(values)
        self.peak = max(self.peak, deviation)
        if len(self.spell) < (self.spell.maxlen or 0):
            return None
        here = np.mean(self.spell, axis=0)
        if self.peak < _PEAK * self._differ(here, rest):
            return None
        if not all(self._differ(frame, here) < gate for frame in self.spell):
            return None
        self.spell.clear()
        self.peak = 0.0
        self.places.append(here)
        if len(self.places) < _RETURNS or not self.old:
            return None
        if not all(self._differ(place, here) < gate for place in self.places):
            return None
        found = np.mean(self.places, axis=0)
        change = z_image(found, rest, self._settings) - 1.0
        return found if not self._soft or drift.unevenness(change) < _LOCAL else None

    def _differ(self, one: Reading, other: Reading) -> float:
        return float(np.mean(np.abs(z_image(one, other, self._settings) - 1.0)))


def still_frames(settings: PreprocessSettings) -> int:
    """Return how many frames in a row are a sensor's that stays where it is."""
    return max(2, round(STILL_S * settings.rate_hz))
