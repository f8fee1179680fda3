"""Response of a recording's taxels to touch, and faulty ones.

The measures are those of play and of the doctor, in `controller.shared.taxel_measures`; dead taxels
are found by the monitor of play.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.dead_taxels import ResponseMonitor, TaxelInterpolator
from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Preprocessor
from controller.recognition.images.scale import FIRM
from controller.recordings.quality.rest import rest_frames
from controller.recordings.recording import PICOFARAD, Recording
from controller.shared import taxel_measures
from controller.shared.aliases import Frames, Mask
from controller.shared.taxel_measures import TaxelFault

Map = NDArray[np.float64]  # (rows, columns), one number a taxel

# All taxels of a soft dome respond to a touch; on a telephone's screen 3 % of them do.
SOFT: Final = 0.2  # least share of responding taxels ...
STRONG: Final = 0.2  # ... whose response has this share of the strongest one
TOUCHES: Final = 30  # least number of touched frames to detect dead taxels
LEAST_PF: Final = 0.01  # least valid reading; a loose lead still couples 1 pF
FASTEST_HZ: Final = 200.0  # limit of the device's stages; bounds the work
# Without a known gate, a touch begins at this share of the range from idle to firm.
TOUCHED: Final = 0.2
IDLE_SHARE: Final = 0.05  # quantile of the energy that counts as idle
FIRM_SHARE: Final = 0.95  # and as a firm touch
LEAST_FRAMES: Final = 6  # of the untouched sensor, for the device's stage to begin with
RARE: Final = 0.995  # quantile of the strength that is a firm touch even where touches are rare


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Response of the sensor in n frames."""

    change: Frames  # from rest: z - 1 in pF, else in the recording's unit, (n, rows, columns)
    energy: NDArray[np.float64]  # mean of |change| over the taxels, (n,)
    known: NDArray[np.bool_]  # whether the rest is known, so that the two above are valid, (n,)
    touched: NDArray[np.bool_]  # (n,)

    @property
    def idle(self) -> NDArray[np.bool_]:
        """Whether the sensor is known to be untouched, (n,)."""
        return self.known & ~self.touched


def respond(recording: Recording) -> Response:
    """Return the response by the device's own stage; else, if it finds no rest, by a fixed one."""
    if not recording.origin.signal.ratio:
        return _counted(recording)
    rest = recording.rest if recording.rest is not None else _middle(recording)
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


def _counted(recording: Recording) -> Response:
    """Return the response in another unit, by the device's stage, which begins at rest."""
    frames = recording.frames
    rate_hz = min(recording.origin.rate_hz, FASTEST_HZ)
    still = rest_frames(frames, rate_hz) if recording.rest is None else recording.rest[None]
    rest = np.median(still, axis=0).astype(np.float32)
    first = _fixed(frames - rest)
    firm = _firm(first.energy)
    if not firm > 0.0:
        return first
    settings = PreprocessSettings("difference", firm / FIRM, rate_hz)
    stage = Preprocessor(settings, *rest.shape)
    before = max(LEAST_FRAMES, round(settings.start_s * rate_hz))
    for number in range(before):
        stage.step(still[number % len(still)])
    if stage.resting is None:
        return first
    steps = [stage.step(frame) for frame in frames]
    change = np.array([step.image for step in steps], dtype=np.float32) - np.float32(1.0)
    return Response(
        change * np.float32(settings.scale),
        np.array([step.deviation for step in steps]) * settings.scale,
        known=np.ones(len(frames), dtype=np.bool_),
        touched=np.array([not step.quiet for step in steps]),
    )


def _firm(strength: NDArray[np.floating]) -> float:
    """Return the strength, (n,), of a firm touch, however rare touches are."""
    top = float(np.quantile(strength, RARE))
    return float(np.median(strength[strength >= top / 2.0]))


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


def examine(recording: Recording, response: Response) -> list[TaxelFault]:
    """Return the faults of a recording's taxels, given the sensor's response."""
    frames, unit = recording.frames, recording.origin.unit
    judged = not unjudged(response)
    if unit == PICOFARAD:
        found = taxel_measures.faults(frames, response.change, response.idle)
    else:  # counts stay the same where nothing touches
        stuck = frames.min(axis=0) == frames.max(axis=0)
        stuck &= stuck.all() or judged
        clipped = taxel_measures.clipped(frames) & ~stuck
        found = [
            TaxelFault("stuck", stuck, "stuck, always the same reading"),
            TaxelFault("saturated", clipped, f"saturated, at {frames.max():.4g} {unit}"),
        ]
    dead = _dead(recording, response) if judged else None
    if dead is not None:
        dead = dead & ~taxel_measures.useless(found, dead.shape)
        found.append(TaxelFault("dead", dead, "dead, no response to touches on it"))
    return [one for one in found if one.mask.any()]


def unjudged(response: Response) -> str:
    """Return the reason that dead taxels cannot be detected; "" if they can."""
    touched = response.known & response.touched
    if touched.sum() < TOUCHES or not response.idle.any():
        return "it is touched too little to detect dead taxels"
    size = np.abs(response.change[touched])
    responding = (size > STRONG * size.max(axis=(1, 2), keepdims=True)).mean(axis=(1, 2))
    if np.median(responding) < SOFT:
        return "few taxels respond to each touch, so dead ones cannot be detected"
    return ""


def _dead(recording: Recording, response: Response) -> Mask | None:
    """Return the taxels that the monitor of play finds dead, (rows, columns); None: none."""
    change = response.change.astype(np.float64)
    if recording.origin.unit != PICOFARAD:  # as strong as on the orb, where a touch lowers z
        firm = float(np.median(response.energy[response.touched]))
        change *= -recording.origin.sign * FIRM / firm
    _, rows, columns = change.shape
    monitor = ResponseMonitor(rows, columns, recording.origin.rate_hz)
    interpolator = TaxelInterpolator(rows, columns)
    for one in change[response.known]:
        monitor.learn(one, interpolator)
    return monitor.dead
