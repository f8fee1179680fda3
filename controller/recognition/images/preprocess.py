"""Preprocessing of frames to images and windows, the same in training and on the device.

Every frame is divided by the rest image of `controller.recognition.images.baseline`, dead taxels
are interpolated, and the latest images form the window of the network.
"""

from collections import deque
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from controller.recognition.images.baseline import BaselineTracker, StoredBaseline
from controller.recognition.images.dead_taxels import ResponseMonitor, TaxelInterpolator
from controller.recognition.images.drift import mean_of
from controller.recognition.images.frames import Frame, Image, PreprocessSettings, Window, z_image
from controller.recognition.images.lying import LyingContact
from controller.recognition.images.scale import SKIN, ScaleEstimator, Signal
from controller.shared.aliases import Mask, Reading, State
from controller.shared.taxel_measures import leadless


@dataclass(frozen=True, slots=True)
class Prepared:
    """Result of one frame.

    Attributes:
        image: z = C / C0, (rows, columns).
        ready: The rest image exists; before that the image is a provisional one.
        deviation: Mean of |z - 1| over the taxels.
        quiet: Nothing touches, by the noise of the taxels.
        idle: Mean deviation while nothing touches; 0 until it is known.
        lost: Taxels with an open lead, (rows, columns), interpolated in the image; None: none.
        dead: Dead taxels, interpolated in the same way.
        added: z without what lay there before the newest contact, (rows, columns); None: z.
        begun: That contact has begun in this frame.
    """

    image: Image
    ready: bool
    deviation: float
    quiet: bool
    idle: float = 0.0
    lost: Mask | None = None
    dead: Mask | None = None
    added: Image | None = None
    begun: bool = False

    @property
    def beside(self) -> bool:
        """Whether other contacts lie beside the newest one."""
        return self.added is not None and self.added is not self.image

    @property
    def broken(self) -> int:
        """Number of taxels that are interpolated."""
        found = [one for one in (self.lost, self.dead) if one is not None]
        return int(np.any(found, axis=0).sum()) if found else 0


class _Measured(NamedTuple):
    """One frame before `learn`; arrays are (rows, columns)."""

    values: Reading
    felt: Reading  # z before dead taxels were interpolated
    strength: float  # of the strongest place
    prepared: Prepared


