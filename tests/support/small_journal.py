"""A small journal as tests have it: frame k is known by its number, and was taken at k / 10 s."""

from typing import Any

import numpy as np

from controller.recordings.journal import Decoded, Journal
from controller.recordings.recording import Provenance

ID = "0123456789abcdef" * 2
LABELS = ("null", "press", "pinch")
ORIGIN = Provenance("virtual-1", 2, 3, 10.0, 10.0, LABELS, "ab" * 32, "onnxruntime 1.20", "0.1.0")
UNLABELLED = (-1, -1, -1, -1)
FRAME_BYTES = 9 + 41 + 2 * 3 * 4  # of one frame's record


def image(number: int) -> Any:
    """The frame of a number, as no other number has it."""
    return np.random.default_rng(number).normal(41.2, 2.9, (2, 3)).astype(np.float32)


def add(journal: Journal, number: int) -> None:
    journal.add_frame(image(number), number / 10, number, UNLABELLED, None)


def written(frames: int, recording_id: str = ID) -> Journal:
    journal = Journal(ORIGIN, {"debounce.mean": np.array([1.0, 0.0, 0.0])}, recording_id)
    for number in range(1, frames + 1):
        add(journal, number)
    return journal


def numbers(decoded: Decoded) -> list[int]:
    """The numbers of the frames that were read, each of which must be exactly what it was."""
    if decoded.recording is None:
        return []
    recording = decoded.recording
    for number, t_s, frame in zip(
        recording.sequence.tolist(), recording.t.tolist(), recording.frames, strict=True
    ):
        assert t_s == number / 10
        assert frame.tobytes() == image(number).tobytes()
    found: list[int] = recording.sequence.tolist()
    return found
