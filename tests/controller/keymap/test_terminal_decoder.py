"""Key events in a terminal's bytes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.keymap.terminal_decoder import BACKSPACE, SPACE, Action, Decoder, KeyEvent, Signal


def strokes(data: bytes) -> list[KeyEvent | Signal]:
    return Decoder().feed(data)


def typed(key: str) -> KeyEvent:
    return KeyEvent(key, Action.TYPED)


def pressed(key: str) -> KeyEvent:
    return KeyEvent(key, Action.PRESSED)


def released(key: str) -> KeyEvent:
    return KeyEvent(key, Action.RELEASED)


ONE, TWO = typed("1"), typed("2")
UNKNOWN = b"Q\t\r\xc3\xa4\x1b[A\x1bOP\x1b[15~\x1b[5;2~\x1b[<0;3;4M\x1b[99~\xff"


@pytest.mark.parametrize(
    ("sent", "events"),
    [
        (b"1 \x7f2\x08", [ONE, typed(SPACE), typed(BACKSPACE), TWO, typed(BACKSPACE)]),
        (b"qa7", [typed("q"), typed("a"), typed("7")]),
        (UNKNOWN + b"2", [TWO]),
        (b"\x1b1", [ONE]),  # escape typed by itself spoils nothing
        (b"\x1b\x1b[A2", [TWO]),
        (b"\x1b[12\x1b[D2", [TWO]),  # a sequence that was cut off
        (b"q\x1b[2", [typed("q")]),
        (b"\x1b[20~\x1b[19;5~", [typed("f9"), typed("f8")]),
        # Kitty's terminal tells presses and releases.
        (b"\x1b[49;1:1u\x1b[49;1:2u\x1b[49;1:3u", [pressed("1"), released("1")]),
        (b"\x1b[49u\x1b[127;;u", [pressed("1"), pressed(BACKSPACE)]),  # fields unsaid
        (b"\x1b[32;129u\x1b[57402;1:1u", [pressed(SPACE), pressed("3")]),  # num lock; the keypad
        (b"\x1b[20;1:1~\x1b[20;1:2~\x1b[20;1:3~", [typed("f9"), released("f9")]),
        (b"\x1b[38:49:49;1:1u", [pressed("1")]),  # a French keyboard has & where others have 1
        # Ctrl keys, on which the terminal no longer acts.
        (b"\x1b[99;5u\x1b[122;5:1u", [Signal.INTERRUPT, Signal.SUSPEND]),
        (b"\x1b[1089::99;5u", [Signal.INTERRUPT]),  # с on a Russian keyboard
        (b"\x1b[106::99;5u", []),  # j, where others have c
        (b"\x1b[99;5:3u\x1b[49;5u\x1b[49;3u", [released("c")]),  # Ctrl-1; Alt-1
        # Answers, and the loss of the window.
        (b"\x1b[?0u\x1b[?62;4c", [Signal.SPEAKS_KITTY, Signal.ANSWERED]),
        (b"\x1b[O\x1b[I", [Signal.AWAY]),
    ],
)
def test_terminal_bytes_are_keys_and_signals(sent: bytes, events: list[KeyEvent | Signal]) -> None:
    assert strokes(sent) == events


KEYS = st.sampled_from(
    [b"1", b" ", b"\x7f", b"\x1b[49;1:3u", b"\x1b[?62c", b"\x1b[A", b"\x1b[99;5u"]
)


@given(st.lists(st.binary(max_size=80) | KEYS), st.integers(1, 7))
def test_any_bytes_are_cut_alike_however_they_come(parts: list[bytes], size: int) -> None:
    data = b"".join(parts)
    decoder = Decoder()
    pieces = [one for i in range(0, len(data), size) for one in decoder.feed(data[i : i + size])]
    assert pieces == strokes(data)


@given(st.binary())
def test_after_any_bytes_a_key_is_understood_again(noise: bytes) -> None:
    decoder = Decoder()
    decoder.feed(noise)
    decoder.feed(b"\x1b[A")  # whatever was begun is over
    assert decoder.feed(b"\x1b[50;1:1u") == [pressed("2")]
