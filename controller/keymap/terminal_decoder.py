"""Decoder of a terminal's bytes into key events; pure.

Two kinds of terminals are supported. With the kitty keyboard protocol [1] a terminal sends each
press and each release. All others send characters only: one at the press of a key, and repeats
while it is held.

[1] https://sw.kovidgoyal.net/kitty/keyboard-protocol/
"""

from dataclasses import dataclass
from enum import Enum, auto
from string import ascii_lowercase, digits
from typing import Final

BACKSPACE: Final = "backspace"
SPACE: Final = " "

_LONGEST: Final = 64  # bytes of an escape sequence; keys need 20
_KEYPAD_0: Final = 57399  # kitty's number of the keypad's 0
_CHARACTERS: Final = {
    8: BACKSPACE,
    127: BACKSPACE,
    **{ord(sign): sign for sign in SPACE + digits + ascii_lowercase},
    **{_KEYPAD_0 + i: str(i) for i in range(10)},
}
# CSI NUMBER ~, as nearly every terminal sends function keys.
_FUNCTION_KEYS: Final = {17: "f6", 18: "f7", 19: "f8", 20: "f9", 21: "f10", 23: "f11", 24: "f12"}
_CONTROL: Final = 4  # bit of the modifiers
_OTHERS: Final = 2 | 8 | 16 | 32  # alt, super, hyper, meta


class Action(Enum):
    """Event of a key."""

    TYPED = auto()  # a character, first or repeated
    PRESSED = auto()
    RELEASED = auto()


class Signal(Enum):
    """A message of the terminal that is no key."""

    INTERRUPT = auto()  # Ctrl-C, where the terminal sends every key
    SUSPEND = auto()  # Ctrl-Z
    AWAY = auto()  # the window lost the focus: no releases follow
    SPEAKS_KITTY = auto()  # an answer to QUERY
    ANSWERED = auto()  # the end of the answers to QUERY


_CONTROLS: Final = {ord("c"): Signal.INTERRUPT, ord("z"): Signal.SUSPEND}

QUERY: Final = b"\x1b[?u\x1b[c"  # kitty's protocol, and a query that every terminal answers
# Enables presses and releases of all keys, on any layout, and the loss of the focus.
ENABLE: Final = b"\x1b[>15u\x1b[?1004h"
DISABLE: Final = b"\x1b[?1004l\x1b[<u"


@dataclass(frozen=True, slots=True)
class KeyEvent:
    """An event of one key: "0" to "9", "a" to "z", "f6" to "f12", SPACE or BACKSPACE."""

    key: str
    action: Action


class Decoder:
    """Decoder of a terminal's bytes into key events and signals; unknown bytes are skipped."""

    def __init__(self) -> None:
        self._sequence: bytearray | None = None  # an escape sequence so far, after ESC

    def feed(self, data: bytes) -> list[KeyEvent | Signal]:
        """Return the events in these bytes, which may be cut anywhere."""
        return [event for byte in data if (event := self._take(byte)) is not None]

    def _take(self, byte: int) -> KeyEvent | Signal | None:
        sequence = self._sequence
        if byte == 0x1B:  # ESC begins a sequence, whatever was before
            self._sequence = bytearray()
            return None
        if sequence is None:
            return KeyEvent(_CHARACTERS[byte], Action.TYPED) if byte in _CHARACTERS else None
        if not sequence:
            self._sequence = bytearray([byte]) if byte in b"[O" else None
            return self._take(byte) if self._sequence is None else None
        if sequence[0] == ord("O") or 0x40 <= byte <= 0x7E:  # the last byte
            self._sequence = None
            return _decode(bytes(sequence[1:]), byte) if sequence[0] == ord("[") else None
        if not 0x20 <= byte < 0x40 or len(sequence) >= _LONGEST:  # no sequence after all
            self._sequence = None
            return self._take(byte)
        sequence.append(byte)
        return None


def _decode(parameters: bytes, final: int) -> KeyEvent | Signal | None:
    """Return the event of a control sequence; None for those of no interest."""
    if final == ord("O") and not parameters:
        return Signal.AWAY
    if parameters.startswith(b"?"):
        return {ord("u"): Signal.SPEAKS_KITTY, ord("c"): Signal.ANSWERED}.get(final)
    fields = [_numbers(field) for field in parameters.split(b";")]
    codes = fields[0]
    modifiers, event = (*(fields[1] if len(fields) > 1 else ()), 0, 0)[:2]  # 0: left out
    if final == ord("~") and codes[0] in _FUNCTION_KEYS and event != 2:
        action = Action.RELEASED if event == 3 else Action.TYPED
        return KeyEvent(_FUNCTION_KEYS[codes[0]], action)
    if final != ord("u"):
        return None
    return _key(codes[0], codes[2] if len(codes) > 2 else 0, max(modifiers - 1, 0), event or 1)


def _key(code: int, base: int, modifiers: int, event: int) -> KeyEvent | Signal | None:
    """Return the event of a key in kitty's protocol: 1 down, 2 repeated, 3 up.

    `code` is the key in the user's layout, `base` that on an American keyboard, 0 if left out: a
    French 1 is "&".
    """
    if modifiers & _CONTROL and event == 1:
        return _CONTROLS.get(code if code < 128 else base)
    name = _CHARACTERS.get(code) or _CHARACTERS.get(base)
    if name is None or event not in (1, 3) or (event == 1 and modifiers & (_CONTROL | _OTHERS)):
        return None
    return KeyEvent(name, Action.PRESSED if event == 1 else Action.RELEASED)


def _numbers(field: bytes) -> tuple[int, ...]:
    """Return the numbers of one field, 0 where one is left out."""
    return tuple(int(part) if part.isdigit() else 0 for part in field.split(b":"))
