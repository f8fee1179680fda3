"""Response of a recording's taxels to touch, and faulty taxels by `shared.taxel_measures`."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.dead_taxels import TaxelInterpolator
from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Preprocessor
from controller.recognition.images.scale import FIRM
from controller.recordings.recording import PICOFARAD, Recording
from controller.shared import blocks, taxel_measures
from controller.shared.aliases import Array, Frames, Mask
from controller.shared.taxel_measures import DEAD_SLOPE, TaxelFault, useless

Map = NDArray[np.float64]  # (rows, columns), one number a taxel

# All taxels of a soft dome respond to a touch; on a telephone's screen 3 % of them do.
SOFT: Final = 0.2  # least share of responding taxels ...
STRONG: Final = 0.2  # ... whose response has this share of the strongest one
# A dead taxel's change under touch over that without, root mean squares: 0.99 to 1.08 on paper-snr.
SILENT: Final = 1.2
LOADED: Final = 0.3  # and over the median taxel's, where a finger loads the row
NEAR: Final = 1.5  # least change of a taxel's neighbours under touch, of that without: both rms
SAMPLED: Final = 2000  # untouched frames, for the latter
PLACES: Final = 3  # neighbours at which touches are strongest, to call a taxel dead in other units
TOUCHES: Final = 30  # least number of touched frames to detect dead taxels
LEAST_PF: Final = 0.01  # least valid reading; a loose lead still couples 1 pF
FASTEST_HZ: Final = 200.0  # limit of the device's stages; bounds the work
# Without a known gate, a touch begins at this share of the range from idle to firm.
TOUCHED: Final = 0.2
IDLE_SHARE: Final = 0.05  # quantile of the energy that counts as idle
FIRM_SHARE: Final = 0.95  # and as a firm touch
REST_S: Final = 0.5  # of an untouched sensor
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
    frames, signal = recording.frames, recording.origin.signal
    rate_hz = min(recording.origin.rate_hz, FASTEST_HZ)
    settings = PreprocessSettings(rate_hz=rate_hz)
    if signal.ratio:
        middle = blocks.median(frames).astype(np.float32)
        rest = middle if recording.rest is None else recording.rest
        reads = middle > LEAST_PF

        def readable(some: Frames) -> Frames:
            sound = np.where(reads & (some > LEAST_PF), some, np.where(reads, LEAST_PF, 1.0))
            return sound.astype(np.float32)

        def quotient(some: Frames) -> Frames:
            z = some / np.where(rest > LEAST_PF, rest, np.inf)
            return np.where(rest > LEAST_PF, z - 1.0, 0.0).astype(np.float32)

        followed = _followed(frames, frames[:0], settings, readable)
        return followed if followed.known.any() else _fixed(frames, quotient)
    still = _untouched(recording) if recording.rest is None else recording.rest[None]
    level = np.median(still, axis=0).astype(np.float32)
    first = _fixed(frames, lambda some: some - level)
    firm = _firm(first.energy)
    if not firm > 0.0:
        return first
    settings = PreprocessSettings("difference", firm / FIRM, rate_hz)
    lead = np.resize(still, (max(LEAST_FRAMES, round(settings.start_s * rate_hz)), *level.shape))
    followed = _followed(frames, lead, settings)
    return followed if followed.known.all() else first


def _followed(
    frames: Frames,
    lead: Frames,
    settings: PreprocessSettings,
    readable: Callable[[Frames], Frames] = lambda some: some,
) -> Response:
    """Return the response by the device's preprocessor, which begins with `lead`."""
    stage = Preprocessor(settings, *frames.shape[1:], mend=False)  # keeps dead taxels visible
    for frame in lead:
        stage.step(frame)
    change, energy = blocks.like(frames), np.empty(len(frames))
    known, touched = np.empty((2, len(frames)), dtype=np.bool_)
    for part in blocks.blocks(frames, change):
        steps = [stage.step(frame) for frame in readable(frames[part])]
        images = np.array([step.image for step in steps], dtype=np.float32)
        change[part] = (images - np.float32(1.0)) * np.float32(settings.scale)
        energy[part] = [step.deviation * settings.scale for step in steps]
        known[part] = [step.ready for step in steps]
        touched[part] = [step.ready and not step.quiet for step in steps]
    return Response(change, energy, known, touched)


def _untouched(recording: Recording) -> Frames:
    """Return frames of the untouched sensor, (m, rows, columns): those with the least signal."""
    length = max(LEAST_FRAMES, round(REST_S * recording.origin.rate_hz))
    signal = recording.origin.sign * _means(recording.frames)
    total = np.cumsum(np.concatenate([[0.0], signal]))
    first = int((total[length:] - total[:-length]).argmin()) if len(signal) > length else 0
    return recording.frames[first : first + length]


def _firm(strength: NDArray[np.floating]) -> float:
    """Return the strength, (n,), of a firm touch, however rare touches are."""
    top = float(np.quantile(strength, RARE))
    return float(np.median(strength[strength >= top / 2.0]))


def _fixed(frames: Frames, changed: Callable[[Frames], Frames]) -> Response:
    """Return the response to a fixed rest, from which `changed` returns the change of frames."""
    change = blocks.like(frames)
    for part in blocks.blocks(frames, change):
        change[part] = changed(frames[part])
    energy = _means(change, np.abs)
    idle, firm = np.quantile(energy, (IDLE_SHARE, FIRM_SHARE))
    return Response(
        change,
        energy,
        known=np.ones(len(change), dtype=np.bool_),
        touched=energy > idle + TOUCHED * (firm - idle),
    )


