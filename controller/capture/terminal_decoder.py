"""From a terminal's bytes to keys that go down and come up; pure.

Two kinds of terminal are understood. With the kitty keyboard protocol [1] a terminal tells each
press and each release. All others send characters only: one when a key goes down, and after a
while the same again and again for as long as it is held. Then a key is up when no repeat came
within the time that repeats take here, and it came up, as far as anybody knows, at the last one.

[1] https://sw.kovidgoyal.net/kitty/keyboard-protocol/
"""

from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

BACKSPACE: Final = "backspace"
SPACE: Final = " "

# What a typist's keyboard does, in seconds. Systems wait 0.2 to 0.7 s before the first repeat and
# repeat every 0.02 to 0.1 s; a network may bunch characters together or pull them apart.
FIRST_REPEAT_S: Final = 0.75  # the first repeat comes within this, until one was seen
SOONEST_REPEAT_S: Final = 0.18  # what comes sooner was typed twice
_PATIENCE: Final = 4.0  # times the longest of the latest gaps
_PATIENCE_S: Final = (0.25, 1.0)  # bounds of it
_FORGET: Final = 0.9  # share of the longest gap that is left after each shorter one

_LONGEST: Final = 64  # bytes of an escape sequence; keys need 20
_KEYPAD_0: Final = 57399  # kitty's number of the keypad's 0
_NAMES: Final = {
    8: BACKSPACE,
    127: BACKSPACE,
    32: SPACE,
    **{ord(digit): digit for digit in "0123456789"},
    **{_KEYPAD_0 + i: str(i) for i in range(10)},
}
_CONTROL: Final = 4  # bit of the modifiers
_OTHERS: Final = 2 | 8 | 16 | 32  # alt, super, hyper, meta


class Action(Enum):
    """What a terminal says of a key."""

    TYPED = auto()  # a character, first or repeated
    PRESSED = auto()
    RELEASED = auto()


class Signal(Enum):
    """What the terminal says that is no key."""

    INTERRUPT = auto()  # Ctrl-C, where the terminal tells every key
    SUSPEND = auto()  # Ctrl-Z
    QUIT = auto()  # Ctrl-\
    AWAY = auto()  # somebody looks at another window: releases will not be told
    SPEAKS_KITTY = auto()  # an answer to QUERY
    ANSWERED = auto()  # the end of the answers to QUERY


_CONTROLS: Final = {
    ord("c"): Signal.INTERRUPT,
    ord("z"): Signal.SUSPEND,
    ord("\\"): Signal.QUIT,
}

QUERY: Final = b"\x1b[?u\x1b[c"  # do you speak kitty's protocol? And one that all answer
# Tell presses and releases of all keys, on any layout; and when the window is left.
ENABLE: Final = b"\x1b[>15u\x1b[?1004h"
DISABLE: Final = b"\x1b[?1004l\x1b[<u"


@dataclass(frozen=True, slots=True)
class KeyEvent:
    """What a terminal says of one key: "0" to "9", SPACE or BACKSPACE."""

    key: str
    action: Action


class Decoder:
    """Cuts a terminal's bytes into strokes and signals; what it does not know it skips."""

    def __init__(self) -> None:
        self._sequence: bytearray | None = None  # an escape sequence so far, after ESC

    def feed(self, data: bytes) -> list[KeyEvent | Signal]:
        """Return what these bytes, cut anywhere, say."""
        return [one for byte in data if (one := self._take(byte)) is not None]

    def _take(self, byte: int) -> KeyEvent | Signal | None:
        sequence = self._sequence
        if byte == 0x1B:  # ESC begins anew, whatever was before
            self._sequence = bytearray()
            return None
        if sequence is None:
            return KeyEvent(_NAMES[byte], Action.TYPED) if byte in _NAMES else None
        if not sequence:
            self._sequence = bytearray([byte]) if byte in b"[O" else None
            return self._take(byte) if self._sequence is None else None
        if sequence[0] == ord("O") or 0x40 <= byte <= 0x7E:  # the last byte
            self._sequence = None
            return _meaning(bytes(sequence[1:]), byte) if sequence[0] == ord("[") else None
        if not 0x20 <= byte < 0x40 or len(sequence) >= _LONGEST:  # no sequence after all
            self._sequence = None
            return self._take(byte)
        sequence.append(byte)
        return None


