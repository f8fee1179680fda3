"""Labels from keys while a session is recorded; pure.

Hold 1 to 9: the label of that number, for as long as it is held (1 is the first gesture).
Space: pause, and go on. Backspace: the last seconds are dropped; again: as many more.
"""

from dataclasses import dataclass
from typing import Final

from controller.capture.terminal_decoder import BACKSPACE, SPACE, KeyChange
from controller.recordings.recording import UNKNOWN, Mark

DROP_S: Final = 3.0  # what one backspace drops: a gesture and the time to see that it went wrong


@dataclass(frozen=True, slots=True)
class LabelCorrection:
    """Something said afterwards of frames that were taken already.

    Attributes:
        column: "key" or "excluded".
        from_s: The first time that is meant.
        to_s: The first time that is not.
        value: What is true there; of "key", an index into the labels.
    """

    column: str
    from_s: float
    to_s: float
    value: int


class KeyLabels:
    """What the keys say of the present frame, and of those before it.

    Attributes:
        label: Index of the label whose key is held, 0 while none is; -1 until one ever was,
            since whoever does not use the keys says nothing by that.
        paused: Nobody shall learn from the present frame.
    """

    def __init__(self, labels: int) -> None:
        """Begin with no key down; `labels` is how many there are, "null" included."""
        self.label = UNKNOWN
        self.paused = False
        self._labels = labels
        self._held: list[tuple[str, float]] = []  # label keys and when they went down, in order
        self._dropped = (0.0, 0.0)  # what the latest backspace dropped: from, to

    def take(self, change: KeyChange, now_s: float) -> list[LabelCorrection | Mark]:
        """Take a key that went down or came up, and return what it says of earlier frames.

        Args:
            change: The key.
            now_s: Time of the present frame, which is not taken yet.
        """
        if change.key.isdigit():
            return self._label(change, now_s) if 0 < int(change.key) < self._labels else []
        if not change.down:
            return []
        if change.key == SPACE:
            self.paused = not self.paused
            return [Mark(now_s, "key", "pause" if self.paused else "go on")]
        return self._drop(change.t_s, now_s) if change.key == BACKSPACE else []

    def _label(self, change: KeyChange, now_s: float) -> list[LabelCorrection | Mark]:
        """Begin or end a label. The key that went down last counts."""
        down_s = next((t_s for key, t_s in self._held if key == change.key), change.t_s)
        self._held = [pair for pair in self._held if pair[0] != change.key]
        if change.down:
            self._held.append((change.key, change.t_s))
        self.label = int(self._held[-1][0]) if self._held else 0
        if change.tapped:  # a label was meant, but nobody knows for how long
            return [LabelCorrection("key", down_s, now_s, UNKNOWN)]
        return [LabelCorrection("key", change.t_s, now_s, self.label)] if change.t_s < now_s else []

    def _drop(self, t_s: float, now_s: float) -> list[LabelCorrection | Mark]:
        """Drop the last seconds; if they were dropped just now, as many before them."""
        before_s, until_s = self._dropped
        again = t_s - DROP_S < until_s
        from_s = max((before_s if again else t_s) - DROP_S, 0.0)
        self._dropped = (from_s, t_s)
        return [
            LabelCorrection("excluded", from_s, now_s, True),
            Mark(now_s, "key", f"drop {from_s:.3f} to {t_s:.3f} s"),
        ]