class Preprocessor:
    """Preprocessing frame by frame, with its state.

    `state` and `restore` carry the state exactly. `step` is `measure` and `learn`; a caller that
    needs the result early calls these two in turn.

    Attributes:
        pressed: The networks find a press likely beside what lies, which was answered.
    """

    def __init__(
        self,
        settings: PreprocessSettings,
        rows: int,
        columns: int,
        known: StoredBaseline | None = None,
        *,
        mend: bool = True,
        signal: Signal = SKIN,
    ) -> None:
        """Begin before the first frame.

        Args:
            settings: Of images, windows and baseline.
            rows: Rows of taxels.
            columns: Columns of taxels.
            known: Calibration of this sensor: the first window comes sooner, and a finger present
                from the start is detected.
            mend: Interpolate dead taxels; else the image shows them as measured, and those
                with an open lead as untouched.
            signal: Unit and sign of the sensor; one that is not divided by rest begins without
                its calibration, which is for quotients.

        Raises:
            ValueError: The calibration is of a sensor of another shape.
        """
        self.shape = (rows, columns)
        if known is not None and known.rest.shape != self.shape:
            raise ValueError(
                f"the calibration is of a sensor of {known.rest.shape} taxels, this one has "
                f"{self.shape}; calibrate it again"
            )
        self.settings = signal.fit(settings)
        self._scale: ScaleEstimator | None = None
        if self.settings is not settings:
            known = None
            if not signal.scale:
                self._scale = ScaleEstimator(settings.rate_hz, self.shape, signal.learned)
        settings = self.settings
        self._images: deque[Image] = deque(maxlen=settings.window)
        self._rest = BaselineTracker(settings, self.shape, known)
        self._soft = settings.normalise == "ratio"  # a skin: smooth, and squeezed by touch
        self._mend = mend and self._soft
        self._lying = LyingContact(rows, columns, settings.rate_hz, settings.beside)
        self.pressed = False
        self._interpolator = TaxelInterpolator(rows, columns)
        self._responses = ResponseMonitor(rows, columns, settings.rate_hz)
        self._measured: _Measured | None = None  # for `learn`

    def step(self, frame: Frame) -> Prepared:
        """Process the next frame, (rows, columns) in picofarads.

        Raises:
            ValueError: The frame has another shape.
        """
        prepared = self.measure(frame)
        self.learn()
        return prepared

    def measure(self, frame: Frame) -> Prepared:
        """Process the next frame, (rows, columns), without `learn`; else as `step`."""
        if frame.shape != self.shape:
            raise ValueError(f"the frame is {frame.shape}, the sensor {self.shape}; check --sensor")
        values = frame.astype(np.float64)
        if self._rest.image is None:
            if self._scale is not None:
                self._rescale(self._scale.begin(values))
            return self._begin(values)
        if self._rest.seen == 0:
            return self._try(values, self._rest.image)
        return self._go_on(frame, values, self._rest.image)

    def learn(self) -> None:
        """Update baseline and dead taxels by the latest frame."""
        if self._measured is None:
            return
        (values, felt, strength, prepared), self._measured = self._measured, None
        if self._mend:
            self._responses.learn(felt - 1.0, self._interpolator)
        if prepared.lost is not None:
            values = self._rest.without(prepared.lost, values)
        deviation, quiet = prepared.deviation, prepared.quiet
        firm = deviation >= self._rest.noise.gate
        self._rest.step(values, prepared.image, deviation, strength, quiet=quiet)
        if self._scale is not None and firm:
            self._rescale(self._scale.learn(deviation))

    def anew(self) -> "Preprocessor":
        """Return the stage before its first frame, with the scale that was learned."""
        stage = Preprocessor(self.settings, *self.shape)
        stage._scale = self._scale
        return stage

    def look_beside(self, share: float) -> None:
        """Look for contacts beside others from that share of their strength on; 0: for none."""
        if share != self.settings.beside:
            self.settings = replace(self.settings, beside=share)
            self._lying = LyingContact(*self.shape, self.settings.rate_hz, share)

    @property
    def rest(self) -> Frame | None:
        """The untouched sensor, (rows, columns), picofarads; None until it is found."""
        return None if self.resting is None else self.resting.astype(np.float32)

    @property
    def resting(self) -> Reading | None:
        """The same array as it is tracked, (rows, columns); not to be changed."""
        return self._rest.image if self._rest.seen else None

    @property
    def learned(self) -> float:
        """Scale learned from touches; 0: none, or not yet."""
        return 0.0 if self._scale is None else self._scale.learned

    def window(self) -> Window | None:
        """Return the latest images, (window, rows, columns), oldest first; None until full."""
        if len(self._images) < self.settings.window:
            return None
        return self._lying.window(np.array(self._images))

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        images = np.array(self._images, dtype=np.float64).reshape(-1, *self.shape)
        return {
            **self._rest.state(),
            **self._lying.state(),
            "images": images,
            "answers": self._responses.evidence.copy(),
            "answered": self._responses.counts.copy(),
            **({} if self._scale is None else self._scale.state()),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken.

        Raises:
            ValueError: The state belongs to a sensor of another shape.
        """
        if state["noise"].shape != self.shape:
            raise ValueError(f"the state is for {state['noise'].shape}, the sensor {self.shape}")
        self._measured = None
        if self._scale is not None:
            self._scale.restore(state)
            self._rescale(self._scale.scale)
        self._rest.restore(state)
        images = (image.astype(np.float32) for image in state["images"])
        self._images = deque(images, maxlen=self.settings.window)
        self._lying.restore(state)
        self._responses.restore(state["answers"], state["answered"])

    def _rescale(self, scale: float) -> None:
        """Divide by another scale from the next frame on."""
        if scale != abs(self.settings.scale):
            sign = float(np.sign(self.settings.scale))
            self.settings = replace(self.settings, scale=sign * scale)
            self._rest.rescale(self.settings)

    def _begin(self, values: Reading) -> Prepared:
        """Process a frame, (rows, columns), before there is a baseline."""
        images = self._rest.begin(values)
        found = self._rest.image is not None
        if found:
            self._images.extend(image.astype(np.float32) for image in images)
        deviation = float(np.abs(images[-1] - 1.0).mean())
        return Prepared(images[-1].astype(np.float32), found, deviation, found)

    def _try(self, values: Reading, known: Reading) -> Prepared:
        """Process one of the first frames of a calibrated sensor, (rows, columns)."""
        image = z_image(values, known, self.settings).astype(np.float32)
        prepared = Prepared(image, False, mean_of(np.abs(image - 1.0)), False)
        frames = self._rest.try_known(values)
        if frames:
            untouched = np.ones(self.shape, dtype=np.float32)
            self._images.extend([untouched] * self.settings.window)
        for frame in frames:
            self.learn()
            assert self._rest.image is not None
            prepared = self._go_on(frame.astype(np.float32), frame, self._rest.image)
        return prepared

    def _go_on(self, frame: Frame, values: Reading, rest: Reading) -> Prepared:
        """Process a frame, (rows, columns), with a baseline."""
        lost = dead = None
        if self._soft and (off := leadless(frame, rest)).any():
            lost = off
        if self._soft and lost is None:
            felt = np.asarray(frame / rest, dtype=np.float64)
        else:
            felt = z_image(frame, rest, self.settings)
        if lost is not None and self._mend:
            felt = 1.0 + self._interpolator.fill(felt - 1.0, lost)
        z = felt
        if self._soft and (dead := self._responses.dead) is not None:
            z = 1.0 + self._interpolator.fill(felt - 1.0, dead if lost is None else dead | lost)
        image = z.astype(np.float32)
        deviation, noise = mean_of(np.abs(image - 1.0)), self._rest.noise
        strength = noise.strength(image)
        quiet = not noise.touched(deviation, strength)
        begun = self._lying.step(image, noise.idle, pressed=self.pressed)
        added = self._lying.added(image)
        prepared = Prepared(image, True, deviation, quiet, noise.idle, lost, dead, added, begun)
        self._measured = _Measured(values, felt, strength, prepared)
        self._images.append(image)
        return prepared