def _meaning(parameters: bytes, final: int) -> KeyEvent | Signal | None:
    """Return what a control sequence says, if it is for us."""
    if final == ord("O") and not parameters:
        return Signal.AWAY
    if parameters.startswith(b"?"):
        return {ord("u"): Signal.SPEAKS_KITTY, ord("c"): Signal.ANSWERED}.get(final)
    if final != ord("u"):
        return None
    fields = [_numbers(field) for field in parameters.split(b";")]
    codes = fields[0]
    modifiers, event = (*(fields[1] if len(fields) > 1 else ()), 0, 0)[:2]  # 0: unsaid
    return _key(codes[0], codes[2] if len(codes) > 2 else 0, max(modifiers - 1, 0), event or 1)


def _key(code: int, base: int, modifiers: int, event: int) -> KeyEvent | Signal | None:
    """Return what kitty's protocol says of a key.

    Args:
        code: The key in the user's layout.
        base: The key there on an American keyboard, 0 if unsaid: a French 1 is "&".
        modifiers: Bits.
        event: 1 down, 2 repeated, 3 up.
    """
    if modifiers & _CONTROL and event == 1:
        return _CONTROLS.get(code if code < 128 else base)
    name = _NAMES.get(code) or _NAMES.get(base)
    if name is None or event not in (1, 3) or (event == 1 and modifiers & (_CONTROL | _OTHERS)):
        return None
    return KeyEvent(name, Action.PRESSED if event == 1 else Action.RELEASED)


def _numbers(field: bytes) -> tuple[int, ...]:
    """Return the numbers of one field, 0 where there is none."""
    return tuple(int(part) if part.isdigit() else 0 for part in field.split(b":"))


@dataclass(frozen=True, slots=True)
class KeyChange:
    """A key that goes down or comes up.

    Attributes:
        key: Which.
        down: Whether it goes down.
        t_s: When; a key that comes up may have done so a while ago.
        tapped: It was typed once only, so nobody knows for how long it was held.
    """

    key: str
    down: bool
    t_s: float
    tapped: bool = False


class HeldKeys:
    """Which keys are down, whatever the terminal tells of them."""

    def __init__(self) -> None:
        self._down: list[str] = []  # as told by presses and releases
        self._typed = ""  # the key whose characters come
        self._first_s = self._last_s = 0.0  # of these characters
        self._delay_s = 0.0  # from a character to its first repeat, as seen here; 0: not yet
        self._gap_s = 0.0  # the longest of the latest gaps between repeats

    def take(self, stroke: KeyEvent, t_s: float) -> list[KeyChange]:
        """Return what a stroke at `t_s` changes, oldest first."""
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
        """Return the keys that have come up by `t_s`, because their characters stay away."""
        if self._typed and t_s - self._last_s > self._patience_s():
            return self._release()
        return []

    def let_go(self, t_s: float) -> list[KeyChange]:
        """Return every key that is down as one that comes up."""
        changes = [KeyChange(key, False, t_s) for key in self._down]
        self._down.clear()
        return changes + self._release()

    def _type(self, key: str, t_s: float) -> list[KeyChange]:
        """Take a character: a repeat, or a key that goes down."""
        gap_s = t_s - self._last_s
        fresh = self._first_s == self._last_s
        if key == self._typed and not (fresh and gap_s < SOONEST_REPEAT_S):
            if fresh:
                self._delay_s = gap_s
            else:
                self._gap_s = max(gap_s, _FORGET * self._gap_s)
            self._last_s = t_s
            return []
        changes = self._release()
        self._typed, self._first_s, self._last_s = key, t_s, t_s
        return [*changes, KeyChange(key, True, t_s)]

    def _release(self) -> list[KeyChange]:
        """End the key whose characters came."""
        key, self._typed = self._typed, ""
        tapped = self._first_s == self._last_s
        return [KeyChange(key, False, self._last_s, tapped)] if key else []

    def _patience_s(self) -> float:
        """Return how long after its last character a key may still be down."""
        least, most = _PATIENCE_S
        if self._first_s == self._last_s:
            return min(1.5 * self._delay_s, most) if self._delay_s else FIRST_REPEAT_S
        return min(max(_PATIENCE * self._gap_s, least), most)
