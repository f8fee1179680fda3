"""Frames and images: their types, the settings of preprocessing, and z = C / C0."""

from dataclasses import dataclass, field, replace
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from controller.shared.taxel_measures import leadless

Frame = NDArray[np.float32]  # (rows, columns), picofarads
Image = NDArray[np.float32]  # (rows, columns), C / C0, 1.0 where untouched
Window = NDArray[np.float32]  # (images, rows, columns), oldest first
Normalise = Literal["ratio", "difference"]

MOST_WINDOW: Final = 250  # images in a window
_RATE_TOLERANCE: Final = 0.02  # greatest relative difference between the rates of data and network


@dataclass(frozen=True, slots=True)
class PreprocessSettings:
    """Settings of images, windows and baseline; stored in the bundle.

    Attributes:
        normalise: "ratio": z = C / C0, for capacitances; "difference": z = 1 + (C - C0) / scale,
            for sensors that read about 0 untouched.
        scale: Unit of "difference", in the frame's unit: a firm touch shall be as strong as on
            the orb (mean |z - 1| about .08). Below zero a touch that raises the readings lowers z.
        rate_hz: Frames per second.
        window: Images in a window; paper, section 4.1: 10 at 10 Hz.
        start_s: Quiet time for the first rest image.
        follow_s: Time constant of baseline tracking.
        settle_s: Quiet time after a touch before tracking continues.
        gate: Deviation (mean of |z - 1|) below which a noiseless sensor is quiet.
        gate_noise: Multiple of the measured idle deviation that is added to the gate.
        adopt_s: Age at which a steady deviation becomes the baseline, unless it has the shape of
            a touch, which "difference" never has (`controller.recognition.images.drift`).
        beside: Share of the strength of what lies on the sensor, by which a contact that begins
            beside it is told at least; 0: none is looked for (`images.lying`).
    """

    normalise: str = field(default="ratio", metadata={"choices": get_args(Normalise)})
    scale: float = field(default=1.0, metadata={"range": (1e-9, 1e9)})  # images stay finite
    rate_hz: float = field(default=10.0, metadata={"range": (0.1, 1000.0)})
    window: int = field(default=10, metadata={"range": (1, MOST_WINDOW)})
    start_s: float = field(default=1.0, metadata={"range": (0.0, 100.0)})  # all its frames are kept
    follow_s: float = 2.0
    settle_s: float = 0.4
    gate: float = 0.015
    gate_noise: float = 1.2
    adopt_s: float = 30.0
    beside: float = field(default=0.0, metadata={"range": (0.0, 10.0)})

    def __post_init__(self) -> None:
        if self.normalise not in get_args(Normalise) or not abs(self.scale) > 0.0:
            raise ValueError(
                f"normalise {self.normalise!r} with scale {self.scale!r}; it is "
                f"{' or '.join(get_args(Normalise))}, with a scale other than 0"
            )

    @property
    def plain(self) -> "PreprocessSettings":
        """The same without contacts beside others, as windows are that are learned from."""
        return replace(self, beside=0.0)


def same_rate(one_hz: float, other_hz: float, within: float = _RATE_TOLERANCE) -> bool:
    """Return whether frames at one rate fit networks of the other, within 2 %."""
    return abs(one_hz / other_hz - 1.0) <= within


def z_image(
    frame: NDArray[np.floating], rest: NDArray[np.floating], settings: PreprocessSettings
) -> NDArray[np.float64]:
    """Return z = C / C0, the relative capacitance of every taxel; 1 where a lead is open.

    Source: paper, section 4.1; `PreprocessSettings.normalise` for other sensors.

    Args:
        frame: One scan or several, (..., rows, columns), picofarads.
        rest: The untouched sensor, (rows, columns), same unit.
        settings: Normalisation and scale.

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
