"""A single finger that was felt and has left: a click too brief for the networks to be sure of.

A press of less than a tenth of a second raises its probability for a frame or two. Where the sensor
is quiet, the depth that was felt meanwhile is the better evidence
(`controller.recognition.contact`).
"""

from typing import Final

import numpy as np

from controller.recognition.contact import ContactEstimate
from controller.shared.aliases import State

# What a tap needs then: shares of its greatest probability, and of its sum over time
PEAK_SHARE: Final = 0.65
SUM_SHARE: Final = 0.5
QUIET_SHARE: Final = 0.8  # of a noiseless sensor's weight (`DebounceSettings.weight`): trusted
_FELT_MM: Final = 2.0  # depth less two deviations, above which a finger is felt for sure
_LEFT_SHARE: Final = 0.6  # of the greatest depth, below which it has left
_SEVERAL_FACTOR: Final = 2.0  # several for so many times as long are no single finger


class FingerTracker:
    """Fingers and depth that were felt in the present touch."""

    def __init__(self) -> None:
        """Begin without a touch."""
        # Frames in which one finger was felt for sure, and several; depth now, and greatest, mm
        self._felt = np.zeros(4)

    def step(self, contact: ContactEstimate | None, *, begins: bool) -> None:
        """Take what touches in the next frame, if anything; `begins`: no touch lasts."""
        if contact is None and begins:
            self._felt[:] = 0.0
        depth_mm = 0.0 if contact is None else contact.depth_mm
        self._felt[2:] = depth_mm, max(depth_mm, self._felt[3])
        if contact is not None and depth_mm - 2.0 * contact.depth_sigma > _FELT_MM:
            self._felt[int(contact.fingers > 1)] += 1.0

    @property
    def left(self) -> bool:
        """Whether a single finger, felt for sure, has left."""
        one, several, depth_mm, deepest_mm = self._felt.tolist()
        return bool(_SEVERAL_FACTOR * one > several and depth_mm <= _LEFT_SHARE * deepest_mm)

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        return {"felt": self._felt.copy()}

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._felt = state["felt"].copy()
