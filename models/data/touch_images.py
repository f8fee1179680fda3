"""Images of touches with their places: training data of CNN-2D, by the device's own stage.

Touches are held out with their windows.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.touch_input import TOUCH_WINDOWS
from controller.recognition.touch_position import TouchImage
from controller.shared.aliases import Index, Mask
from models.data.examples import Examples, run_starts
from models.data.splits import BLOCKS, SHARE, Parts, Split, covered, parts_of

# Until the networks notice a touch; drawn for each touch, so that none is relied upon.
LAG_S: Final = 0.15
LAG_FRAMES: Final = 2  # at least
IMAGES_HZ: Final = 10.0  # images of a second: neighbours are nearly the same


@dataclass(frozen=True, slots=True)
class Touches:
    """Touches whose place is known."""

    images: NDArray[np.float32]  # z of the touch so far, float32 (images, rows, columns)
    place: NDArray[np.float32]  # position of the touch, grid units, (images, 2)
    frame: NDArray[np.int64]  # frame of the examples that each ends at, (images,)
    touch: NDArray[np.int64]  # number of its touch, (images,)
    last: NDArray[np.bool_]  # it is the last of its touch, (images,)
    blur: NDArray[np.float64]  # noise of each image over its strength; NaN: unknown, (images,)


def find(examples: Examples, averaged: bool, seed: int) -> Touches:
    """Return the images of every touch whose place is known; the seed draws when it is noticed.

    Images are of the touch so far, averaged as on the device, or each alone as in the paper.
    """
    frames = np.flatnonzero(np.isfinite(examples.touch[:, 0]))
    number = np.cumsum(run_starts(frames, examples.session[frames], gap=1)) - 1
    if averaged:
        some = frames % max(1, round(examples.rate_hz / IMAGES_HZ)) == 0
        frames, number = frames[some], number[some]
    images = examples.images[frames]
    blur = np.full(len(frames), np.nan)
    if averaged and len(frames):
        shown, images, blur = _laid(examples, frames, seed)
        frames, number = frames[shown], number[shown]
    number = np.unique(number, return_inverse=True)[1].reshape(-1)
    begins = np.flatnonzero(np.diff(number, prepend=-1))
    last = np.diff(number, append=-1) != 0
    place = examples.touch[frames]
    if averaged:  # one place for each touch
        for one in np.split(np.arange(len(frames)), begins[1:]):
            place[one] = np.median(place[one], axis=0) if len(one) else place[one]
    return Touches(images, place, frames.astype(np.int64), number, last, blur)


def _laid(
    examples: Examples, wanted: NDArray[np.int64], seed: int
) -> tuple[NDArray[np.bool_], NDArray[np.float32], NDArray[np.float64]]:
    """Return which wanted frames show a touch, (wanted,), and their images and blur.

    Images are (images, rows, columns), blur is (images,).
    """
    null = _unnoticed(examples, np.random.default_rng((seed, 3)))
    want = np.zeros(len(null), dtype=np.bool_)
    want[wanted] = True
    shape = examples.images.shape[1:]
    images, shown, blur = [], [], []
    remembered, session = (TOUCH_WINDOWS * examples.window, *shape, examples.rate_hz), -1
    stage = TouchImage(*remembered)
    for frame in range(len(null)):
        if examples.session[frame] != session:
            stage, session = TouchImage(*remembered), examples.session[frame]
        idle = float(examples.idle[frame])
        stage.step(examples.images[frame], idle, null=bool(null[frame]))
        if want[frame]:
            image = None if null[frame] else stage.image()
            shown.append(image is not None)
            if image is not None:
                images.append(image)
                blur.append(stage.blur)
    made = np.stack(images) if images else np.empty((0, *shape), dtype=np.float32)
    return np.array(shown, dtype=np.bool_), made, np.array(blur, dtype=np.float64)


def _unnoticed(examples: Examples, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return the frames without a recognised gesture, (frames,): the first of each among them."""
    null = examples.label <= 0
    lags = np.arange(max(LAG_FRAMES, round(LAG_S * examples.rate_hz)) + 1)
    begins = np.flatnonzero(~null & np.concatenate([[True], null[:-1]]))
    for begin, lag in zip(begins, rng.choice(lags, len(begins)), strict=True):
        null[begin : begin + lag] = True
    return null


def split_touches(split: Split, examples: Examples, found: Touches, seed: int) -> Parts:
    """Return the same split of images of touches, by whole touches.

    A touch is learned from if none of its frames is in a window held out, and held out if all
    of them are. Where one side would have none, as where places were recorded in one session
    only, the last touches of each session are held out.
    """
    count = int(found.touch.max(initial=-1)) + 1
    ends = examples.ends[split.windows.check]
    tested = covered(ends, examples.window, len(examples.label))
    tested |= split.held[examples.session]
    frames = np.bincount(found.touch, minlength=count)
    inside = np.bincount(found.touch, tested[found.frame].astype(np.float64), minlength=count)
    learned, held, words = inside == 0, inside == frames, ""
    if not (learned.any() and held.any()):
        recording = np.zeros(count, dtype=np.int64)
        recording[found.touch] = examples.session[found.frame]
        held = last_events(recording)
        learned = ~held
        words = (
            f"places are known in too few sessions to hold one out: of each, the last "
            f"{1 / SHARE:.0f}th of the touches is held out"
        )
    train, test = np.flatnonzero(learned[found.touch]), np.flatnonzero(held[found.touch])
    return replace(parts_of(train, test, seed), words=words)


def last_events(recording: Index) -> Mask:
    """Return the last part of each recording's events, (events,), by the recording of each."""
    held = np.zeros(len(recording), dtype=np.bool_)
    for number in np.unique(recording):
        events = np.flatnonzero(recording == number)
        if len(events) > 1:
            held[events[-max(1, len(events) // BLOCKS) :]] = True
    return held
