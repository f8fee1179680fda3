"""Images of touches with their places: training data of CNN-2D, made by the device's own stage."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.touch_position import TouchImage
from models.data.examples import Examples, run_starts

# Frames until the networks notice a touch; drawn for each touch, so that none is relied upon.
LAGS: Final = (0, 1, 2)
WINDOWS: Final = 3  # of a touch's images are remembered, as in controller/recognition/pipeline.py


@dataclass(frozen=True, slots=True)
class Touches:
    """Touches whose place is known.

    Attributes:
        images: z of the touch so far, float32 (images, rows, columns).
        place: Position of the touch, grid units, (images, 2).
        frame: Frame of the examples that each ends at, (images,).
        touch: Number of its touch, (images,).
        last: It is the last of its touch, (images,).
        blur: Noise of each image over its strength; NaN: unknown, (images,).
    """

    images: NDArray[np.float32]
    place: NDArray[np.float32]
    frame: NDArray[np.int64]
    touch: NDArray[np.int64]
    last: NDArray[np.bool_]
    blur: NDArray[np.float64]


def find(examples: Examples, averaged: bool, seed: int) -> Touches:
    """Return the images of every touch whose place is known.

    Args:
        examples: Frames, and where they are touched.
        averaged: The touch so far, as on the device; else each image alone, as in the paper.
        seed: Of how late the networks notice.
    """
    frames = np.flatnonzero(np.isfinite(examples.touch[:, 0]))
    images = examples.images[frames]
    blur = np.full(len(frames), np.nan)
    if averaged and len(frames):
        shown, images, blur = _laid(examples, frames, seed)
        frames = frames[shown]
    begins = run_starts(frames, examples.session[frames], gap=1)
    last = np.append(begins[1:], np.ones(len(frames[:1]), dtype=np.bool_))
    number = np.cumsum(begins) - 1
    place = examples.touch[frames]
    if averaged:  # one place for each touch
        for one in np.split(np.arange(len(frames)), np.flatnonzero(begins)[1:]):
            place[one] = np.median(place[one], axis=0) if len(one) else place[one]
    return Touches(images, place, frames.astype(np.int64), number, last, blur)


def _laid(
    examples: Examples, wanted: NDArray[np.int64], seed: int
) -> tuple[NDArray[np.bool_], NDArray[np.float32], NDArray[np.float64]]:
    """Return which wanted frames show a touch, (wanted,), and its images and their blur there.

    Images are (images, rows, columns), blur is (images,).
    """
    null = _unnoticed(examples.label, np.random.default_rng((seed, 3)))
    want = np.zeros(len(null), dtype=np.bool_)
    want[wanted] = True
    shape = examples.images.shape[1:]
    images, shown, blur = [], [], []
    stage, session = TouchImage(WINDOWS * examples.window, *shape), -1
    for frame in range(len(null)):
        if examples.session[frame] != session:
            stage, session = TouchImage(WINDOWS * examples.window, *shape), examples.session[frame]
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


def _unnoticed(label: NDArray[np.int64], rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return the frames without a recognised gesture, (frames,): the first of each among them."""
    null = label <= 0
    begins = np.flatnonzero(~null & np.concatenate([[True], null[:-1]]))
    for begin, lag in zip(begins, rng.choice(LAGS, len(begins)), strict=True):
        null[begin : begin + lag] = True
    return null
