"""Calibration of depth: touches of a known depth, and the factor of what is estimated of them.

A dome that stretches more shows the same touch as deeper, and each dome stretches by its own.
"""

from typing import Final

import numpy as np

from controller.bundles.bundle import Bundle
from controller.diagnostics.report import Row, Verdict
from controller.recognition.images.frames import Window
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Networks, Pipeline, Probabilities
from controller.shared.aliases import Frames
from controller.shared.errors import UserError

PRESSING_S: Final = 60.0
FEWEST_TOUCHES: Final = 5
HELD_S: Final = 0.5  # the shortest touch that counts
DEPTHS_MM: Final = (2.0, 15.0)  # that can be asked for: a lighter touch may not be felt
FACTOR_RANGE: Final = (0.3, 3.0)  # another one is of another depth than was asked for


class NoGestures(Networks):
    """Networks that recognise no gesture: what touches does not depend on them."""

    def __init__(self, classes: int) -> None:
        """Prepare the answer."""
        self._null: Probabilities = np.eye(1, classes, dtype=np.float32)[0]

    def probabilities(self, window: Window, user: str = "") -> Probabilities:
        """Return certainty of no gesture, (classes,)."""
        return self._null


def calibrate(loaded: Bundle, frames: Frames, depth_mm: float) -> tuple[Row, float | None]:
    """Return the row on touches of a depth, and the factor of estimated depths; None: refused.

    Args:
        loaded: A bundle that estimates depth.
        frames: Untouched for three seconds and then touched, at its rate, (n, rows, columns), pF.
        depth_mm: Of each touch.

    Raises:
        UserError: The bundle is for another sensor.
    """
    refuse_other(loaded, *frames.shape[1:])
    touches = _held(loaded, frames)
    if len(touches) < FEWEST_TOUCHES:
        felt = f"{len(touches)} touches of {HELD_S:.1f} s or more were felt"
        words = f"{felt}, {FEWEST_TOUCHES} are needed"
        return Row("depth", Verdict.FAULT, words, "press with one finger, and hold each"), None
    factor = depth_mm / float(np.median(touches))
    found = f"{len(touches)} touches of {depth_mm:.1f} mm look like {np.median(touches):.1f} mm"
    if not FACTOR_RANGE[0] <= factor <= FACTOR_RANGE[1]:
        return Row("depth", Verdict.FAULT, found, "check how deep they were"), None
    return Row("depth", Verdict.GOOD, found), factor


def refuse_other(loaded: Bundle, rows: int, columns: int) -> None:
    """Raise UserError if a bundle estimates no depth on so many taxels."""
    if loaded.contacts is None or (rows, columns) != (loaded.rows, loaded.columns):
        raise UserError(
            f"the bundle estimates depth on {loaded.rows}×{loaded.columns} taxels, not on "
            f"{rows}×{columns}; calibrate without --depth"
        )


def _held(loaded: Bundle, frames: Frames) -> list[float]:
    """Return the estimated depth of each touch of one finger that is held, mm."""
    pipeline = Pipeline(loaded.settings, NoGestures(len(loaded.labels)), Mapping())
    touches, depths = list[float](), list[float]()
    for number, frame in enumerate(frames, 1):
        contact = pipeline.step(frame.astype(np.float32), number / loaded.rate_hz).contact
        if contact is not None and contact.fingers == 1:
            depths.append(contact.depth_mm)
        elif contact is None:
            if len(depths) >= HELD_S * loaded.rate_hz:
                touches.append(float(np.median(depths[len(depths) // 4 : -len(depths) // 4])))
            depths = []
    return touches
