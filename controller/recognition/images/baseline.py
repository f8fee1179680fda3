"""Baseline tracking: the rest image C0, the reading of the untouched sensor.

The baseline comes from the first quiet second, or from a calibration. It follows the sensor while
nothing touches, more slowly where a light touch is possible, and is frozen under a touch; both are
decided by the noise of every taxel (`controller.recognition.images.noise`). So a long press is
never absorbed, and slow drift is never taken for a touch. A level to which the sensor settles takes
its place if it is no touch: what a finger leaves that was present from the start, another level
after a long busy time, or the one that returns between touches, as the rubber has hysteresis.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images import drift
from controller.recognition.images.drift import mean_of
from controller.recognition.images.frames import Frame, Image, PreprocessSettings, z_image
from controller.recognition.images.noise import TaxelNoise
from controller.recognition.images.rebaseline import Rebaseline, difference, still_frames
from controller.shared.aliases import Reading, State
from controller.shared.taxel_measures import LEAD_SHARE

# Fewer frames do not show the noise of a sensor at rest.
_LEAST: Final = 6
# Share of a deviation that is a rise: a touch lowers the mean of all taxels.
_RISE: Final = 0.5


@dataclass(frozen=True, slots=True)
class StoredBaseline:
    """Result of an earlier calibration.

    Attributes:
        rest: The untouched sensor, (rows, columns), picofarads.
        idle: Mean of |z - 1| while nothing touched.
        depth: Factor of estimated depths; 1: not calibrated.
    """

    rest: Frame
    idle: float
    depth: float = 1.0


class BaselineTracker:
    """The rest image, and the state of its tracking.

    Attributes:
        image: The untouched sensor, (rows, columns), picofarads; None until it is found.
        noise: Noise of every taxel, which decides about touches.
        seen: Quiet frames in the image; 0: it is a calibration that is not confirmed yet.
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
            known: An earlier calibration of this sensor.
        """
        self.settings = settings
        self.image: Reading | None = None
        self.noise = TaxelNoise(settings, shape)
        self.seen = 0
        self._start = max(_LEAST, round(settings.start_s * settings.rate_hz))
        self._settle = round(settings.settle_s * settings.rate_hz)
        self._adopt = round(settings.adopt_s * settings.rate_hz)
        self._follow = 1.0 / max(1.0, settings.follow_s * settings.rate_hz)
        self._still_frames = still_frames(settings)
        self._soft = settings.normalise == "ratio"  # a skin: smooth, and squeezed by touch
        # The first second until there is a baseline; then the latest busy second.
        self._frames: deque[Reading] = deque(maxlen=self._start)
        self._quiet_run = 0
        self._steady_run = 0
        self._returns = Rebaseline(settings)
        if known is not None:
            self.image = known.rest.astype(np.float64)
            self.noise.begin(known.idle)

    def rescale(self, settings: PreprocessSettings) -> None:
        """Take settings of another scale; what is known in the old one is converted."""
        self._returns.peak *= abs(self.settings.scale / settings.scale)
        self.noise.rescale(settings)
        self.settings = self._returns.settings = settings

    def begin(self, values: Reading) -> NDArray[np.float64]:
        """Collect the first quiet second; a touch or a motion restarts it.

        Returns:
            Images of the frames so far relative to their mean, (n, rows, columns). Once they are
            quiet that mean is the rest image.
        """
        self._frames.append(values)
        stack = np.array(self._frames)
        middle = stack.mean(axis=0)
        images = z_image(stack, middle, self.settings)
        if len(stack) == self._start and self._still(images):
            self.image = middle
            self.noise.begin(np.abs(images - 1.0).mean(axis=0))
            self.seen = self._quiet_run = len(stack)
            self._frames.clear()
        return images

    def try_known(self, values: Reading) -> list[Reading]:
        """Compare the first frames, (rows, columns), with a calibration; the sensor may be touched.

        Returns:
            The frames so far once the calibration is confirmed, else none. If it is refused there
            is no image afterwards.
        """
        known = self.image
        assert known is not None
        self._frames.append(values)
        if len(self._frames) < self._still_frames:
            return []
        here = np.mean(self._frames, axis=0)
        # A factor common to all taxels is pressure or temperature, which may have changed.
        z = z_image(here, known, self.settings)
        common = float(np.median(z)) if self._soft else 1.0
        rest = known * common
        still = difference(here, rest, self.settings) < self.noise.gate
        if not still and (not self._soft or drift.shape(z - 1.0) != "touch"):
            self.image = None  # another sensor, or too great a change
            self.noise.begin(0.0)
            return []
        self.image = rest
        self.seen = self._start if still else 1
        frames = list(self._frames)
        self._frames.clear()
        return frames

    def without(self, lost: NDArray[np.bool_], values: Reading) -> Reading:
        """Return values, (rows, columns), with the baseline in place of taxels without a lead.

        If a lead is connected that was open at rest, its first reading becomes its baseline.
        """
        rest = self.image
        assert rest is not None
        level = LEAD_SHARE * drift.mean_of(rest)
        back = lost & (values > level)
        rest[back] = values[back]
        return np.where(lost, rest, values)

    def step(
        self, values: Reading, image: Image, deviation: float, strength: float, *, quiet: bool
    ) -> None:
        """Follow the sensor while it is quiet; freeze under a touch.

        Args:
            values: The frame, (rows, columns).
            image: Its image z, (rows, columns).
            deviation: Mean |z - 1| of the image.
            strength: `TaxelNoise.strength` of the image.
            quiet: Nothing touches, by `TaxelNoise.touched`.
        """
        rest = self.image
        assert rest is not None
        if quiet:
            if self._returns.busy_run:
                self._returns.forget()
            self._frames.clear()
            self._quiet_run += 1
            self._steady_run = 0
            if self._quiet_run > self._settle:
                pace = self.noise.pace(image)
                rest += pace * max(self._follow, 1.0 / (self.seen + 1)) * (values - rest)
                self.noise.follow(image, pace)
                self.seen += 1
            return
        self.noise.learn(image, deviation, strength)
        self._quiet_run = 0
        gate = self.noise.gate
        if deviation < gate:  # a light touch, or more noise than before
            return
        found = self._returns.step(values, deviation, rest, gate)
        if found is None:
            self._settled(rest, values, image, deviation)
        else:
            self._take(found)

    def state(self) -> State:
        """Return the whole state, for an exact continuation elsewhere."""
        returns, empty = self._returns, np.empty((0, *self.noise.size.shape))
        scalars = (self.noise.idle, self.seen, self._quiet_run, self._steady_run)
        return {
            "frames": np.array(self._frames, dtype=np.float64) if self._frames else empty,
            "rest": empty if self.image is None else self.image[None].copy(),
            "spell": np.array(returns.spell) if returns.spell else empty,
            "returns": np.array(returns.places) if returns.places else empty,
            "scalars": np.array([*scalars, returns.peak, returns.busy_run], dtype=np.float64),
            **self.noise.state(),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._frames = deque(state["frames"], maxlen=self._start)
        self.image = state["rest"][0].copy() if len(state["rest"]) else None
        idle, seen, quiet_run, steady_run, peak, busy_run = state["scalars"].tolist()
        self.seen = int(seen)
        self._quiet_run, self._steady_run = int(quiet_run), int(steady_run)
        self._returns.restore(state["spell"], state["returns"], peak, int(busy_run))
        self.noise.restore(state, idle)

    def _still(self, images: NDArray[np.float64]) -> bool:
        """Return whether both halves of images, (n, rows, columns), differ only by noise."""
        half = len(images) // 2
        noise = float(np.abs(images - images.mean(axis=0)).mean())
        change = np.abs(images[:half].mean(axis=0) - images[half:].mean(axis=0)).mean()
        limit = self.settings.gate + noise / float(np.sqrt(half))
        return bool(change < limit)

    def _settled(self, rest: Reading, values: Reading, image: Image, deviation: float) -> None:
        """Take a level at which a busy sensor has been for a second as baseline, if it is no touch.

        A rise is a finger that has left: it counts at once. Any other level that is no touch counts
        after a long busy time; on a sensor whose touches have no shape, it must have lasted.
        """
        self._frames.append(values)
        old = self._returns.old or not self._soft
        rises = mean_of(image) - 1.0 > _RISE * deviation
        if len(self._frames) < self._start or not (old or rises):
            return
        stack = z_image(np.array(self._frames), rest, self.settings)
        level = stack.mean(axis=0)
        noise = np.abs(np.diff(stack, axis=0)).mean(axis=0) / np.sqrt(2.0)
        spread = mean_of(np.abs(stack - level))
        if spread > self.settings.gate / 2.0 + self.settings.gate_noise * mean_of(noise):
            self._steady_run = 0
            return
        self._steady_run += 1
        change = level - 1.0
        if not self._soft:
            settled = self._steady_run >= self._adopt
        elif mean_of(change) > _RISE * mean_of(np.abs(change)):
            settled = True
        else:
            settled = old and drift.shape(change) != "touch"
        if settled:
            self._take(np.mean(self._frames, axis=0))
            self.noise.begin(noise)

    def _take(self, values: Reading) -> None:
        """Make a reading, (rows, columns), the baseline."""
        self.image = values.copy()
        self._frames.clear()
        self._returns.forget()
        self._steady_run = 0
