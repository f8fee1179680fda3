"""Response of a sensor in a recording: the deviation of every taxel from rest."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.frames import PreprocessSettings
from controller.recognition.preprocess import Preprocessor
from controller.recordings.recording import PICOFARAD, Recording

LEAST_PF: Final = 0.01  # least valid reading; a loose lead still couples 1 pF
FASTEST_HZ: Final = 200.0  # limit of the device's stages; bounds the work
# Without a known gate, a touch begins at this share of the range from idle to firm.
TOUCHED: Final = 0.2
IDLE_SHARE: Final = 0.05  # quantile of the energy that counts as idle
FIRM_SHARE: Final = 0.95  # and as a firm touch


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Response of the sensor in n frames.

    Attributes:
        change: Deviation of each taxel from rest: z - 1 if the unit is pF, else in the unit of
            the recording, (n, rows, columns).
        energy: Mean of |change| over the taxels, (n,).
        known: Whether the rest is known, so that the two above are valid, (n,).
        touched: Whether the sensor is touched, (n,).
    """

    change: NDArray[np.float32]
    energy: NDArray[np.float64]
    known: NDArray[np.bool_]
    touched: NDArray[np.bool_]

    @property
    def idle(self) -> NDArray[np.bool_]:
        """Whether the sensor is known to be untouched, (n,)."""
        return self.known & ~self.touched


def respond(recording: Recording) -> Response:
    """Return the response: in picofarads by the device's own stage, else by a fixed rest."""
    rest = recording.rest if recording.rest is not None else _middle(recording)
    if recording.origin.unit != PICOFARAD:
        return _fixed((recording.frames - rest).astype(np.float32))
    followed = _followed(recording)
    if followed.known.any():
        return followed
    # The sensor was never untouched for a second, so the device's stage found no baseline.
    change = recording.frames / np.where(rest > LEAST_PF, rest, np.inf)
    return _fixed(np.where(rest > LEAST_PF, change - 1.0, 0.0).astype(np.float32))


def _middle(recording: Recording) -> NDArray[np.float32]:
    """Return the median of each taxel, (rows, columns)."""
    return np.asarray(np.median(recording.frames, axis=0), dtype=np.float32)


def _followed(recording: Recording) -> Response:
    """Return the response by the device's preprocessor."""
    frames = recording.frames
    reads = _middle(recording) > LEAST_PF
    frames = np.where(reads & (frames > LEAST_PF), frames, np.where(reads, LEAST_PF, 1.0))
    rate_hz = min(recording.origin.rate_hz, FASTEST_HZ)
    settings = PreprocessSettings(rate_hz=rate_hz)
    stage = Preprocessor(settings, *frames.shape[1:], mend=False)  # keeps dead taxels visible
    steps = [stage.step(frame) for frame in frames.astype(np.float32)]
    return Response(
        np.array([step.image for step in steps], dtype=np.float32) - np.float32(1.0),
        np.array([step.deviation for step in steps]),
        known=np.array([step.ready for step in steps]),
        touched=np.array([step.ready and not step.quiet for step in steps]),
    )


def _fixed(change: NDArray[np.float32]) -> Response:
    """Return the response to a fixed rest, from the change, (n, rows, columns)."""
    energy = np.abs(change).mean(axis=(1, 2), dtype=np.float64)
    idle, firm = np.quantile(energy, (IDLE_SHARE, FIRM_SHARE))
    return Response(
        change,
        energy,
        known=np.ones(len(change), dtype=np.bool_),
        touched=energy > idle + TOUCHED * (firm - idle),
    )
