"""Output of commands: readable on any terminal, and one sentence when something is wrong."""

import pytest

from controller.shared import errors
from controller.shared.errors import UserError


def test_errors_become_sentences(capsys: pytest.CaptureFixture[str]) -> None:
    def wrong() -> int:
        raise UserError("the file \x1b[31m is no bundle")

    def full() -> int:
        raise OSError(28, "No space left on device", "rest.json")

    def stopped() -> int:
        raise KeyboardInterrupt

    assert [errors.run("orb", command) for command in (wrong, full, stopped)] == [2, 1, 130]
    assert capsys.readouterr().err == (
        "orb: the file \\x1b[31m is no bundle\norb: rest.json: no space left on device\n"
    )


def test_one_thing_is_no_plural() -> None:
    assert [errors.count(n, "false alarm") for n in (0, 1, 2)] == [
        *("0 false alarms", "1 false alarm", "2 false alarms")
    ]


def test_what_a_terminal_would_obey_is_printed_as_an_escape() -> None:
    assert errors.printable("a\nb \x1b]0;title\x07 \u202e é 漢") == (
        "a\nb \\x1b]0;title\\x07 \\u202e é 漢"
    )
    assert errors.one_line("a\nb\x07") == "a\\nb\\x07"
