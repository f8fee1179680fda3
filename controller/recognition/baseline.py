"""Baseline tracking: the rest image C0, what the untouched sensor reads.

It is taken from the first quiet second, or from a calibration; refined and followed while nothing
touches, more slowly where something light might; and frozen under a touch, so that a long press is
never absorbed and slow drift never looks like a hand. A finger that was there from the start is
noticed when it leaves. After long unrest the level to which the sensor settles several times in a
row between touches is its baseline too: in a busy minute what the rubber remembers may grow beyond
the gate.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition import drift
from controller.recognition.dead_taxels import NO_LEAD
from controller.recognition.frames import Frame, Image, PreprocessSettings, State, z_image

# Fewer frames than this do not show how much a noisy sensor scatters at rest.
_LEAST: Final = 6

# A light finger on a noisy skin stays below the gate, and so its touches take rest along: at a
# press every 1.3 s, two of five frames that rest follows are touched. But noise cancels over the
# skin, and a finger only takes away: where the mean of a quiet frame is this low, rest follows it
# more slowly. A quarter of the pace, or none, helps light hands more, but loses fast drift. Where
# noise is not most of the gate, it hides no finger, and rest follows as fast as ever.
_LOW: Final = 0.4  # of the gate
_WARY: Final = 0.5  # of the usual pace

STILL_S: Final = 0.3  # so long a busy sensor must stay at a level
_BUSY: Final = 1 / 3  # of `adopt_s`
_RETURNS: Final = 3
_PEAK: Final = 2.0  # times the deviation there: what a touch between two returns has at least
# ... and it is the whole dome that is left deep by then: uneven by 0.2 in simulated sessions, where
# half of all presses are by 0.57 and more. So one hand's press outlasts the other hand's taps.
_LOCAL: Final = 0.45

Reading = NDArray[np.float64]  # (rows, columns), picofarads


@dataclass(frozen=True, slots=True)
class StoredBaseline:
    """What an earlier calibration found.

    Attributes:
        rest: The untouched sensor, (rows, columns), picofarads.
        idle: Mean of |z - 1| while nothing touched.
    """

    rest: Frame
    idle: float


class BaselineTracker:
    """The rest image, and what is remembered to keep it true.

    Attributes:
        image: The untouched sensor, (rows, columns), picofarads; None until it is found.
        idle: The deviation that is usual while nothing touches; 0 until it is known.
        seen: Quiet frames that made the image; 0: it is a calibration's, still on trial.
    """

    def __init__(
        self,
        settings: PreprocessSettings,
        shape: tuple[int, int],
        known: StoredBaseline | None = None,
    ) -> None:
        """Begin before the first frame.

        Args:
            settings: Time constants and gate.
            shape: Rows and columns of the sensor.
            known: Of an earlier calibration of this sensor.
        """
        self.settings = settings
        self.image: Reading | None = None
        self.idle = 0.0
        self.seen = 0
        self._start = max(_LEAST, round(settings.start_s * settings.rate_hz))
        self._settle = round(settings.settle_s * settings.rate_hz)
        self._adopt = round(settings.adopt_s * settings.rate_hz)
        self._follow = 1.0 / max(1.0, settings.follow_s * settings.rate_hz)
        self._still_frames = _still_frames(settings)
        self._soft = settings.normalise == "ratio"  # a skin: smooth, and squeezed by touch
        # The first second while there is no rest; then the latest second of unrest.
        self._frames: deque[Reading] = deque(maxlen=self._start)
        self._recent = np.ones(shape)  # slow mean of the frames, to find a steady deviation
        self._quiet_run = 0
        self._steady_run = 0
        self._returns = Rebaseline(settings)
        if known is not None:
            self.image, self.idle = known.rest.astype(np.float64), known.idle

    @property
    def gate(self) -> float:
        """Deviation below which nothing touches."""
        return self.settings.gate + self.settings.gate_noise * self.idle

    def begin(self, values: Reading) -> NDArray[np.float64]:
        """Gather the first quiet second; a touch or a motion restarts it.

        Returns:
            Images of the frames so far by their own mean, (n, rows, columns). Once they are quiet
            that mean is the rest image.
        """
        self._frames.append(values)
        stack = np.array(self._frames)
        middle = stack.mean(axis=0)
        images = z_image(stack, middle, self.settings)
        noise = float(np.abs(images - 1.0).mean(axis=(1, 2)).mean())
        if len(stack) == self._start and self._still(images, len(stack) // 2, noise):
            self.image, self._recent = middle, middle.copy()
            self.idle = noise
            self.seen = self._quiet_run = len(stack)
            self._frames.clear()
        return images

    def try_known(self, values: Reading) -> list[Reading]:
        """Hold the first frames against a calibration: it may hold still, or be touched already.

        Returns:
            The frames so far once the calibration holds, else none. Where it does not hold there is
            no image afterwards.
        """
        known = self.image
        assert known is not None
        self._frames.append(values)
        if len(self._frames) < self._still_frames:
            return []
        here = np.mean(self._frames, axis=0)
        # What all taxels have in common is air or warmth: that may well have changed since.
        z = z_image(here, known, self.settings)
        common = float(np.median(z)) if self._soft else 1.0
        rest = known * common
        still = _difference(here, rest, self.settings) < self.gate
        if not still and (not self._soft or drift.shape(z - 1.0) != "touch"):
            self.image, self.idle = None, 0.0  # another sensor, or much has changed
            return []
        self.image, self._recent = rest, here.copy()
        self.seen = self._start if still else 1
        frames = list(self._frames)
        self._frames.clear()
        return frames

    def without(self, lost: NDArray[np.bool_], values: Reading) -> Reading:
        """Return values, (rows, columns), that leave rest as it was where leads are off.

        Where a lead is there now that was not there at rest, its first reading becomes its rest.
        """
        rest = self.image
        assert rest is not None
        level = NO_LEAD * float(rest.mean())
        back = lost & (values > level)
        rest[back] = self._recent[back] = values[back]
        return np.where(lost, rest, values)

    def step(self, values: Reading, image: Image, deviation: float, gate: float) -> None:
        """Follow the sensor while it is quiet; freeze under a touch.

        Args:
            values: The frame.
            image: What it became.
            deviation: Mean |z - 1| of that.
            gate: Deviation below which nothing touches.
        """
        rest = self.image
        assert rest is not None
        self._recent += self._follow * (values - self._recent)
        if deviation < gate:
            if self._returns.busy_run:
                self._returns.forget()
            self._frames.clear()
            self._quiet_run += 1
            self._steady_run = 0
            if self._quiet_run > self._settle:
                hidden = self._soft and gate > 2.0 * self.settings.gate
                pace = _WARY if hidden and 1.0 - float(image.mean()) > _LOW * gate else 1.0
                rest += pace * max(self._follow, 1.0 / (self.seen + 1)) * (values - rest)
                self.idle += pace * 0.2 * self._follow * (deviation - self.idle)
                self.seen += 1
            return
        self._quiet_run = 0
        steady = _difference(values, self._recent, self.settings) < gate
        self._steady_run = self._steady_run + 1 if steady else 0
        if self._steady_run >= self._adopt:
            self._steady_run = 0
            if not self._looks_touched(rest):
                rest = self._take(self._recent)
        found = self._returns.step(values, deviation, rest, gate)
        if found is not None:
            rest = self._take(found)
        if self._soft:
            self._notice_leaving(rest, values, image)

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        returns, empty = self._returns, np.empty((0, *self._recent.shape))
        scalars = (self.idle, self.seen, self._quiet_run, self._steady_run)
        return {
            "frames": np.array(self._frames, dtype=np.float64) if self._frames else empty,
            "rest": empty if self.image is None else self.image[None].copy(),
            "recent": self._recent.copy(),
            "spell": np.array(returns.spell) if returns.spell else empty,
            "returns": np.array(returns.places) if returns.places else empty,
            "scalars": np.array([*scalars, returns.peak, returns.busy_run], dtype=np.float64),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._frames = deque(state["frames"], maxlen=self._start)
        self.image = state["rest"][0].copy() if len(state["rest"]) else None
        self._recent = state["recent"].copy()
        idle, seen, quiet_run, steady_run, peak, busy_run = state["scalars"].tolist()
        self.idle, self.seen = idle, int(seen)
        self._quiet_run, self._steady_run = int(quiet_run), int(steady_run)
        self._returns.restore(state["spell"], state["returns"], peak, int(busy_run))

    def _still(self, images: NDArray[np.float64], half: int, noise: float) -> bool:
        """Whether the second half of images, (n, rows, columns), equals the first but for noise."""
        change = np.abs(images[:half].mean(axis=0) - images[half:].mean(axis=0)).mean()
        limit = self.settings.gate + noise / float(np.sqrt(half))
        return bool(change < limit)

    def _notice_leaving(self, rest: Reading, values: Reading, image: Image) -> None:
        """Take the sensor for rest once a finger has left that had been taken into it.

        After long unrest rest is old, and whatever stands still and is no touch will do as well.
        """
        self._frames.append(values)
        old = self._returns.old
        if len(self._frames) < self._start or drift.tone(image - np.float32(1.0)) < (
            drift.TOUCHED if old else drift.LIFTED
        ):
            return
        stack = z_image(np.array(self._frames), rest, self.settings)
        half = len(stack) // 2
        if not self._still(stack, half, self.idle):
            return
        shape = drift.shape(stack.mean(axis=0) - 1.0)
        if shape == "lifted" or (old and shape in ("scattered", "electrode", "film")):
            self._take(np.mean(self._frames, axis=0))

    def _looks_touched(self, rest: Reading) -> bool:
        """Whether a steady deviation, however old, is a hand's or a thing's that lies there."""
        change = z_image(self._recent, rest, self.settings) - 1.0
        return self._soft and drift.shape(change) == "touch"

    def _take(self, values: Reading) -> Reading:
        """Take what the sensor reads for its rest, and return that."""
        self.image = values.copy()
        self._frames.clear()
        self._returns.forget()
        return self.image


class Rebaseline:
    """The levels at which a busy sensor stayed for a moment, since it was last quiet.

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
        self.spell: deque[Reading] = deque(maxlen=_still_frames(settings))
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
        if self.peak < _PEAK * _difference(here, rest, self._settings):
            return None
        if not self._alike(self.spell, here, gate):
            return None
        self.spell.clear()
        self.peak = 0.0
        self.places.append(here)
        if len(self.places) < _RETURNS or not self.old:
            return None
        if not self._alike(self.places, here, gate):
            return None
        found = np.mean(self.places, axis=0)
        change = z_image(found, rest, self._settings) - 1.0
        return found if not self._soft or drift.unevenness(change) < _LOCAL else None

    def _alike(self, frames: Iterable[Reading], here: Reading, gate: float) -> bool:
        """Whether no frame differs from the present level by more than noise does."""
        return all(_difference(frame, here, self._settings) < gate for frame in frames)


def _difference(one: Reading, other: Reading, settings: PreprocessSettings) -> float:
    """Return by how much two frames differ: the mean of |z - 1| of one by the other."""
    return float(np.abs(z_image(one, other, settings) - 1.0).mean())


def _still_frames(settings: PreprocessSettings) -> int:
    """Return how many frames in a row are a sensor's that stays where it is."""
    return max(2, round(STILL_S * settings.rate_hz))
