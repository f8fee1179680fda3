"""Labels from the keys of a terminal during a recording; pure.

Hold 1 to 9: the label of that number, for as long as it is held (1 is the first gesture).
Space: pause and resume. Backspace: drop the last seconds; again: as many more.

A terminal without kitty's protocol sends no releases. There a key counts as released at its last
repeat, once no further repeat has come within the usual interval.
"""

from dataclasses import dataclass
from typing import Final

from controller.keymap.terminal_decoder import BACKSPACE, SPACE, Action, KeyEvent
from controller.recordings.recording import UNKNOWN, Mark

DROP_S: Final = 3.0  # dropped by one backspace: a gesture and the time to notice a mistake

# Timing of a typist's keyboard, in seconds. Systems wait 0.2 to 0.7 s before the first repeat and
# repeat every 0.02 to 0.1 s; a network may bunch characters together or pull them apart.
FIRST_REPEAT_S: Final = 0.75  # timeout of the first repeat, until one was measured
SOONEST_REPEAT_S: Final = 0.18  # an earlier character was typed again
_TIMEOUT_GAPS: Final = 4.0  # timeout in multiples of the longest of the latest gaps
_TIMEOUT_S: Final = (0.25, 1.0)  # bounds of it
_DECAY: Final = 0.9  # of the longest gap after each shorter one


@dataclass(frozen=True, slots=True)
class KeyChange:
    """A key press or release."""

    key: str
    down: bool
    t_s: float  # time; that of a release may be past
    tapped: bool = False  # whether it was typed only once, and held for an unknown time


@dataclass(frozen=True, slots=True)
class LabelCorrection:
    """A new value for recorded frames with times in [from_s, to_s)."""

    column: str  # "key" or "excluded"
    from_s: float
    to_s: float
    value: int  # the new value; of "key", an index into the labels


class KeyLabels:
    """Labels from the keys for the present frame, and corrections of those before it.

    Attributes:
        label: Index of the label whose key is held, 0 if none is, -1 before the first key.
        paused: Whether the present frame is left out of training.
    """

    def __init__(self, labels: int) -> None:
        """Begin without a held key; `labels` is the number of labels with "null"."""
        self.label = UNKNOWN
        self.paused = False
        self._labels = labels
        self._held: list[tuple[str, float]] = []  # label keys and times of their presses, in order
        self._dropped = (0.0, 0.0)  # range of the latest backspace: from, to

    def take(self, change: KeyChange, now_s: float) -> list[LabelCorrection | Mark]:
        """Process a press or release before the frame at `now_s`; return its corrections."""
        if change.key.isdigit():
            return self._label(change, now_s) if 0 < int(change.key) < self._labels else []
        if not change.down:
            return []
        if change.key == SPACE:
            self.paused = not self.paused
            return [Mark(now_s, "key", "pause" if self.paused else "go on")]
        return self._drop(change.t_s, now_s) if change.key == BACKSPACE else []

    def _label(self, change: KeyChange, now_s: float) -> list[LabelCorrection | Mark]:
        """Begin or end a label; the key pressed last counts."""
        down_s = next((t_s for key, t_s in self._held if key == change.key), change.t_s)
        self._held = [pair for pair in self._held if pair[0] != change.key]
        if change.down:
            self._held.append((change.key, change.t_s))
        self.label = int(self._held[-1][0]) if self._held else 0
        if change.tapped:  # a label for an unknown time
            return [LabelCorrection("key", down_s, now_s, UNKNOWN)]
        return [LabelCorrection("key", change.t_s, now_s, self.label)] if change.t_s < now_s else []

    def _drop(self, t_s: float, now_s: float) -> list[LabelCorrection | Mark]:
        """Drop the last seconds; after a recent drop, as many before them."""
        before_s, until_s = self._dropped
        again = t_s - DROP_S < until_s
        from_s = max((before_s if again else t_s) - DROP_S, 0.0)
        self._dropped = (from_s, t_s)
        return [
            LabelCorrection("excluded", from_s, now_s, True),
            Mark(now_s, "key", f"drop {from_s:.3f} to {t_s:.3f} s"),
        ]


class HeldKeys:
    """State of the keys, from presses and releases or from repeated characters."""

    def __init__(self) -> None:
        self._down: list[str] = []  # by presses and releases
        self._typed = ""  # the key that repeats
        self._first_s = self._last_s = 0.0  # of its characters
        self._delay_s = 0.0  # measured from a character to its first repeat; 0: unknown
        self._gap_s = 0.0  # the longest of the latest gaps between repeats

    def take(self, stroke: KeyEvent, t_s: float) -> list[KeyChange]:
        """Return the changes by a key event at `t_s`, oldest first."""
        changes = self.pass_time(t_s)
        key = stroke.key
        if stroke.action is Action.TYPED:
            return changes + self._type(key, t_s)
        if stroke.action is Action.PRESSED and key not in self._down:
            self._down.append(key)
            changes.append(KeyChange(key, True, t_s))
        elif stroke.action is Action.RELEASED and key in self._down:
            self._down.remove(key)
            changes.append(KeyChange(key, False, t_s))
        return changes

    def pass_time(self, t_s: float) -> list[KeyChange]:
        """Return the releases up to `t_s` by missing repeats."""
        if self._typed and t_s - self._last_s > self._timeout_s():
            return self._release()
        return []

    def let_go(self, t_s: float) -> list[KeyChange]:
        """Return the releases of all held keys."""
        changes = [KeyChange(key, False, t_s) for key in self._down]
        self._down.clear()
        return changes + self._release()

    def _type(self, key: str, t_s: float) -> list[KeyChange]:
        """Process a character: a repeat, or a press."""
        gap_s = t_s - self._last_s
        first = self._first_s == self._last_s
        if key == self._typed and not (first and gap_s < SOONEST_REPEAT_S):
            if first:
                self._delay_s = gap_s
            else:
                self._gap_s = max(gap_s, _DECAY * self._gap_s)
            self._last_s = t_s
            return []
        changes = self._release()
        self._typed, self._first_s, self._last_s = key, t_s, t_s
        return [*changes, KeyChange(key, True, t_s)]

    def _release(self) -> list[KeyChange]:
        """Return the release of the repeating key."""
        key, self._typed = self._typed, ""
        tapped = self._first_s == self._last_s
        return [KeyChange(key, False, self._last_s, tapped)] if key else []

    def _timeout_s(self) -> float:
        """Return the time after its last character within which a key may still be held."""
        least, most = _TIMEOUT_S
        if self._first_s == self._last_s:
            return min(1.5 * self._delay_s, most) if self._delay_s else FIRST_REPEAT_S
        return min(max(_TIMEOUT_GAPS * self._gap_s, least), most)
