"""Examples of a gesture, data augmentation of their windows, and the guess of its symmetries.

Each example is varied in duration, strength, sampling instants and noise, and rotated and mirrored
by its symmetries. The noise of its own frames is removed from variations and drawn anew: otherwise
a lesson from one example on a noisy orb learns that example's noise as part of the gesture.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from controller.bundles.head import EVERYBODY
from controller.shared.aliases import Images, Windows

LEAD_S: Final = 1.3  # of images before a touch: a window of rest, and more
TAIL_S: Final = 0.5  # and after it: the finger is still letting go
TURNS: Final = {"none": (0,), "half": (0, 2), "all": (0, 1, 2, 3)}  # quarter turns
SMOOTH_S: Final = 0.125  # over which images are averaged: a tap is hardly longer
NEIGHBOURS: Final = 3  # taxels, in rows and in columns, over which they are averaged
# Share of the range from idle to firm at which a touch begins and ends, and one that it exceeds:
# noise on `paper-snr` often exceeds the first. A squeeze rises slowly and is late at more.
SHARE: Final = 0.2
EXCEEDED: Final = 0.5
WHOLE: Final = 0.25  # of the greatest stretch: a smaller one is noise
IDLE: Final = 0.25  # quantile of the frames that counts as idle
FIRM: Final = 0.9  # quantile of a touch's frames that counts as firm
PAUSE_S: Final = 0.4  # between two touches; that of a double tap is shorter
REACH_S: Final = 1.0  # an edge of a label may be so far off its touch,
EDGE_S: Final = 0.5  # and so far off is what is not learned from at least
LEAST: Final = 2.5  # least ratio of a touch's energy to the deviation of idle frames
STILL: Final = 0.2  # share of an example's frames that are surely untouched
TELLING: Final = 0.8  # of a touch: before this share it is ambiguous, and counts less
VAGUE: Final = 0.4  # of a touch: before this share it may begin like another, and does not count
SLOW: Final = 20  # images: shorter windows show so few of a touch that all count
CLEAR: Final = 0.05  # of a frame: closer to an edge, the class of a window is ambiguous
WINDOWS: Final = 10  # that a window's length of a variation gives: neighbours are nearly the same
PACE: Final = 0.2  # standard deviation of the logarithm of duration
GAIN: Final = 0.2  # and of strength
OFFSET: Final = 0.004  # standard deviation of the baseline error, z
NOISE: Final = 0.003  # and of the noise of each reading, beside the example's own
BLUR: Final = (0.2, 0.6, 0.2)  # weights of three frames in a variation
LEAST_EXAMPLES: Final = 3  # of which symmetries can be guessed
COMPARED_IMAGES: Final = 4  # of a touch that are compared, evenly between its beginning and end
DISTANCE_FACTOR: Final = 1.6  # times the usual distance: farther away it is another gesture
# Distance of what is the same in any case; that of nothing in common is 1.4
SAME_DISTANCE: Final = 0.6

_MEDIAN: Final = 0.6745  # of the absolute deviation of a normal distribution

Shape = NDArray[np.float64]  # (examples, COMPARED_IMAGES, rows, columns), each of length 1
Turn = tuple[int, bool]  # quarter turns, and whether it is mirrored before


@dataclass(frozen=True, eq=False)
class Example:
    """One example of a gesture."""

    label: str  # its gesture; "null": none
    images: Images  # z, (frames, rows, columns), with some frames before and after the touch
    user: str = EVERYBODY  # the user whose rows it is for; `EVERYBODY`: all
    rotations: str = "none"  # rotations under which it is invariant: "all", "half" or "none"
    mirrored: bool = False  # its mirror image is the same gesture
    # first frame of the touch and the frame after its last; None until `found`
    span: tuple[float, float] | None = None
    edge: float = 0.0  # frames beside the span that may belong to it, and are not learned from

    def found(self, rate_hz: float = 10.0) -> "Example | None":
        """Return the example with the span of its touch, or None without a touch.

        Of several touches the last one counts. The frames beyond the pauses around it are cut off,
        so that the previous touch is not learned as the beginning of this one.
        """
        if self.span is not None:
            return self
        touches = touched(self.images, rate_hz)
        if not touches:
            return None
        # The example begins and ends at the quietest frames of the pauses.
        first = touches[-2].quiet if len(touches) > 1 else 0
        begin, end = touches[-1].span
        images = self.images[first : touches[-1].quiet + 1]
        return replace(self, images=images, span=(begin - first, end - first))

    def labelled(self, first: int, end: int, rate_hz: float) -> "Example":
        """Return the example with the span of a label, of frames `first` to `end` - 1.

        All touches within count, however many and however light. Edges of labels are early or late:
        those of the span move to the touch by at most `REACH_S`, and what is near is unclear.
        """
        touches = [one.span for one in touched(self.images, rate_hz)] if end > first + 2 else []
        own = [(b, e) for b, e in touches if min(e, end) - max(b, first) > 0.5 * (e - b)]
        reach, span = REACH_S * rate_hz, (float(first), float(end))
        if own and own[-1][1] - own[0][0] > 0.5 * (end - first):
            begin = min(max(own[0][0], first - reach), first + reach)
            span = (begin, min(max(own[-1][1], end - reach), end + reach))
        moved = max(abs(span[0] - first), abs(span[1] - end))
        return replace(self, span=span, edge=max(moved, EDGE_S * rate_hz))

    def noise(self) -> float:
        """Return the mean change of a taxel between frames at rest, z."""
        change = np.abs(np.diff(self.images, axis=0)).mean(axis=(1, 2))
        return float(np.quantile(change, STILL)) if len(change) else 0.0


@dataclass(frozen=True, slots=True)
class Touch:
    """One touch in some images."""

    span: tuple[float, float]  # its beginning and end, frames
    quiet: int  # the quietest frame before the next one or a stray; the last image if there is none


def touched(images: Images, rate_hz: float) -> list[Touch]:
    """Return the touches in some images, in order; with at most `PAUSE_S` between, one.

    A single frame of a noisy sensor shows nothing, so energies are those of averages. Stretches of
    frames above `SHARE` that never exceed `EXCEEDED`, or are small beside the greatest, are noise.
    """
    energy = _energy(images, rate_hz)
    idle = float(np.quantile(energy, IDLE))
    restless = float(np.abs(energy - idle)[energy <= np.median(energy)].mean())
    loud = energy[energy > idle + 0.5 * (energy.max() - idle)]
    firm = float(np.quantile(loud, FIRM)) if len(loud) else idle
    if firm - idle < max(LEAST * restless, 0.01):
        return []
    share = (energy - idle) / (firm - idle)
    stretches = _parted(np.flatnonzero(share >= SHARE), 0.0)
    firmer = [one for one in stretches if share[one].max() > EXCEEDED]
    least = WHOLE * max(share[one].sum() for one in firmer)
    sure, pause = [one for one in firmer if share[one].sum() >= least], PAUSE_S * rate_hz
    found = []
    for part in _parted(np.concatenate(sure), pause):
        first, last = int(part[0]), int(part[-1])
        begin, end = float(first), float(last)
        if first > 0:
            begin -= (share[first] - SHARE) / (share[first] - share[first - 1])
        if last + 1 < len(share):
            end += (share[last] - SHARE) / (share[last] - share[last + 1])
        after = [one[0] for one in firmer if one[0] > last + pause]
        quiet = last + int(energy[last : after[0]].argmin()) if after else len(images) - 1
        found.append(Touch((begin, max(end, begin + 1e-3)), quiet))
    return found


def _energy(images: Images, rate_hz: float) -> NDArray[np.float64]:
    """Return the root mean square of z - 1, averaged over `SMOOTH_S` and `NEIGHBOURS`, (n,)."""
    change = images.astype(np.float64) - 1.0
    sizes = (max(1, round(SMOOTH_S * rate_hz)), NEIGHBOURS, NEIGHBOURS)
    for axis, size in enumerate(sizes):
        around = [(0, 0)] * 3
        around[axis] = ((size - 1) // 2, size // 2)
        padded = np.pad(change, around, mode="symmetric")
        change = sliding_window_view(padded, size, axis).mean(axis=-1)
    return np.asarray(np.sqrt(np.square(change).mean(axis=(1, 2))))


def _parted(frames: NDArray[np.intp], pause: float) -> list[NDArray[np.intp]]:
    """Return numbers of frames, (n,), parted where more than `pause` frames lie between."""
    return np.split(frames, np.flatnonzero(np.diff(frames) > pause + 1.0) + 1)


def vary(
    example: Example, window: int, copies: int, rng: np.random.Generator
) -> tuple[Windows, NDArray[np.float32]]:
    """Return windows of variations of an example with its span, and the weight of each.

    The first of the `copies` is the unchanged example. Windows are (n, window, rows, columns),
    their weights for the gesture 0 to 1, or -1 outside of the touch, (n,).
    """
    assert example.span is not None
    made, inside = [], []
    rest = ((window - 1, 0), (0, 0), (0, 0))  # before the example
    images = np.pad(example.images, rest, mode="edge").astype(np.float32)
    clean, noise = denoised(example.images, blurred=window >= SLOW)
    clean = np.pad(clean, rest, mode="edge")
    span = (example.span[0] + window - 1, example.span[1] + window - 1)
    vague = VAGUE if window >= SLOW else 0.0
    turns = _turns(example)
    for number in range(copies):
        seen, (begin, end), edge = images, span, example.edge
        if number:
            seen, at = paced(clean, rng)
            begin, end = ((place - at[0]) / (at[1] - at[0]) for place in span)
            edge /= at[1] - at[0]
            seen = vary_images(_turned(seen, turns, rng, mirrored=example.mirrored), rng)
            seen = seen + noise * rng.standard_normal(seen.shape, dtype=np.float32)
        last = thinned(np.arange(window - 1, len(seen)), window, number, rng)
        clear = np.minimum(np.abs(last - begin), np.abs(last - end)) > CLEAR
        within = (last >= begin) & (last < end)
        clear &= within | (last < begin - edge) | (last >= end + edge)
        last, within = last[clear], within[clear]
        cut = seen[last[:, None] + np.arange(1 - window, 1)]
        made.append(cut.astype(np.float32))
        telling = np.clip(((last - begin) / (end - begin) - vague) / (TELLING - vague), 0.0, 1.0)
        if edge:  # a label may last: then a window within it shows nothing else
            telling[last - begin >= window - 1] = 1.0
        inside.append(np.where(within, telling, -1.0).astype(np.float32))
    return np.concatenate(made), np.concatenate(inside)


def denoised(images: Images, *, blurred: bool) -> tuple[Images, float]:
    """Return images (n, rows, columns) without most of their noise, and its deviation, z.

    Singular values that noise alone would give are set to zero, after averaging over three frames
    if `blurred`. Source of the bound: Marchenko and Pastur 1967.
    """
    noise = float(np.median(np.abs(np.diff(images, axis=0)))) / (_MEDIAN * math.sqrt(2.0))
    change, left = images.astype(np.float64) - 1.0, noise
    if blurred:
        padded = np.pad(change, ((1, 1), (0, 0), (0, 0)), mode="edge")
        change = sliding_window_view(padded, 3, axis=0) @ np.array(BLUR)
        left *= float(np.linalg.norm(BLUR))
    flat = change.reshape(len(change), -1)
    left_vectors, strengths, right_vectors = np.linalg.svd(flat, full_matrices=False)
    strengths[strengths <= left * sum(math.sqrt(side) for side in flat.shape)] = 0.0
    clean = 1.0 + (left_vectors * strengths) @ right_vectors
    return clean.reshape(images.shape).astype(np.float32), noise


def thinned(
    last: NDArray[np.int64], window: int, copy: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Return some of the last frames of windows, (n,), of a copy's from a random one on."""
    every = max(1, window // WINDOWS)
    return last[rng.integers(every) if copy and every > 1 else 0 :: every]


def varied(example: Example, copies: int, rng: np.random.Generator) -> Iterator[Example]:
    """Yield variations of a whole example: other speed, strength, place on the grid and noise."""
    assert example.span is not None
    for _ in range(copies):
        seen, at = paced(example.images, rng)
        begin, end = ((place - at[0]) / (at[1] - at[0]) for place in example.span)
        seen = _turned(seen, _turns(example), rng, mirrored=example.mirrored)
        yield replace(example, images=vary_images(seen, rng), span=(begin, end))


def _turns(example: Example) -> list[int]:
    """Return the quarter turns under which an example is the same gesture; 0 is among them."""
    square = example.images.shape[1] == example.images.shape[2]
    return [k for k in TURNS[example.rotations] if square or k % 2 == 0]


def paced(images: Images, rng: np.random.Generator) -> tuple[Images, NDArray[np.float64]]:
    """Return images at another speed and instants, n ≥ 2, and the place of each, frames, (n,)."""
    longer = float(np.exp(rng.normal(0.0, PACE)))
    count = max(2, int((len(images) - 1) * longer))
    at = (rng.uniform(0.0, 1.0) + np.arange(count)) / longer
    at = np.minimum(at, len(images) - 1.0 - 1e-6 * np.arange(count, 0, -1))
    return between(images, at), at


def between(images: Images, at: NDArray[np.float64]) -> Images:
    """Return images between others, at places (n,), by a cubic Catmull-Rom spline.

    Linear interpolation would lower the peak of a touch of three images. Source: Catmull and Rom
    1974.
    """
    low = np.minimum(at.astype(np.intp), len(images) - 2)
    part = (at - low).astype(np.float32)[:, None, None]
    here, there = images[low], images[low + 1]
    slope = 0.5 * (there - images[np.maximum(low - 1, 0)])
    later = 0.5 * (images[np.minimum(low + 2, len(images) - 1)] - here)
    way = there - here
    bend = (3.0 * way - 2.0 * slope - later) + part * (slope + later - 2.0 * way)
    return np.asarray(here + part * (slope + part * bend), dtype=np.float32)


def _turned(
    images: Images, turns: list[int], rng: np.random.Generator, *, mirrored: bool
) -> Images:
    """Return images, (n, rows, columns), rotated and mirrored at random."""
    if mirrored and rng.random() < 0.5:
        images = images[:, :, ::-1]
    return np.rot90(images, turns[int(rng.integers(len(turns)))], (1, 2))


def vary_images(images: Images, rng: np.random.Generator) -> Images:
    """Return images, (n, rows, columns), with another strength, baseline and noise."""
    change = (images - 1.0) * float(np.exp(rng.normal(0.0, GAIN)))
    change += OFFSET * rng.normal(size=images.shape[1:])
    more = NOISE * float(np.exp(rng.normal()))
    return np.asarray(1.0 + change + more * rng.normal(size=images.shape), dtype=np.float32)


def guess_symmetries(examples: Sequence[Example]) -> tuple[str, bool]:
    """Return the rotations, as in `Example`, and whether the mirror image is the same gesture.

    Examples of a gesture that any direction suits differ among themselves as much as from a turned
    one. So the turned (or mirrored) examples belong to the gesture if each is about as near to
    another example as the examples are to each other.

    Args:
        examples: Of one gesture and grid, with their spans; of fewer than `LEAST_EXAMPLES` the
            guess is "none", False.
    """
    if len(examples) < LEAST_EXAMPLES:
        return "none", False
    shapes = np.stack([_shape(one) for one in examples])
    turns, rotations = [0], "none"
    if _same(shapes, [(0, False)], [(2, False)]):
        turns, rotations = [0, 2], "half"
        quarters = [(1, False), (3, False)]
        if shapes.shape[2] == shapes.shape[3] and _same(shapes, [(0, False), (2, False)], quarters):
            turns, rotations = [0, 1, 2, 3], "all"
    mirrored = _same(shapes, [(k, False) for k in turns], [(k, True) for k in turns])
    return rotations, mirrored


def _same(shapes: Shape, known: Iterable[Turn], other: Iterable[Turn]) -> bool:
    """Return whether examples turned otherwise are as near to others as in the known turns."""
    return _distance(shapes, other) <= max(
        SAME_DISTANCE, DISTANCE_FACTOR * _distance(shapes, known)
    )


def _distance(shapes: Shape, turns: Iterable[Turn]) -> float:
    """Return the mean distance of each example, turned, to the nearest other one."""
    flat = shapes.reshape(len(shapes), -1)
    nearest = np.full(len(shapes), np.inf)
    for quarters, mirrored in turns:
        turned = np.rot90(shapes[..., ::-1] if mirrored else shapes, quarters, (2, 3))
        alike = turned.reshape(flat.shape) @ flat.T
        np.fill_diagonal(alike, -np.inf)
        nearest = np.minimum(nearest, np.sqrt(np.maximum(0.0, 2.0 - 2.0 * alike.max(axis=1))))
    return float(nearest.mean())


def _shape(example: Example) -> Shape:
    """Return an example's images at some moments of its touch, of length 1 together."""
    assert example.span is not None
    at = np.linspace(*example.span, COMPARED_IMAGES + 2)[1:-1]
    last = len(example.images) - 1.001
    images = between(example.images, np.clip(at, 0.0, last)).astype(np.float64) - 1.0
    return np.asarray(images / max(1e-9, float(np.linalg.norm(images))))