def _means(
    frames: Frames, of: Callable[[Frames], Frames] = lambda some: some
) -> NDArray[np.float64]:
    """Return the mean over the taxels of each frame, (n,)."""
    means = [of(frames[part]).mean(axis=(1, 2), dtype=np.float64) for part in blocks.blocks(frames)]
    return np.concatenate(means)


def examine(frames: Frames, unit: str, response: Response) -> list[TaxelFault]:
    """Return the faults of the taxels in frames of a unit, and the sensor's response in them."""
    judged, shape = not unjudged(response), frames.shape[1:]
    still = taxel_measures.stuck(frames)
    if unit != PICOFARAD:  # counts stay the same where nothing touches
        still = taxel_measures.constant(frames)
        still &= judged or still.all()
    idle = response.idle & judged
    found = taxel_measures.faults(frames, unit, still, response.change, idle)
    if not judged:
        return found
    slope = _slope(response, useless(found, shape))
    dead = slope < DEAD_SLOPE
    if dead.any():
        dead &= _silent(response, loaded=unit == PICOFARAD)
    if unit != PICOFARAD:
        dead &= _surrounded(response)
    if dead.any():
        percent = 100 * np.nanmedian(slope[dead])
        text = f"dead (follows its neighbours with {percent:.0f} %)"
        found.append(TaxelFault("dead", dead, text))
    return found


def unjudged(response: Response) -> str:
    """Return the reason that dead and noisy taxels cannot be detected; "" if they can."""
    if (response.known & response.touched).sum() < TOUCHES or not response.idle.any():
        return "it is touched too little to detect dead taxels"
    responding = []
    for change in _touches(response):
        size = np.abs(change)
        strong = size > STRONG * size.max(axis=(1, 2), keepdims=True)
        responding.append(strong.mean(axis=(1, 2)))
    if np.median(np.concatenate(responding)) < SOFT:
        return "few taxels respond to each touch, so dead ones cannot be detected"
    return ""


def _touches(response: Response) -> Iterator[Frames]:
    """Yield the changes of the touched frames, (m, rows, columns), block by block."""
    touched = response.known & response.touched
    for part in blocks.blocks(response.change):
        if touched[part].any():
            yield response.change[part][touched[part]]


def _slope(response: Response, useless: Mask) -> Map:
    """Return the slope of each taxel against its neighbours under touch; NaN if unknown.

    It is unknown where touches hardly raise the estimate from the neighbours above its noise.
    """
    interpolator = TaxelInterpolator(*useless.shape)
    power: list[tuple[Array, int]] = []  # of the estimate, block by block

    def filled() -> Iterator[tuple[Array, Array]]:
        for touched in _touches(response):
            values = touched.astype(np.float64)
            changes = np.array([interpolator.fill(change, useless) for change in values])
            around = np.array([interpolator.around(change) for change in changes])
            power.append((np.square(around).sum(axis=0), len(around)))
            yield changes, around

    slope = taxel_measures.response_slope(filled())
    touched = np.sum([total for total, _ in power], axis=0) / sum(n for _, n in power)
    idle = np.flatnonzero(response.idle)
    chosen = idle[np.linspace(0, len(idle) - 1, min(len(idle), SAMPLED)).astype(np.int64)]
    noise = np.zeros(useless.shape)
    for i in chosen:
        still = interpolator.fill(response.change[i].astype(np.float64), useless)
        noise += np.square(interpolator.around(still)) / len(chosen)
    return np.where(useless | (touched < NEAR**2 * noise), np.nan, slope)


def _silent(response: Response, *, loaded: bool) -> Mask:
    """Return the taxels that change no more under touch than without, (rows, columns).

    A finger on a `loaded` skin, in pF, also changes the readings of its row a little.
    """

    def power(chosen: Mask) -> Map:
        squares = [
            np.square(response.change[part][chosen[part]]).sum(axis=0, dtype=np.float64)
            for part in blocks.blocks(response.change)
        ]
        return np.asarray(np.sum(squares, axis=0) / max(1, int(chosen.sum())))

    touched = power(response.known & response.touched)
    least = LOADED**2 * float(np.median(touched)) if loaded else 0.0
    return np.asarray(touched <= np.maximum(SILENT**2 * power(response.idle), least))


def _surrounded(response: Response) -> Mask:
    """Return the taxels beside which touches were strongest at several places, (rows, columns).

    Beyond the rim of a local touch, or of one that is always held in one place, taxels are sound.
    """
    rows, columns = response.change.shape[1:]
    peaks = np.zeros(rows * columns, dtype=np.int64)
    for change in _touches(response):
        strongest = np.abs(change).reshape(len(change), -1).argmax(axis=1)
        peaks += np.bincount(strongest, minlength=rows * columns)
    place = np.pad(peaks.reshape(rows, columns) > 0, 1)
    around = sum(
        place[y : y + rows, x : x + columns].astype(np.int64)
        for y in range(3) for x in range(3) if (y, x) != (1, 1)
    )  # fmt: skip
    return np.asarray(around >= PLACES)
