"""Examples of a gesture, and the many windows that each of them makes; pure.

A hand never does a thing twice alike. So each example is made faster and slower, stronger and
weaker, read at other instants and with other noise, and turned and mirrored as it declares.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

Images = NDArray[np.float32]  # (frames, rows, columns), z
Windows = NDArray[np.float32]  # (windows, images, rows, columns), z

EVERYBODY: Final = ""  # the user of an example that all users' networks learn
NULL_LABEL: Final = "null"
TURNS: Final = {"none": (0,), "half": (0, 2), "all": (0, 1, 2, 3)}  # quarters
# Share of the way from idle to firm at which a touch begins and ends; where a finger is 40 % deep
# its share is about this (models/data/label_repair.py finds the same on simulated gestures).
SHARE: Final = 0.3
FIRM: Final = 0.9  # quantile of a touch's frames that are taken for firm
PAUSE_S: Final = 0.45  # between two touches; a double tap's is shorter
WHOLE: Final = 0.5  # of the firmest of several touches: one that is less is noise or a stray
LEAST: Final = 2.5  # a touch is so many times as firm as idle frames are restless
STILL: Final = 0.2  # of an example's frames: surely nothing touches there
TELLING: Final = 0.8  # of a touch: before, it may still become another gesture, and counts less
CLEAR: Final = 0.05  # of a frame: closer to an edge, a window may be either
PACE: Final = 0.2  # deviations, relative: how long it takes, how strong it is
GAIN: Final = 0.2
OFFSET: Final = 0.004  # of rest that is not quite true, and of each reading
NOISE: Final = 0.003


@dataclass(frozen=True, eq=False)
class Example:
    """One example of a gesture.

    Attributes:
        label: What it is; "null": none.
        images: z, (frames, rows, columns), with some frames before and after the touch.
        user: Whose network shall learn it; `EVERYBODY`: all.
        rotations: Turns that leave it the same gesture: "all", "half" or "none".
        mirrored: Its mirror image is the same gesture.
        span: First frame of the touch and the frame after its last; None until `found`.
    """

    label: str
    images: Images
    user: str = EVERYBODY
    rotations: str = "none"
    mirrored: bool = False
    span: tuple[float, float] | None = None

    def found(self, rate_hz: float = 10.0) -> "Example | None":
        """Return the example with its touch found, or None where nothing touches.

        Of several touches the last is meant; what lies beyond the pauses around it is cut off, so
        that the previous touch is not learned as the beginning of this one.

        Args:
            rate_hz: Frames per second.
        """
        if self.span is not None:
            return self
        touches = touched(self.images, PAUSE_S * rate_hz)
        if not touches:
            return None
        weight = [one.weight for one in touches]
        at = max(i for i, one in enumerate(weight) if one >= WHOLE * max(weight))
        # Where a pause is quietest the example begins and ends.
        first = touches[at - 1].quiet if at else 0
        end = touches[at].quiet + 1 if at + 1 < len(touches) else len(self.images)
        span = (touches[at].span[0] - first, touches[at].span[1] - first)
        return replace(self, images=self.images[first:end], span=span)

    def noise(self) -> float:
        """Return how much a taxel changes from frame to frame where least happens, z."""
        change = np.abs(np.diff(self.images, axis=0)).mean(axis=(1, 2))
        return float(np.quantile(change, STILL)) if len(change) else 0.0


@dataclass(frozen=True, slots=True)
class Touch:
    """One touch in some images.

    Attributes:
        span: Where it begins and ends, frames.
        weight: How firm and long it is.
        quiet: The quietest frame between it and the next one; the last image after the last.
    """

    span: tuple[float, float]
    weight: float
    quiet: int


def touched(images: Images, pause: float = np.inf) -> list[Touch]:
    """Return the touches in some images, in order; none may be there.

    Args:
        images: z, (frames, rows, columns).
        pause: Between two touches there are more frames without one than so many: in a double
            tap's pause the touch goes on.
    """
    energy = np.abs(images.astype(np.float64) - 1.0).mean(axis=(1, 2))
    idle = float(np.quantile(energy, 0.1))
    restless = float(np.abs(energy - idle)[energy <= np.median(energy)].mean())
    loud = energy[energy > idle + 0.5 * (energy.max() - idle)]
    firm = float(np.quantile(loud, FIRM)) if len(loud) else idle
    if firm - idle < max(LEAST * restless, 0.01):
        return []
    share = (energy - idle) / (firm - idle)
    above = np.flatnonzero(share >= SHARE)
    parts = np.split(above, np.flatnonzero(np.diff(above) > pause + 1.0) + 1)
    ends = [*(int(part[0]) for part in parts[1:]), len(images)]
    found = []
    for part, after in zip(parts, ends, strict=True):
        first, last = int(part[0]), int(part[-1])
        begin, end = float(first), float(last)
        if first > 0:
            begin -= (share[first] - SHARE) / (share[first] - share[first - 1])
        if last + 1 < len(share):
            end += (share[last] - SHARE) / (share[last] - share[last + 1])
        quiet = last + int(energy[last:after].argmin())
        weight = float(share[part].sum())
        found.append(Touch((begin, max(end, begin + 1e-3)), weight, quiet))
    return found


def vary(
    example: Example, window: int, copies: int, rng: np.random.Generator
) -> tuple[Windows, NDArray[np.float32]]:
    """Return windows of an example as it might have been, and how telling each is.

    Args:
        example: With its span.
        window: Images in a window.
        copies: How many; the first is the example as it was.
        rng: Draws how they differ.

    Returns:
        Windows (n, window, rows, columns); and for each how telling it is of the gesture, 0 ... 1,
        or -1 where nothing is made, (n,).
    """
    assert example.span is not None
    made, inside = [], []
    before = np.repeat(example.images[:1], window - 1, axis=0)  # nothing happened before
    images = np.concatenate([before, example.images]).astype(np.float32)
    span = (example.span[0] + window - 1, example.span[1] + window - 1)
    square = images.shape[1] == images.shape[2]
    turns = [k for k in TURNS[example.rotations] if square or k % 2 == 0]
    for number in range(copies):
        seen, (begin, end) = (images, span)
        if number:
            seen, at = paced(images, rng)
            begin, end = ((edge - at[0]) / (at[1] - at[0]) for edge in span)
            seen = vary_images(_turned(seen, turns, rng, mirrored=example.mirrored), rng)
        last = np.arange(window - 1, len(seen))
        clear = np.minimum(np.abs(last - begin), np.abs(last - end)) > CLEAR
        last = last[clear]
        cut = seen[last[:, None] + np.arange(1 - window, 1)]
        made.append(cut.astype(np.float32))
        telling = np.clip((last - begin) / (TELLING * (end - begin)), 0.0, 1.0)
        within = (last >= begin) & (last < end)
        inside.append(np.where(within, telling, -1.0).astype(np.float32))
    return np.concatenate(made), np.concatenate(inside)


def paced(images: Images, rng: np.random.Generator) -> tuple[Images, NDArray[np.float64]]:
    """Return images as if all had been done faster or slower, and read at other instants.

    Returns:
        Images, and where in the given ones each of them lies, in frames, (n,); n is 2 at least.
    """
    longer = float(np.exp(rng.normal(0.0, PACE)))
    count = max(2, int((len(images) - 1) * longer))
    at = (rng.uniform(0.0, 1.0) + np.arange(count)) / longer
    at = np.minimum(at, len(images) - 1.0 - 1e-6 * np.arange(count, 0, -1))
    low = np.minimum(at.astype(np.intp), len(images) - 2)
    part = (at - low).astype(np.float32)[:, None, None]
    return _between(images, low, part), at


def _between(images: Images, low: NDArray[np.intp], part: NDArray[np.float32]) -> Images:
    """Return the images a part of the way from one to the next, on a cubic through both.

    Its slope at an image is that from the one before to the one after (Catmull and Rom 1974). A
    straight line cut the tip off a touch of three images: what it made were softer touches.

    Args:
        images: (frames, rows, columns).
        low: The images before, (n,); each has one after it.
        part: 0 ... 1, (n, 1, 1).
    """
    here, there = images[low], images[low + 1]
    slope = 0.5 * (there - images[np.maximum(low - 1, 0)])
    later = 0.5 * (images[np.minimum(low + 2, len(images) - 1)] - here)
    way = there - here
    bend = (3.0 * way - 2.0 * slope - later) + part * (slope + later - 2.0 * way)
    return np.asarray(here + part * (slope + part * bend), dtype=np.float32)


def _turned(
    images: Images, turns: list[int], rng: np.random.Generator, *, mirrored: bool
) -> Images:
    if mirrored and rng.random() < 0.5:
        images = images[:, :, ::-1]
    return np.rot90(images, turns[int(rng.integers(len(turns)))], (1, 2))


def vary_images(images: Images, rng: np.random.Generator) -> Images:
    """Return the images with another strength, rest and noise."""
    change = (images - 1.0) * float(np.exp(rng.normal(0.0, GAIN)))
    change += OFFSET * rng.normal(size=images.shape[1:])
    more = NOISE * float(np.exp(rng.normal()))
    return np.asarray(1.0 + change + more * rng.normal(size=images.shape), dtype=np.float32)
