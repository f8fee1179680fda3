"""Turn frames into images and windows: the way every frame takes, in training and on the device.

The rest image C0 is what the untouched sensor reads. It is taken from the first quiet
second, or from a calibration; refined and followed while nothing touches; and frozen under a touch,
so that a long press is never absorbed and slow drift never looks like a hand. A finger that was
there from the start is noticed when it leaves. Taxels that feel nothing are filled in.
"""

from collections import deque
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from controller import drift
from controller.median import median
from controller.mend import Answers, Filler
from controller.record import record

Frame = NDArray[np.float32]  # (rows, columns), picofarads
Image = NDArray[np.float32]  # (rows, columns), C / C0, 1.0 where untouched
Window = NDArray[np.float32]  # (images, rows, columns), oldest first
State = dict[str, NDArray[np.float64]]  # everything a stage remembers, by name
Normalise = Literal["ratio", "difference"]

# A taxel that reads less than this share of what the others read at rest has no lead: an open one
# reads some 1 of 41 pF, a pressed one never so little.
LEAST_REST: Final = 0.2
# Fewer frames than this say too little of how much a noisy sensor scatters at rest.
_LEAST: Final = 6

# Between quick touches the rubber never comes to rest, and in a busy minute what it remembers may
# grow beyond the gate. So after long unrest what the sensor comes back to, several times in a row,
# is its rest too.
_BUSY: Final = 1 / 3  # of `adopt_s`
_RETURNS: Final = 3
_STILL_S: Final = 0.3  # so long it must stay there
_PEAK: Final = 2.0  # times the deviation there: what a touch between two returns has at least
# ... and it is the whole dome that is left deep by then: uneven by 0.2 in simulated sessions, where
# half of all presses are by 0.57 and more. So one hand's press outlasts the other hand's taps.
_LOCAL: Final = 0.45


@record
class PreprocessSettings:
    """How images and windows are made; travels inside the bundle.

    Attributes:
        normalise: "ratio": z = C / C0, for capacitances; "difference": z = 1 + (C - C0) / scale,
            for sensors that read about 0 untouched.
        scale: What makes a firm touch as strong as on the orb (mean |z - 1| about .08), in the
            frame's unit; "ratio" has none.
        rate_hz: Frames per second.
        window: Images in a window; paper, section 4.1: 10 at 10 Hz.
        start_s: Quiet time from which the first rest image is taken.
        follow_s: Time constant with which rest follows quiet frames.
        settle_s: Quiet time after a touch before rest is followed again.
        gate: Deviation (mean of |z - 1|) below which a noiseless sensor is quiet.
        gate_noise: How many times the measured idle deviation is added to the gate.
        adopt_s: A steady deviation of this age is taken for a changed sensor, unless it looks like
            a hand, which it never does to "difference" (`controller.drift`).
    """

    normalise: str = "ratio"
    scale: float = 1.0
    rate_hz: float = 10.0
    window: int = 10
    start_s: float = 1.0
    follow_s: float = 2.0
    settle_s: float = 0.4
    gate: float = 0.015
    gate_noise: float = 1.2
    adopt_s: float = 30.0

    def __post_init__(self) -> None:
        if self.normalise not in get_args(Normalise) or not self.scale > 0.0:
            raise ValueError(
                f"normalise {self.normalise!r} with scale {self.scale!r}; it is "
                f"{' or '.join(get_args(Normalise))}, with a scale above 0"
            )


@record
class Prepared:
    """What one frame became.

    Attributes:
        image: z = C / C0, (rows, columns).
        ready: The rest image exists; before that the image is a provisional one.
        deviation: Mean of |z - 1| over the taxels.
        quiet: The deviation is below the gate: nothing touches.
        idle: The deviation that is usual while nothing touches; 0 until it is known.
        lost: Taxels without a lead; the image has guesses in their place; None: none.
        dead: Taxels that do not answer to touch; likewise.
    """

    image: Image
    ready: bool
    deviation: float
    quiet: bool
    idle: float = 0.0
    lost: NDArray[np.bool_] | None = None
    dead: NDArray[np.bool_] | None = None


@record
class Known:
    """What an earlier calibration found.

    Attributes:
        rest: The untouched sensor, (rows, columns), picofarads.
        idle: Mean of |z - 1| while nothing touched.
    """

    rest: Frame
    idle: float


