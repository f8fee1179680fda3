"""Response of the taxels to touch, and faulty ones: stuck, saturated, loose, shorted, dead, noisy.

Rows and columns count from the top left, from 0, as in docs/simulator.md. The definition of dead
taxels is that of the device, in `recognition.dead_taxels`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.dead_taxels import (
    DEAD_SLOPE,
    TaxelInterpolator,
    response_slope,
    without_lead,
)
from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Preprocessor
from controller.recognition.images.scale import FIRM
from controller.recognition.images.sensor_health import taxel_names
from controller.recordings.quality.rest import rest_frames
from controller.recordings.recording import PICOFARAD, Recording
from controller.shared.aliases import Frames, Mask

Map = NDArray[np.float64]  # (rows, columns), one number a taxel

# Sound taxels scatter up to 2.06 times as much as the middle one, leaky ones 2.7 times and more.
NOISY: Final = 2.3
# Two sound taxels differ by 10 % (paper, section 3.2: 41.2 pF, standard deviation 2.9); those of
# electrodes that touch read the same sum.
SAME: Final = 0.015
MORE: Final = 1.2  # ... and so much more than all others; through the divider, 1.5 times
# A converter that clips gives its highest number again and again; others hardly ever.
CLIPPED_SHARE: Final = 0.02
CLIPPED_TAXELS: Final = 2  # one taxel alone at the top may just be the one that reads most
STUCK_SHARE: Final = 0.9  # of its readings repeat the one before
LIVELY_SHARE: Final = 0.5  # ... where so few of the middle taxel's do
# All taxels of a soft dome respond to a touch; on a telephone's screen 3 % of them do.
SOFT: Final = 0.2  # least share of responding taxels ...
STRONG: Final = 0.2  # ... whose response has this share of the strongest one
PLACES: Final = 3  # neighbours at which touches are strongest, to call a taxel dead in other units
TOUCHES: Final = 30  # least number of touched frames to detect dead taxels
IDLES: Final = 20  # least number of pairs of untouched frames to detect noise
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


@dataclass(frozen=True, slots=True, eq=False)
class TaxelFinding:
    """A fault of taxels."""

    kind: str  # "stuck", "saturated", "loose", "short", "dead" or "noisy"
    mask: Mask  # of the taxels, (rows, columns)
    text: str  # a sentence about them
    useless: bool = True  # they do not respond to touch


def useless(found: Sequence[TaxelFinding], response: Response) -> Mask:
    """Return the taxels that do not respond to touch, (rows, columns)."""
    masks = [one.mask for one in found if one.useless]
    none = np.zeros(response.change.shape[1:], dtype=np.bool_)
    return np.asarray(np.any([none, *masks], axis=0))


def examine(frames: Frames, unit: str, response: Response) -> list[TaxelFinding]:
    """Return the faults of the taxels in frames of a unit, and the sensor's response in them."""
    found: list[TaxelFinding] = []
    unknown = bool(unjudged(response))

    def add(kind: str, mask: Mask, text: str, useless: bool = True) -> None:
        if mask.any():
            found.append(TaxelFinding(kind, mask, f"{taxel_names(mask)}: {text}", useless))

    stuck = _stuck(frames, unit, unknown)
    add("stuck", stuck, "stuck, always the same reading")
    clipped = _clipped(frames) & ~stuck
    add("saturated", clipped, f"saturated, at {frames.max():.4g} {unit}")
    if unit == PICOFARAD:
        level = np.median(frames, axis=0).astype(np.float64)
        loose = without_lead(level) & ~(stuck | clipped)
        add("loose", loose, f"{np.mean(level, where=loose) if loose.any() else 0:.2g} pF where the "
            f"others read {np.median(level):.2g}; a lead is off")  # fmt: skip
        for pair, mask in _shorts(level, useless(found, response)):
            text = f"{pair}: equal readings; do they touch?"
            found.append(TaxelFinding("short", mask, text, useless=False))
    if unknown:
        return found
    slope = _slope(response, useless(found, response))
    dead = slope < DEAD_SLOPE
    if unit != PICOFARAD:
        dead &= _surrounded(response)
    add("dead", dead, f"dead (follows its neighbours with {100 * np.nanmedian(slope[dead]):.0f} %)"
        if dead.any() else "")  # fmt: skip
    noisy = _noisy(response) & ~useless(found, response)
    add("noisy", noisy, "noisy; does a contact leak?", useless=False)
    return found


