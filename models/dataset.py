"""Examples from sessions, through the very preprocessing that runs on the device."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from controller.preprocess import Preprocessor, PreprocessSettings
from controller.recordings import reader
from controller.recordings.recording import UNKNOWN, Recording
from controller.simulator.session import TEST_SEEDS

Labels = Literal["true", "button"]  # what truly happened, or what the label button said


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

    @classmethod
    def of(cls, recorded: Recording, labels: Labels = "true") -> "Source":
        """Return a recording as training needs it.

        Args:
            recorded: From a simulation or from the world; only the first knows true touches.
            labels: Which labels to learn from.

        Raises:
            ValueError: It has no such labels.
        """
        label = recorded.label if labels == "true" else recorded.button
        if (label == UNKNOWN).any():
            other = "button" if labels == "true" else "true"
            raise ValueError(
                f"a recording of {recorded.origin.device_id} lacks {labels} labels for some "
                f"frames; learn from {other} labels, or leave it out"
            )
        nowhere = np.full((len(label), 2), np.nan, dtype=np.float32)
        return cls(recorded.frames, label, recorded.truth.touch if recorded.truth else nowhere)


def refuse_test_seed(seed: int | None, what: str) -> None:
    """Keep the seeds that are for tests out of training and tuning.

    Raises:
        ValueError: This is one of them.
    """
    if seed in TEST_SEEDS:
        raise ValueError(
            f"{what} has seed {seed}, and seeds {TEST_SEEDS.start} to {TEST_SEEDS.stop - 1} are "
            "for tests only; choose another"
        )


def read_training(paths: Iterable[Path]) -> list[Recording]:
    """Return recordings to train or tune on: files, and all in folders, in order of their names.

    Raises:
        RecordingError: One cannot be read.
        ValueError: There are none, one is for tests only, or they are not of one kind.
    """
    files = [
        file
        for path in paths
        for file in (sorted(path.rglob("[!.]*.npz")) if path.is_dir() else [path])
    ]
    if not files:
        raise ValueError("there are no recordings there; make some with: models simulate --out DIR")
    loaded: list[Recording] = []
    for file in files:
        loaded.append(reader.load(file))
        refuse_test_seed(loaded[-1].origin.seed, f"the recording {file}")
        first, this = _kind(loaded[0]), _kind(loaded[-1])
        if first != this:
            raise ValueError(f"{files[0]} has {first}, {file} has {this}; train on one kind")
    return loaded


def _kind(recorded: Recording) -> str:
    origin = recorded.origin
    return (
        f"{origin.rows}×{origin.columns} taxels at {origin.rate_hz:g} Hz "
        f"and the labels {', '.join(origin.labels)}"
    )


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
