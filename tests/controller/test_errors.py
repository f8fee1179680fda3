"""Output of commands: readable on any terminal, and one sentence when something is wrong."""

import subprocess
import sys

import pytest

from controller import errors
from controller.errors import UserError

PROGRAM = "import sys; from controller import errors; sys.exit(errors.run('orb', lambda: {}))"


def run(body: str, output: str = "") -> subprocess.CompletedProcess[str]:
    """Run a command in a process of its own; its output goes to a file where one is named."""
    command = [sys.executable, "-c", PROGRAM.format(body)]
    if output:
        with open(output, "w") as sink:  # noqa: PTH123
            return subprocess.run(command, stdout=sink, stderr=subprocess.PIPE, text=True)
    return subprocess.run(command, capture_output=True, text=True)


@pytest.mark.skipif(sys.platform != "linux", reason="no /dev/full")
def test_a_full_disk_behind_standard_output_is_one_sentence() -> None:
    done = run("print('x' * 100) or 0", "/dev/full")
    assert done.returncode == 1
    assert done.stderr == "orb: cannot write the output: no space left on device\n"


def test_a_reader_that_has_gone_ends_the_command_silently() -> None:
    command = [sys.executable, "-c", PROGRAM.format("print('x\\n' * 100_000) or 0")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 1


def test_an_ascii_terminal_gets_escapes() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format("print('5 × 5') or 0")],
        capture_output=True, text=True, env={"PYTHONIOENCODING": "ascii"},
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "5 \\xd7 5\n")


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
        *("0 false alarms", "1 false alarm", "2 false alarms"),
    ]


def test_what_a_terminal_would_obey_is_printed_as_an_escape() -> None:
    assert errors.printable("a\nb \x1b]0;title\x07 \u202e é 漢") == (
        "a\nb \\x1b]0;title\\x07 \\u202e é 漢"
    )
    assert errors.one_line("a\nb\x07") == "a\\nb\\x07"
