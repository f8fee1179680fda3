"""The orb's own button, held for long: it opens the pairing window where nobody has a keyboard."""

from typing import Final

HOLD_S: Final = 5.0  # longer than anybody holds it for a label
WINDOW_S: Final = 120  # how long hosts may pair then


class LongPress:
    """Tells once when a button has been down for HOLD_S."""

    def __init__(self) -> None:
        """Begin with the button up."""
        self._since_s: float | None = None
        self._told = False

    def step(self, said: str | None, t_s: float) -> bool:
        """Return whether the button has just been held for long enough.

        Args:
            said: What the sensor says of its button: None (it has none), "null" (up), else down.
            t_s: Now, seconds.
        """
        if said is None or said == "null":
            self._since_s, self._told = None, False
            return False
        if self._since_s is None:
            self._since_s = t_s
        if self._told or t_s - self._since_s < HOLD_S:
            return False
        self._told = True
        return True
