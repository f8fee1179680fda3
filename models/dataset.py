"""Examples from sessions, through the very preprocessing that runs on the device."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.preprocess import Preprocessor, PreprocessSettings


@dataclass(frozen=True, slots=True)
class Examples:
    """Images of several sessions in a row, and which windows may be cut from them.

    Attributes:
        images: z images, float32 (frames, rows, columns).
        label: Class of each frame, (frames,).
        touch: Where a press truly is, grid units, NaN elsewhere, (frames, 2).
        ends: Last frame of every whole window, (windows,).
        session: Session number of each frame, (frames,).
        window: Images in a window.
    """

    images: NDArray[np.float32]
    label: NDArray[np.int64]
    touch: NDArray[np.float32]
    ends: NDArray[np.int64]
    session: NDArray[np.int32]
    window: int

    def windows(self, ends: NDArray[np.int64]) -> NDArray[np.float32]:
        """Cut windows, (len(ends), window, rows, columns), oldest image first."""
        index = ends[:, None] + np.arange(1 - self.window, 1)
        cut: NDArray[np.float32] = self.images[index]
        return cut


@dataclass(frozen=True, slots=True)
class Source:
    """One recorded or simulated session, as training needs it."""

    frames: NDArray[np.float32]
    label: NDArray[np.integer]
    touch: NDArray[np.float32]


def prepare(sources: Sequence[Source], settings: PreprocessSettings) -> Examples:
    """Run every session through the device's preprocessing and join what is usable.

    Frames before the rest image exists are left out, and no window spans two sessions.

    Raises:
        ValueError: No session has frames enough for one window.
    """
    images, labels, touches, ends, sessions = [], [], [], [], []
    total = 0
    for number, source in enumerate(sources):
        stage = Preprocessor(settings, *source.frames.shape[1:])
        prepared = [stage.step(frame) for frame in source.frames]
        use = np.flatnonzero([p.ready for p in prepared])
        if len(use) < settings.window:
            continue
        images.append(np.stack([prepared[i].image for i in use]))
        labels.append(source.label[use].astype(np.int64))
        touches.append(source.touch[use].astype(np.float32))
        sessions.append(np.full(len(use), number, dtype=np.int32))
        ends.append(np.arange(settings.window - 1, len(use), dtype=np.int64) + total)
        total += len(use)
    if not images:
        raise ValueError("no session has a quiet second and a whole window; record longer ones")
    return Examples(
        np.concatenate(images),
        np.concatenate(labels),
        np.concatenate(touches),
        np.concatenate(ends),
        np.concatenate(sessions),
        settings.window,
    )
