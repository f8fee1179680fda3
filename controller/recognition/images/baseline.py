"""Baseline tracking: the rest image C0, the reading of the untouched sensor.

The baseline comes from the first quiet second, or from a calibration. It follows the sensor while
nothing touches, more slowly where a light touch is possible, and is frozen under a touch. So a long
press is never absorbed, and slow drift is never taken for a touch. A finger present from the start
is detected when it leaves. In a busy minute the hysteresis of the rubber may exceed the gate; then
the level to which the sensor settles repeatedly between touches is the new baseline. Light touches
of few taxels, which the mean over a large sensor does not show, have a gate of their own.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images import drift
from controller.recognition.images.drift import mean_of
from controller.recognition.images.frames import Frame, Image, PreprocessSettings, z_image
from controller.recognition.images.rebaseline import Rebaseline, difference, still_frames
from controller.recognition.images.scale import FIRM
from controller.shared.aliases import Reading, State
from controller.shared.taxel_measures import LEAD_SHARE

# Fewer frames do not show the noise of a sensor at rest.
_LEAST: Final = 6

# A light finger on a noisy skin stays below the gate, so the baseline would follow its touches: at
# a press every 1.3 s, two of five followed frames are touched. But noise cancels in the mean over
# the skin, and a finger only lowers it: where the mean of a quiet frame is this low, the baseline
# follows more slowly. A quarter of the rate, or none, helps light hands more, but loses fast drift.
# Where noise is not most of the gate, it hides no finger, and the rate is the usual one.
_LOW: Final = 0.4  # of the gate
_WARY: Final = 0.5  # of the usual rate

# Of the local gate:
_FEW: Final = 60  # taxels; on a sensor of fewer, a finger moves the mean
# Times the usual strength of noise. White noise exceeds 1.6 times in 1 of 200 frames of 12×21
# taxels, and less often on more.
_NOISE: Final = 1.8
_LIGHT: Final = 0.15  # of a firm touch's strength; the residue of a touch is weaker
_FOLLOW: Final = 0.01  # of the strength of a firm touch, a frame
_SLOW: Final = 0.05  # of the pace of noise at rest, as what is felt might be more noise
_MOST: Final = 3.0  # times the noise; a stronger change adds no more to it

Change = NDArray[np.floating]  # z, or z - 1, (rows, columns)


@dataclass(frozen=True, slots=True)
class StoredBaseline:
    """Result of an earlier calibration.

    Attributes:
        rest: The untouched sensor, (rows, columns), picofarads.
        idle: Mean of |z - 1| while nothing touched.
    """

    rest: Frame
    idle: float


class BaselineTracker:
    """The rest image, and the state of its tracking.

    Attributes:
        image: The untouched sensor, (rows, columns), picofarads; None until it is found.
        idle: Mean deviation while nothing touches; 0 until it is known.
        seen: Quiet frames in the image; 0: it is a calibration that is not confirmed yet.
        local: Gate of light touches of few taxels.
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
        self.idle = 0.0
        self.seen = 0
        self._start = max(_LEAST, round(settings.start_s * settings.rate_hz))
        self._settle = round(settings.settle_s * settings.rate_hz)
        self._adopt = round(settings.adopt_s * settings.rate_hz)
        self._follow = 1.0 / max(1.0, settings.follow_s * settings.rate_hz)
        self._still_frames = still_frames(settings)
        self._soft = settings.normalise == "ratio"  # a skin: smooth, and squeezed by touch
        self.local = LocalGate(shape, -FIRM if self._soft else 0.0)
        # The first second until there is a baseline; then the latest busy second.
        self._frames: deque[Reading] = deque(maxlen=self._start)
        self._recent = np.ones(shape)  # slow mean of the frames, to detect a steady deviation
        self._quiet_run = 0
        self._steady_run = 0
        self._returns = Rebaseline(settings)
        if known is not None:
            self.image, self.idle = known.rest.astype(np.float64), known.idle

    @property
    def gate(self) -> float:
        """Deviation below which nothing touches."""
        return self.settings.gate + self.settings.gate_noise * self.idle

    def rescale(self, settings: PreprocessSettings) -> None:
        """Take settings of another scale; what is known in the old one is converted."""
        factor = abs(self.settings.scale / settings.scale)
        self.idle *= factor
        self.local.rescale(factor)
        self._returns.peak *= factor
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
        noise = float(np.abs(images - 1.0).mean(axis=(1, 2)).mean())
        if len(stack) == self._start and self._still(images, len(stack) // 2, noise):
            self.image, self._recent = middle, middle.copy()
            self.idle = noise
            self.local.measure(images)
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
        still = difference(here, rest, self.settings) < self.gate
        if not still and (not self._soft or drift.shape(z - 1.0) != "touch"):
            self.image, self.idle = None, 0.0  # another sensor, or too great a change
            return []
        self.image, self._recent = rest, here.copy()
        self.seen = self._start if still else 1
        frames = list(self._frames)
        self.local.measure(z_image(np.array(frames), rest, self.settings))
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
        rest[back] = self._recent[back] = values[back]
        return np.where(lost, rest, values)

    def step(
        self, values: Reading, image: Image, deviation: float, gate: float, strength: float
    ) -> None:
        """Follow the sensor while it is quiet; freeze under a touch.

        Args:
            values: The frame, (rows, columns).
            image: Its image z, (rows, columns).
            deviation: Mean |z - 1| of the image.
            gate: Deviation below which nothing touches.
            strength: `LocalGate.strength` of the image.
        """
        rest = self.image
        assert rest is not None
        self._recent += self._follow * (values - self._recent)
        if deviation < gate and not self.local.touched(strength):
            if self._returns.busy_run:
                self._returns.forget()
            self._frames.clear()
            self._quiet_run += 1
            self._steady_run = 0
            if self._quiet_run > self._settle:
                hidden = self._soft and gate > 2.0 * self.settings.gate
                pace = _WARY if hidden and 1.0 - drift.mean_of(image) > _LOW * gate else 1.0
                rest += pace * max(self._follow, 1.0 / (self.seen + 1)) * (values - rest)
                self.idle += pace * 0.2 * self._follow * (deviation - self.idle)
                self.local.rest(strength, pace * 0.2 * self._follow)
                self.seen += 1
            return
        self.local.learn(strength, 0.2 * self._follow)
        self._quiet_run = 0
        steady = difference(values, self._recent, self.settings) < gate
        self._steady_run = self._steady_run + 1 if steady else 0
        if self._steady_run >= self._adopt:
            self._steady_run = 0
            if not self._looks_touched(rest):
                rest = self._take(self._recent)
        if deviation < gate:  # a light touch, or more noise than before
            return
        found = self._returns.step(values, deviation, rest, gate)
        if found is not None:
            rest = self._take(found)
        if self._soft:
            self._detect_leaving(rest, values, image)

    def state(self) -> State:
        """Return the whole state, for an exact continuation elsewhere."""
        returns, empty = self._returns, np.empty((0, *self._recent.shape))
        scalars = (self.idle, self.seen, self._quiet_run, self._steady_run)
        return {
            "frames": np.array(self._frames, dtype=np.float64) if self._frames else empty,
            "rest": empty if self.image is None else self.image[None].copy(),
            "recent": self._recent.copy(),
            "spell": np.array(returns.spell) if returns.spell else empty,
            "returns": np.array(returns.places) if returns.places else empty,
            "scalars": np.array([*scalars, returns.peak, returns.busy_run], dtype=np.float64),
            **self.local.state(),
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
        self.local.restore(state)

    def _still(self, images: NDArray[np.float64], half: int, noise: float) -> bool:
        """Return whether both halves of images, (n, rows, columns), differ only by noise."""
        change = np.abs(images[:half].mean(axis=0) - images[half:].mean(axis=0)).mean()
        limit = self.settings.gate + noise / float(np.sqrt(half))
        return bool(change < limit)

    def _detect_leaving(self, rest: Reading, values: Reading, image: Image) -> None:
        """Take a new baseline once a finger has left that was part of the old one.

        After a long busy time any steady level that is no touch is a baseline, too.
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
        """Return whether a steady deviation from rest, (rows, columns), looks like a touch."""
        change = z_image(self._recent, rest, self.settings) - 1.0
        return self._soft and drift.shape(change) == "touch"

    def _take(self, values: Reading) -> Reading:
        """Make a reading, (rows, columns), the baseline, and return it."""
        self.image = values.copy()
        self._frames.clear()
        self._returns.forget()
        return self.image


class LocalGate:
    """Strength above which a finger touches, by the noise of the sensor and by its firm touches.

    Attributes:
        noise: Size of the usual strength while nothing touches; 0 until it is known.
        firm: Strength of a firm touch; 0: unknown, with its sign. A change of the other sign is
            a finger that was part of the baseline and has left.
    """

    def __init__(self, shape: tuple[int, int], firm: float) -> None:
        """Begin for a sensor of (rows, columns)."""
        self.noise, self.firm = 0.0, firm
        self._off = shape[0] * shape[1] <= _FEW or min(shape) < 2

    def strength(self, change: Change) -> float:
        """Return the strongest mean of 2×2 taxels without what all share; 0 on a small sensor."""
        if self._off:
            return 0.0
        pairs = change[1:] + change[:-1]
        patches = (pairs[:, 1:] + pairs[:, :-1]) / 4.0
        middle = mean_of(change)
        low, high = float(patches.min()) - middle, float(patches.max()) - middle
        return high if high > -low else low

    def touched(self, strength: float) -> bool:
        """Return whether a strength is that of a touch."""
        light = max(_NOISE * self.noise, _LIGHT * max(FIRM, abs(self.firm)))
        return abs(strength) > light and strength * self.firm >= 0.0

    def measure(self, images: NDArray[np.float64]) -> None:
        """Take the noise from successive images, (n, rows, columns), by their changes."""
        found = [abs(self.strength(change)) for change in np.diff(images, axis=0)]
        self.noise = float(np.median(found) / np.sqrt(2.0))

    def rest(self, strength: float, pace: float) -> None:
        """Follow the noise by the strength of an untouched frame, at a pace a frame."""
        self.noise += (pace if self.noise else 1.0) * (abs(strength) - self.noise)

    def learn(self, strength: float, pace: float) -> None:
        """Follow firm touches, and noise that grows slowly, by the strength of a touched frame."""
        size = abs(strength)
        self.noise += _SLOW * pace * (min(size, _MOST * self.noise) - self.noise)
        if size > abs(self.firm) / 2.0:
            self.firm += _FOLLOW * (strength - self.firm)

    def rescale(self, factor: float) -> None:
        """Convert to another scale of images."""
        self.noise *= factor
        self.firm *= factor

    def state(self) -> State:
        """Return everything remembered; nothing on a small sensor."""
        return {} if self._off else {"local": np.array([self.noise, self.firm])}

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        if not self._off:
            self.noise, self.firm = state["local"].tolist()
