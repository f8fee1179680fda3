"""A small journal as tests have it: frame k is known by its number, and was taken at k / 10 s."""

from typing import Any

import numpy as np

from controller.recordings.journal import NOWHERE, Journal
from controller.recordings.journal_repair import Decoded
from controller.recordings.recording import Provenance

KEY = bytes(range(16))
ORIGIN = Provenance(
    device_id="virtual-1",
    rows=2,
    columns=3,
    pitch_mm=10.0,
    rate_hz=10.0,
    labels=("null", "press", "pinch"),
    bundle="ab" * 32,
    engine="onnxruntime 1.20",
    software="0.1.0",
)
NOBODY = (-1, -1, -1, -1)


def image(number: int) -> Any:
    """The frame of a number, as no other number has it."""
    return np.random.default_rng(number).normal(41.2, 2.9, (2, 3)).astype(np.float32)


def add(journal: Journal, number: int) -> None:
    journal.frame(image(number), number / 10, number, NOBODY, False, NOWHERE)


def written(frames: int, sync_every: int = 10, key: bytes = KEY) -> Journal:
    """A journal of some frames, of which the disk has confirmed every tenth."""
    journal = Journal(ORIGIN, {"debounce.mean": np.array([1.0, 0.0, 0.0])}, key)
    for number in range(1, frames + 1):
        add(journal, number)
        if number % sync_every == 0:
            journal.synced(len(journal.data))
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
