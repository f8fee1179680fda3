"""Telemetry of the last seconds in ring buffers: every taxel and every probability."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.protocol.codec import image_from_bytes
from controller.shared.protocol.messages import Message, Telemetry, Welcome
from controller.shared.protocol.teaching import Vocabulary
from controller.shared.taxel_measures import noise

Array = NDArray[np.float32]

SECONDS: Final = 10.0
FRAMES: Final = 1024  # at most, whatever the rate
NOISE_FRAMES: Final = 60  # the newest ones, for the noise
JUDGED: Final = 20
IMAGE_STEP: Final = 0.005  # of an image in telemetry
NOISE_RATIO: Final = 4.0  # of a noisy taxel to the median one, with touches among the frames


class LabData:
    """The last frames of one orb.

    Attributes:
        labels: Of the probabilities.
    """

    def __init__(self) -> None:
        self._begin(5, 5, ())

    def _begin(self, rows: int, columns: int, labels: tuple[str, ...]) -> None:
        self.labels = labels
        self._images = np.zeros((FRAMES, rows, columns), np.float32)  # z - 1
        self._shares = np.zeros((FRAMES, len(labels)), np.float32)
        self._times_s = np.full(FRAMES, -np.inf)
        self._count = 0  # frames ever taken
        self._noise, self._judged = noise(self._images[:0]), 0

    def connected(self, welcome: Welcome) -> None:
        """Begin anew with an orb."""
        self._begin(welcome.rows, welcome.columns, welcome.labels)

    def take(self, message: Message, now_s: float) -> None:
        """Take a frame, or other gestures, whose probabilities begin anew."""
        if isinstance(message, Telemetry):
            self.step(message, now_s)
        elif isinstance(message, Vocabulary) and message.labels != self.labels:
            self.labels = message.labels
            self._shares = np.zeros((FRAMES, len(self.labels)), np.float32)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the taxels."""
        return self._images.shape[1], self._images.shape[2]

    def step(self, frame: Telemetry, now_s: float) -> None:
        """Take a frame; one of another shape is left out."""
        place = self._count % FRAMES
        if len(frame.image) != self._images[0].size:
            return
        values = np.asarray(image_from_bytes(frame.image), np.float32) - 1.0
        self._images[place] = values.reshape(self.shape)
        right = len(frame.probabilities) == len(self.labels)
        self._shares[place] = frame.probabilities if right else 0.0
        self._times_s[place] = now_s
        self._count += 1

    def taxel_noise(self) -> Array:
        """Return the noise of each taxel, (rows, columns), of z; anew every `JUDGED` frames."""
        if self._count - self._judged >= JUDGED:
            self._judged = self._count
            images = self.recent(float(self._times_s.max()))[1]
            self._noise = noise(images[-NOISE_FRAMES:])
        return self._noise

    def recent(self, now_s: float) -> tuple[NDArray[np.float64], Array, Array]:
        """Return the frames of the last `SECONDS`, oldest first.

        Their times (n,), seconds; images (n, rows, columns), z - 1; probabilities (n, labels).
        """
        filled = min(self._count, FRAMES)
        order = np.arange(self._count - filled, self._count) % FRAMES
        order = order[self._times_s[order] > now_s - SECONDS]
        return self._times_s[order], self._images[order], self._shares[order]