def z_image(
    frame: NDArray[np.floating], rest: NDArray[np.floating], settings: PreprocessSettings
) -> NDArray[np.float64]:
    """Return z = C / C0, the relative capacitance of every taxel; 1 where a lead is open.

    Source: paper, section 4.1; `PreprocessSettings.normalise` for other sensors.

    Args:
        frame: One scan or several, (..., rows, columns), picofarads.
        rest: The untouched sensor, (rows, columns), same unit.
        settings: How z is made.

    Raises:
        ValueError: The two arrays differ in shape.
    """
    if frame.shape[-2:] != rest.shape:
        raise ValueError(
            f"frame {frame.shape} and rest {rest.shape} must have one shape; "
            "recalibrate after changing the sensor"
        )
    if settings.normalise == "difference":
        return np.asarray(1.0 + (frame - rest) / settings.scale, dtype=np.float64)
    lost = leadless(frame, rest)
    if not lost.any():
        return np.asarray(frame / rest, dtype=np.float64)
    return np.where(lost, 1.0, frame / np.where(lost, 1.0, rest))


def leadless(frame: NDArray[np.floating], rest: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which taxels have no lead, now or at rest; shapes as in `z_image`."""
    return np.asarray(~(np.minimum(frame, rest) > LEAST_REST * float(rest.mean())))


class Preprocessor:
    """Frame by frame: divide by rest, keep rest true, queue the window.

    Pure but for what it remembers, which `state` and `restore` carry exactly.
    """

    def __init__(
        self,
        settings: PreprocessSettings,
        rows: int,
        columns: int,
        known: Known | None = None,
        *,
        mend: bool = True,
    ) -> None:
        """Begin before the first frame.

        Args:
            settings: Of the bundle.
            rows: Of the sensor.
            columns: Likewise.
            known: What a calibration of this sensor found; play begins sooner with it, and a finger
                that lies there from the start is noticed.
            mend: Fill in taxels that feel nothing; else the image shows them as they are, and
                those without a lead as untouched.

        Raises:
            ValueError: The calibration is of a sensor of another shape.
        """
        self.settings = settings
        self.shape = (rows, columns)
        self._start = max(_LEAST, round(settings.start_s * settings.rate_hz))
        self._settle = round(settings.settle_s * settings.rate_hz)
        self._adopt = round(settings.adopt_s * settings.rate_hz)
        self._follow = 1.0 / max(1.0, settings.follow_s * settings.rate_hz)
        # The first second while there is no rest; then the latest second of unrest.
        self._frames: deque[NDArray[np.float64]] = deque(maxlen=self._start)
        self._images: deque[Image] = deque(maxlen=settings.window)
        self._rest: NDArray[np.float64] | None = None
        self._recent = np.ones(self.shape)  # slow mean of the frames, to find a steady deviation
        self._idle = 0.0  # typical deviation while quiet
        self._seen = 0  # quiet frames that made the rest image; 0: a calibration's, still on trial
        self._quiet_run = 0
        self._steady_run = 0
        self._still_frames = max(2, round(_STILL_S * settings.rate_hz))
        self._spell: deque[NDArray[np.float64]] = deque(maxlen=self._still_frames)
        self._returns: deque[NDArray[np.float64]] = deque(maxlen=_RETURNS)
        self._peak = 0.0  # greatest deviation since the latest return
        self._busy_run = 0  # frames since the sensor was quiet
        self._busy = round(_BUSY * self._adopt)
        self._soft = settings.normalise == "ratio"  # a skin: smooth, and squeezed by touch
        self._mend = mend and self._soft
        self._filler = Filler(rows, columns)
        self._answers = Answers(rows, columns, settings.rate_hz)
        if known is not None:
            if known.rest.shape != self.shape:
                raise ValueError(
                    f"the calibration is of a sensor of {known.rest.shape} taxels, this one has "
                    f"{self.shape}; calibrate anew"
                )
            self._rest, self._idle = known.rest.astype(np.float64), known.idle

    def step(self, frame: Frame) -> Prepared:
        """Take the next frame, (rows, columns) in picofarads, and return what it became.

        Raises:
            ValueError: The frame has another shape.
        """
        if frame.shape != self.shape:
            raise ValueError(f"the frame is {frame.shape}, the sensor {self.shape}; check --sensor")
        values = frame.astype(np.float64)
        if self._rest is None:
            return self._begin(values)
        if self._seen == 0:
            return self._try(values)
        return self._go_on(frame, values)

    def _go_on(self, frame: Frame, values: NDArray[np.float64]) -> Prepared:
        """Take a frame of a sensor whose rest is known."""
        rest = self._rest_image()
        lost = dead = None
        if self._soft:
            lost, dead = _any(leadless(frame, rest)), self._answers.dead
        if self._soft and lost is None:
            felt = np.asarray(frame / rest, dtype=np.float64)
        else:
            felt = z_image(frame, rest, self.settings)
        if lost is not None and self._mend:
            felt = 1.0 + self._filler.fill(felt - 1.0, lost)
        z = felt
        if dead is not None:
            z = 1.0 + self._filler.fill(felt - 1.0, dead if lost is None else dead | lost)
        image = z.astype(np.float32)
        deviation = float(np.abs(image - 1.0).mean())
        quiet = deviation < self._gate()
        if self._mend:
            self._answers.learn(felt - 1.0, self._filler, quiet=quiet)
        if lost is not None:
            values = self._without(lost, values)
        self._track(values, image, deviation, quiet)
        self._images.append(image)
        return Prepared(image, True, deviation, quiet, self._idle, lost, dead)

    def _without(self, lost: NDArray[np.bool_], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return values that leave rest as it was where leads are off, for when they are back.

        Where a lead is there now that was not there at rest, its first reading becomes its rest.
        """
        rest = self._rest_image()
        level = LEAST_REST * float(rest.mean())
        back = lost & (values > level)
        rest[back] = self._recent[back] = values[back]
        return np.where(lost, rest, values)

    @property
    def rest(self) -> Frame | None:
        """The untouched sensor, (rows, columns), picofarads; None until it is found."""
        return None if self.resting is None else self.resting.astype(np.float32)

    @property
    def resting(self) -> NDArray[np.float64] | None:
        """The same as it is kept, not to be changed."""
        return self._rest if self._seen else None

    def window(self) -> Window | None:
        """Return the latest images, (window, rows, columns), oldest first; None until full."""
        if len(self._images) < self.settings.window:
            return None
        return np.stack(self._images)

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        empty = np.empty((0, *self.shape))
        return {
            "frames": np.array(self._frames, dtype=np.float64) if self._frames else empty,
            "images": np.array(self._images, dtype=np.float64) if self._images else empty,
            "rest": empty if self._rest is None else self._rest[None],
            "recent": self._recent.copy(),
            "spell": np.array(self._spell) if self._spell else empty,
            "returns": np.array(self._returns) if self._returns else empty,
            "answers": self._answers.evidence.copy(),
            "answered": self._answers.counts.copy(),
            "scalars": np.array(
                [
                    self._idle,
                    self._seen,
                    self._quiet_run,
                    self._steady_run,
                    self._peak,
                    self._busy_run,
                ],
                dtype=np.float64,
            ),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken.

        Raises:
            ValueError: The state belongs to a sensor of another shape.
        """
        if state["recent"].shape != self.shape:
            raise ValueError(f"the state is for {state['recent'].shape}, the sensor {self.shape}")
        self._frames = deque(state["frames"], maxlen=self._start)
        images = (image.astype(np.float32) for image in state["images"])
        self._images = deque(images, maxlen=self.settings.window)
        self._rest = state["rest"][0].copy() if len(state["rest"]) else None
        self._recent = state["recent"].copy()
        self._spell = deque(state["spell"], maxlen=self._still_frames)
        self._returns = deque(state["returns"], maxlen=_RETURNS)
        self._answers.restore(state["answers"], state["answered"])
        idle, seen, quiet_run, steady_run, peak, busy_run = state["scalars"]
        self._idle, self._peak, self._busy_run = float(idle), float(peak), int(busy_run)
        self._seen, self._quiet_run, self._steady_run = int(seen), int(quiet_run), int(steady_run)

    def _gate(self) -> float:
        return self.settings.gate + self.settings.gate_noise * self._idle

    def _begin(self, values: NDArray[np.float64]) -> Prepared:
        """Gather the first quiet second; touched or moving, it is gathered anew."""
        self._frames.append(values)
        stack = np.array(self._frames)
        mean = stack.mean(axis=0)
        images = z_image(stack, mean, self.settings)
        deviations = np.abs(images - 1.0).mean(axis=(1, 2))
        half = len(stack) // 2
        still = len(stack) == self._start and self._still(images, half, float(deviations.mean()))
        if still:
            self._rest, self._recent = mean, mean.copy()
            self._idle = float(deviations.mean())
            self._seen = self._quiet_run = len(stack)
            self._images.extend(image.astype(np.float32) for image in images)
            self._frames.clear()
        return Prepared(images[-1].astype(np.float32), still, float(deviations[-1]), still)

    def _still(self, images: NDArray[np.float64], half: int, noise: float) -> bool:
        """Whether the second half of the images shows what the first half does, but for noise."""
        change = np.abs(images[:half].mean(axis=0) - images[half:].mean(axis=0)).mean()
        limit = self.settings.gate + noise / float(np.sqrt(half))
        return bool(change < limit)

    def _try(self, values: NDArray[np.float64]) -> Prepared:
        """Hold the first frames against a calibration: it may hold still, or be touched already."""
        assert self._rest is not None
        self._frames.append(values)
        mean = np.mean(self._frames, axis=0)
        image = z_image(values, self._rest, self.settings).astype(np.float32)
        deviation = float(np.abs(image - 1.0).mean())
        if len(self._frames) < self._still_frames:
            return Prepared(image, False, deviation, False)
        # What all taxels have in common is air or warmth: that may well have changed since.
        z = z_image(mean, self._rest, self.settings)
        common = float(median(z)) if self._soft else 1.0
        rest = self._rest * common
        change = z_image(mean, rest, self.settings) - 1.0
        still = float(np.abs(change).mean()) < self._gate()
        if not still and (not self._soft or drift.shape(z - 1.0) != "touch"):
            self._rest, self._idle = None, 0.0  # another sensor, or much has changed: begin anew
            return Prepared(image, False, deviation, False)
        self._rest, self._recent = rest, mean.copy()
        self._seen = self._start if still else 1
        untouched = np.ones(self.shape, dtype=np.float32)
        self._images.extend([untouched] * self.settings.window)
        frames = list(self._frames)
        self._frames.clear()
        for frame in frames:
            prepared = self._go_on(frame.astype(np.float32), frame)
        return prepared

    def _track(
        self, values: NDArray[np.float64], image: Image, deviation: float, quiet: bool
    ) -> None:
        """Follow the sensor while it is quiet; freeze under a touch."""
        assert self._rest is not None
        self._recent += self._follow * (values - self._recent)
        if quiet:
            self._forget_returns()
            self._frames.clear()
            self._quiet_run += 1
            self._steady_run = 0
            if self._quiet_run > self._settle:
                rate = max(self._follow, 1.0 / (self._seen + 1))
                self._rest += rate * (values - self._rest)
                self._idle += 0.2 * self._follow * (deviation - self._idle)
                self._seen += 1
            return
        self._quiet_run = 0
        change = z_image(values, self._recent, self.settings) - 1.0
        steady = float(np.abs(change).mean()) < self._gate()
        self._steady_run = self._steady_run + 1 if steady else 0
        if self._steady_run >= self._adopt:
            self._steady_run = 0
            if not self._looks_touched(self._recent):
                self._adopt_rest(self._recent)
        self._return(values, deviation)
        if self._soft:
            self._notice_leaving(values, image)

    def _notice_leaving(self, values: NDArray[np.float64], image: Image) -> None:
        """Take the sensor for rest once a finger has left that had been taken into it.

        After long unrest rest is old, and whatever stands still and is no touch will do as well.
        """
        self._frames.append(values)
        old = self._busy_run >= self._busy
        if len(self._frames) < self._start or drift.tone(image - np.float32(1.0)) < (
            drift.TOUCHED if old else drift.LIFTED
        ):
            return
        stack = z_image(np.array(self._frames), self._rest_image(), self.settings)
        half = len(stack) // 2
        if not self._still(stack, half, self._idle):
            return
        shape = drift.shape(stack.mean(axis=0) - 1.0)
        if shape == "lifted" or (old and shape in ("scattered", "electrode", "film")):
            self._adopt_rest(np.mean(self._frames, axis=0))

    def _looks_touched(self, values: NDArray[np.float64]) -> bool:
        """Whether a steady deviation, however old, is a hand's or a thing's that lies there."""
        if not self._soft:
            return False
        change = z_image(values, self._rest_image(), self.settings) - 1.0
        return drift.shape(change) == "touch"

    def _adopt_rest(self, values: NDArray[np.float64]) -> None:
        """Take what the sensor reads for its rest."""
        self._rest = values.copy()
        self._frames.clear()
        self._forget_returns()

    def _return(self, values: NDArray[np.float64], deviation: float) -> None:
        """Take what the sensor comes back to again and again between touches for its rest."""
        self._busy_run += 1
        self._spell.append(values)
        self._peak = max(self._peak, deviation)
        if len(self._spell) < self._still_frames:
            return
        here = np.mean(self._spell, axis=0)
        low = float(np.abs(z_image(here, self._rest_image(), self.settings) - 1.0).mean())
        if self._peak < _PEAK * low or not all(self._like(frame, here) for frame in self._spell):
            return
        self._spell.clear()
        self._peak = 0.0
        self._returns.append(here)
        alike = len(self._returns) == _RETURNS and all(self._like(r, here) for r in self._returns)
        if alike and self._busy_run >= self._busy:
            rest = np.mean(self._returns, axis=0)
            change = z_image(rest, self._rest_image(), self.settings) - 1.0
            if not self._soft or drift.unevenness(change) < _LOCAL:
                self._adopt_rest(rest)

    def _like(self, one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
        """Whether two frames differ by no more than an untouched sensor does."""
        return float(np.abs(z_image(one, other, self.settings) - 1.0).mean()) < self._gate()

    def _forget_returns(self) -> None:
        self._spell.clear()
        self._returns.clear()
        self._peak, self._busy_run = 0.0, 0

    def _rest_image(self) -> NDArray[np.float64]:
        assert self._rest is not None
        return self._rest


def _any(mask: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Return the mask, or None where it is empty."""
    return mask if mask.any() else None
