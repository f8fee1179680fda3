"""Detection of a long press of the orb's button, which opens the pairing window."""

from typing import Final

HOLD_S: Final = 5.0  # longer than a press that labels
WINDOW_S: Final = 120  # duration of the pairing window


class LongPress:
    """Detects once that a button has been down for HOLD_S."""

    def __init__(self) -> None:
        """Begin with the button up."""
        self._since_s: float | None = None
        self._done = False

    def step(self, state: str | None, t_s: float) -> bool:
        """Return whether the button has just been down for HOLD_S.

        Args:
            state: State of the sensor's button: None (it has none), "null" (up), else down.
            t_s: Now, seconds.
        """
        if state is None or state == "null":
            self._since_s, self._done = None, False
            return False
        if self._since_s is None:
            self._since_s = t_s
        if self._done or t_s - self._since_s < HOLD_S:
            return False
        self._done = True
        return True
