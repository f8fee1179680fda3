"""Turn frames into images and windows: the way every frame takes, in training and on the device.

Every frame is divided by the rest image, which `controller.recognition.baseline` keeps true; taxels
that feel nothing are filled in; and the latest images queue for the network.
"""

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.recognition.baseline import BaselineTracker, StoredBaseline
from controller.recognition.dead_taxels import ResponseMonitor, TaxelInterpolator
from controller.recognition.frames import (
    LEAST_REST,
    Frame,
    Image,
    Normalise,
    PreprocessSettings,
    State,
    Window,
    leadless,
    z_image,
)

__all__ = [
    "LEAST_REST",
    "Frame",
    "Image",
    "Normalise",
    "Prepared",
    "PreprocessSettings",
    "Preprocessor",
    "State",
    "StoredBaseline",
    "Window",
    "leadless",
    "z_image",
]


@dataclass(frozen=True, slots=True)
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


class Preprocessor:
    """Frame by frame: divide by rest, keep rest true, queue the window.

    Pure but for what it remembers, which `state` and `restore` carry exactly.
    """

    def __init__(
        self,
        settings: PreprocessSettings,
        rows: int,
        columns: int,
        known: StoredBaseline | None = None,
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
        if known is not None and known.rest.shape != self.shape:
            raise ValueError(
                f"the calibration is of a sensor of {known.rest.shape} taxels, this one has "
                f"{self.shape}; calibrate anew"
            )
        self._images: deque[Image] = deque(maxlen=settings.window)
        self._rest = BaselineTracker(settings, self.shape, known)
        self._soft = settings.normalise == "ratio"  # a skin: smooth, and squeezed by touch
        self._mend = mend and self._soft
        self._filler = TaxelInterpolator(rows, columns)
        self._answers = ResponseMonitor(rows, columns, settings.rate_hz)
        self._owed: tuple[Any, ...] = ()  # what `settle` learns from

    def step(self, frame: Frame) -> Prepared:
        """Take the next frame, (rows, columns) in picofarads, and return what it became.

        Raises:
            ValueError: The frame has another shape.
        """
        if frame.shape != self.shape:
            raise ValueError(f"the frame is {frame.shape}, the sensor {self.shape}; check --sensor")
        self.settle()
        values = frame.astype(np.float64)
        if self._rest.image is None:
            return self._begin(values)
        if self._rest.seen == 0:
            return self._try(values, self._rest.image)
        return self._go_on(frame, values)

    def settle(self) -> None:
        """Learn from the latest frame what only the next one needs: rest, and which taxels answer.

        Whoever is in a hurry calls it when the frame's answer is out; the next step does at last.
        """
        if not self._owed:
            return
        (felt, lost, values, image, deviation, quiet), self._owed = self._owed, ()
        if self._mend:
            self._answers.learn(felt - 1.0, self._filler, quiet=quiet)
        if lost is not None:
            values = self._rest.without(lost, values)
        self._rest.step(values, image, deviation, quiet=quiet)

    @property
    def rest(self) -> Frame | None:
        """The untouched sensor, (rows, columns), picofarads; None until it is found."""
        return None if self.resting is None else self.resting.astype(np.float32)

    @property
    def resting(self) -> NDArray[np.float64] | None:
        """The same as it is kept, not to be changed."""
        self.settle()
        return self._rest.image if self._rest.seen else None

    def window(self) -> Window | None:
        """Return the latest images, (window, rows, columns), oldest first; None until full."""
        if len(self._images) < self.settings.window:
            return None
        return np.array(self._images)

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        self.settle()
        images = np.array(self._images, dtype=np.float64).reshape(-1, *self.shape)
        return {
            **self._rest.state(),
            "images": images,
            "answers": self._answers.evidence.copy(),
            "answered": self._answers.counts.copy(),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken.

        Raises:
            ValueError: The state belongs to a sensor of another shape.
        """
        if state["recent"].shape != self.shape:
            raise ValueError(f"the state is for {state['recent'].shape}, the sensor {self.shape}")
        self._owed = ()
        self._rest.restore(state)
        images = (image.astype(np.float32) for image in state["images"])
        self._images = deque(images, maxlen=self.settings.window)
        self._answers.restore(state["answers"], state["answered"])

    def _begin(self, values: NDArray[np.float64]) -> Prepared:
        """Take a frame of a sensor whose rest nobody knows."""
        images = self._rest.begin(values)
        found = self._rest.image is not None
        if found:
            self._images.extend(image.astype(np.float32) for image in images)
        deviation = float(np.mean(np.abs(images[-1] - 1.0)))
        return Prepared(images[-1].astype(np.float32), found, deviation, found)

    def _try(self, values: NDArray[np.float64], known: NDArray[np.float64]) -> Prepared:
        """Take one of the first frames of a sensor that was calibrated."""
        image = z_image(values, known, self.settings).astype(np.float32)
        prepared = Prepared(image, False, float(np.mean(np.abs(image - 1.0))), False)
        frames = self._rest.try_known(values)
        if frames:
            untouched = np.ones(self.shape, dtype=np.float32)
            self._images.extend([untouched] * self.settings.window)
        for frame in frames:
            self.settle()
            prepared = self._go_on(frame.astype(np.float32), frame)
        return prepared

    def _go_on(self, frame: Frame, values: NDArray[np.float64]) -> Prepared:
        """Take a frame of a sensor whose rest is known."""
        rest = self._rest.certain
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
        deviation = float(np.mean(np.abs(image - 1.0)))
        quiet = deviation < self._rest.gate
        self._owed = felt, lost, values, image, deviation, quiet
        self._images.append(image)
        return Prepared(image, True, deviation, quiet, self._rest.idle, lost, dead)


def _any(mask: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Return the mask, or None where it is empty."""
    return mask if mask.any() else None