def unjudged(response: Response) -> str:
    """Return the reason that dead and noisy taxels cannot be detected; "" if they can."""
    touched = response.known & response.touched
    if touched.sum() < TOUCHES or not response.idle.any():
        return "it is touched too little to detect dead taxels"
    size = np.abs(response.change[touched])
    responding = (size > STRONG * size.max(axis=(1, 2), keepdims=True)).mean(axis=(1, 2))
    if np.median(responding) < SOFT:
        return "few taxels respond to each touch, so dead ones cannot be detected"
    return ""


def _stuck(frames: Frames, unit: str, unknown: bool) -> Mask:
    """Return the taxels that hardly change while the others do, (rows, columns)."""
    stuck = frames.min(axis=0) == frames.max(axis=0)
    if unit != PICOFARAD:  # counts stay the same where nothing touches
        return np.asarray(stuck & (stuck.all() or not unknown))
    if len(frames) >= IDLES:
        still = (frames[1:] == frames[:-1]).mean(axis=0)
        stuck |= (still > STUCK_SHARE) & (np.median(still) < LIVELY_SHARE)
    return np.asarray(stuck)


def _clipped(frames: Frames) -> Mask:
    """Return the taxels that repeat the highest number of all, (rows, columns)."""
    often = (frames == frames.max()).mean(axis=0) > CLIPPED_SHARE
    return np.asarray(often & (often.sum() >= CLIPPED_TAXELS))


def _slope(response: Response, useless: Mask) -> Map:
    """Return the slope of each taxel against its neighbours under touch; NaN if unknown."""
    interpolator = TaxelInterpolator(*useless.shape)
    touched = response.change[response.known & response.touched].astype(np.float64)
    changes = np.array([interpolator.fill(change, useless) for change in touched])
    around = np.array([interpolator.around(change) for change in changes])
    slope = response_slope((changes * around).sum(axis=0), np.square(around).sum(axis=0))
    return np.where(useless, np.nan, slope)


def _surrounded(response: Response) -> Mask:
    """Return the taxels beside which touches were strongest at several places, (rows, columns).

    Beyond the rim of a local touch, or of one that is always held in one place, taxels are sound.
    """
    size = np.abs(response.change[response.known & response.touched])
    rows, columns = size.shape[1:]
    peaks = np.bincount(size.reshape(len(size), -1).argmax(axis=1), minlength=rows * columns)
    place = np.pad(peaks.reshape(rows, columns) > 0, 1)
    around = sum(
        place[y : y + rows, x : x + columns].astype(np.int64)
        for y in range(3) for x in range(3) if (y, x) != (1, 1)
    )  # fmt: skip
    return np.asarray(around >= PLACES)


def _noisy(response: Response) -> Mask:
    """Return the taxels with far more noise than the others while untouched."""
    idle = response.idle
    pairs = idle[1:] & idle[:-1]
    if pairs.sum() < IDLES:
        return np.zeros(response.change.shape[1:], dtype=np.bool_)
    own = response.change - np.median(response.change, axis=(1, 2), keepdims=True)
    scatter = np.diff(own, axis=0)[pairs].std(axis=0)
    middle = np.median(scatter)
    return np.asarray((scatter > NOISY * middle) & (middle > 0.0))


def _shorts(level: Map, useless: Mask) -> Iterator[tuple[str, Mask]]:
    """Yield pairs of electrodes with equal readings, and their taxels."""
    for word, lines, bad in (("rows", level, useless), ("columns", level.T, useless.T)):
        if min(lines.shape) < 3:
            continue
        for i in range(len(lines) - 1):
            pair = lines[i : i + 2]
            apart = np.abs(pair[0] - pair[1])
            if bad[i : i + 2].any() or not (apart < SAME * pair[1]).all():
                continue
            if np.median(pair) > MORE * np.median(np.delete(lines, [i, i + 1], axis=0)):
                mask = np.zeros_like(bad)
                mask[i : i + 2] = True
                yield f"{word} {i} and {i + 1}", mask if word == "rows" else mask.T
