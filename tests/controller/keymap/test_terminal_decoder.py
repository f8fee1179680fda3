"""Key events in a terminal's bytes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.keymap.terminal_decoder import (
    BACKSPACE,
    SPACE,
    Action,
    Decoder,
    KeyEvent,
    Signal,
)


def strokes(data: bytes) -> list[KeyEvent | Signal]:
    return Decoder().feed(data)


def typed(key: str) -> KeyEvent:
    return KeyEvent(key, Action.TYPED)


def pressed(key: str) -> KeyEvent:
    return KeyEvent(key, Action.PRESSED)


def released(key: str) -> KeyEvent:
    return KeyEvent(key, Action.RELEASED)


def test_an_ordinary_terminal_sends_characters() -> None:
    assert strokes(b"1 \x7f9\x08") == [
        typed("1"), typed(SPACE), typed(BACKSPACE), typed("9"), typed(BACKSPACE),
    ]  # fmt: skip


def test_what_is_no_key_of_ours_is_skipped() -> None:
    arrow, f5, page_up, mouse = b"\x1b[A", b"\x1b[15~", b"\x1b[5;2~", b"\x1b[<0;3;4M"
    assert strokes(b"Q\t\r\xc3\xa4" + arrow + b"\x1bOP" + f5 + page_up + mouse + b"2") == [
        typed("2")
    ]


def test_escape_typed_by_itself_spoils_nothing() -> None:
    assert strokes(b"\x1b1") == [typed("1")]
    assert strokes(b"\x1b\x1b[A2") == [typed("2")]
    assert strokes(b"\x1b[12\x1b[D3") == [typed("3")]  # a sequence that was cut off


def test_kitty_s_terminal_tells_presses_and_releases() -> None:
    assert strokes(b"\x1b[49;1:1u\x1b[49;1:2u\x1b[49;1:3u") == [pressed("1"), released("1")]
    assert strokes(b"\x1b[49u\x1b[127;;u\x1b[32;129u") == [  # fields unsaid; num lock
        pressed("1"), pressed(BACKSPACE), pressed(SPACE),
    ]  # fmt: skip
    assert strokes(b"\x1b[57402;1:1u") == [pressed("3")]  # the keypad


def test_a_french_keyboard_needs_no_shift_for_its_digits() -> None:
    assert strokes(b"\x1b[38:49:49;1:1u") == [pressed("1")]  # & is where others have 1


def test_ctrl_keys_that_the_terminal_no_longer_acts_on_are_signals() -> None:
    assert strokes(b"\x1b[99;5u\x1b[122;5:1u\x1b[92;69u") == [
        Signal.INTERRUPT, Signal.SUSPEND, Signal.QUIT,
    ]  # fmt: skip
    assert strokes(b"\x1b[1089::99;5u") == [Signal.INTERRUPT]  # с on a Russian keyboard
    assert strokes(b"\x1b[106::99;5u") == []  # j, where others have c
    assert strokes(b"\x1b[99;5:3u\x1b[49;5u\x1b[49;3u") == [released("c")]  # Ctrl-1; Alt-1


def test_answers_and_the_loss_of_the_window_are_told() -> None:
    assert strokes(b"\x1b[?0u\x1b[?62;4c\x1b[O\x1b[I") == [
        Signal.SPEAKS_KITTY, Signal.ANSWERED, Signal.AWAY,
    ]  # fmt: skip


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


@pytest.mark.parametrize(
    ("sent", "keys"),
    [
        (b"\x1b[20~", ["f9"]),
        (b"a\x1b[19;5~7", ["a", "f8", "7"]),
        (b"\x1b[A\x1bOP\x1b[99~A\xff", []),
        (b"q\x1b[2", ["q"]),
    ],
)
def test_letters_and_function_keys_are_keys(sent: bytes, keys: list[str]) -> None:
    assert strokes(sent) == [typed(key) for key in keys]


def test_kitty_s_terminal_sends_releases_of_function_keys() -> None:
    assert strokes(b"\x1b[20;1:1~\x1b[20;1:2~\x1b[20;1:3~") == [typed("f9"), released("f9")]
