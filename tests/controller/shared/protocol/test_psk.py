"""The file that holds the key: its owner's alone, and never a surprise."""

import os
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from controller.__main__ import main as controller
from controller.shared.errors import TroubleError
from controller.shared.protocol import psk
from controller.shared.protocol.psk import KeyFileError
from host.__main__ import main as host

Program = Callable[[list[str]], int]
posix = pytest.mark.skipif(os.name != "posix", reason="Windows has other permissions")


def written(path: Path, content: str | bytes, mode: int = 0o600) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    path.chmod(mode)
    return path


def test_a_key_is_drawn_once_and_only_its_owner_reads_it(tmp_path: Path) -> None:
    path, other = tmp_path / "orb.key", tmp_path / "other.key"
    key = psk.read_or_make(path)
    assert len(key) == 32
    assert psk.read_or_make(path) == psk.read(path) == key
    assert psk.read_or_make(other) != key
    if os.name == "posix":
        assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_file_that_is_no_key_is_never_overwritten(tmp_path: Path) -> None:
    path = written(tmp_path / "orb.key", "precious")
    with pytest.raises(KeyFileError, match="is no key"):
        psk.read_or_make(path)
    assert path.read_text() == "precious"


@posix
@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o666])
def test_a_key_that_others_can_reach_is_refused(tmp_path: Path, mode: int) -> None:
    path = written(tmp_path / "orb.key", "00" * 32, mode)
    with pytest.raises(KeyFileError, match=f"is open to others .mode {mode:o}.*chmod 600"):
        psk.read(path)


@pytest.mark.parametrize(
    "content", ["", "0" * 31, "00" * 15, "hello " * 10, b"\xff" * 40, "00" * 10_000]
)
def test_what_is_no_key_is_refused_in_one_sentence(tmp_path: Path, content: str | bytes) -> None:
    path = written(tmp_path / "orb.key", content)
    with pytest.raises(KeyFileError, match="is no key: expected are 32 or more hexadecimal") as no:
        psk.read(path)
    assert "\n" not in str(no.value)


def test_a_key_may_have_blanks_and_line_ends(tmp_path: Path) -> None:
    path = written(tmp_path / "orb.key", "00 11 22 33 44 55 66 77\n88 99 aa bb cc dd ee ff\r\n")
    assert psk.read(path) == bytes.fromhex("00112233445566778899aabbccddeeff")


def test_a_missing_key_and_a_folder_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(KeyFileError, match="no such file"):
        psk.read(tmp_path / "none.key")
    with pytest.raises(KeyFileError, match=r"cannot read|is no file"):
        psk.read(tmp_path)
    with pytest.raises(TroubleError, match="cannot write"):
        psk.read_or_make(tmp_path / "none" / "orb.key")


LISTEN = ["--link", "listen://127.0.0.1:0", "--key", "none.key"]
ELSEWHERE = ["--link", "socket://127.0.0.1:1", "--key", "none.key"]
HEADLESS = ["--headless", "--seconds", "1"]


@pytest.mark.parametrize(
    ("program", "words", "sentence"),
    [
        (host, [*ELSEWHERE, *HEADLESS], "cannot read the key none.key"),
        (host, ["--key", "none.key", *HEADLESS], "--key is for an orb elsewhere"),
        (controller, ["--key", "none.key"], "--key is for hosts"),
        (controller, ["--link", "listen://0.0.0.0:0"], "add --key FILE, or write listen://127"),
    ],
)
def test_both_ends_say_what_is_wrong_with_a_key(
    program: Program, words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        status: object = program(words)
    except SystemExit as error:
        status = error.code
    assert status == 2
    assert sentence in capsys.readouterr().err
