"""A long press of the orb's button, which opens the pairing window without a keyboard."""

from typing import Final

HOLD_S: Final = 5.0  # longer than it is held for a label
WINDOW_S: Final = 120  # how long hosts may pair then


class LongPress:
    """Detects once that a button has been down for HOLD_S."""

    def __init__(self) -> None:
        """Begin with the button up."""
        self._since_s: float | None = None
        self._done = False

    def step(self, said: str | None, t_s: float) -> bool:
        """Return whether the button has just been held for long enough.

        Args:
            said: State of the sensor's button: None (it has none), "null" (up), else down.
            t_s: Now, seconds.
        """
        if said is None or said == "null":
            self._since_s, self._done = None, False
            return False
        if self._since_s is None:
            self._since_s = t_s
        if self._done or t_s - self._since_s < HOLD_S:
            return False
        self._done = True
        return True
