"""Rise of a touch as a device estimates it: its depth above the mean of the .2 s before."""

NEWEST = 1 / 9  # share of a frame in that mean
LANDING = 3  # frames whose rise is none


class Rise:
    """Follows a touch at 40 frames a second."""

    def __init__(self) -> None:
        self._usual_mm, self._age = 0.0, 0

    def of(self, depth_mm: float) -> float:
        """Return the rise of the next frame, mm; a depth of 0 ends the touch."""
        self._age = self._age + 1 if depth_mm else 0
        newest = NEWEST if self._age > LANDING else 1.0
        self._usual_mm += (depth_mm - self._usual_mm) * newest
        return depth_mm - self._usual_mm
