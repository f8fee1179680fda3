"""`controller doctor` on a board on a pty, whose description is written."""

import os
import re
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.cli import doctor
from controller.diagnostics.frame_source import FrameReader
from controller.sensors.hardware.description import read
from controller.shared import ports

if sys.platform == "win32":
    pytest.skip("Windows has no ptys", allow_module_level=True)

import pty
import tty


class Toucher:
    """A board with 2×3 taxels that rest at zero; a finger goes over five of them.

    It prints a line whenever the program sleeps, so its 50 Hz take no time.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self.now_s, self._rng = 0.0, np.random.default_rng(2)
        opened = ports.open_port

        def open_port(url: str, baud: int) -> object:
            port = opened(url, baud)
            os.write(self._master, b"t0 t1 t2 t3 t4 t5\n")
            for _ in range(2):
                self._print()
            return port

        monkeypatch.setattr(ports, "open_port", open_port)

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds
        self._print()

    def _print(self) -> None:
        frame = self._rng.normal(0.0, 1.0, 6)
        if self.now_s > 6.5:
            frame[int(self.now_s * 5) % 5] += 400.0
        os.write(self._master, b"\t".join(b"%.1f" % value for value in frame) + b"\n")

    def close(self) -> None:
        os.close(self._master)
        os.close(self._slave)


def test_a_trial_finds_what_a_board_does_and_writes_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    board = Toucher(monkeypatch)
    first, made = tmp_path / "first.toml", tmp_path / "made.toml"
    first.write_text(f'port = "{board.port}"\nrows = 2\ncolumns = 3\nrate_hz = 50\n')
    read_frames = partial(FrameReader, clock=lambda: board.now_s, sleep=board.sleep)
    monkeypatch.setattr(doctor, "FrameReader", read_frames)
    doctor.main(["--sensor", f"lines:wiring={first}", "--out", str(made)])
    board.close()
    printed = capsys.readouterr().out
    for line in (
        "rate +good +50 frames a second",
        "rest +good +.* counts, about zero",
        "noise +good +(0.9|1)[.0-9]* counts",
        "touch +good +the reading rises; scale [0-9]+ counts",
        r"taxels +doubtful +5 of 6 move; still are \(1,2\)",
        "row 0 +good +# # #",
        r"row 1 +good +# # \.",
    ):
        assert re.search(line, printed), line
    found = read(made, "lines")
    assert (found.port, found.rows, found.columns, found.rate_hz) == (board.port, 2, 3, 50.0)
    assert (found.sign, found.unit) == ("rises", "counts")
    assert found.scale == pytest.approx(400 / 6 / 0.08, rel=0.05)


def test_no_file_is_replaced_and_an_orb_needs_no_description(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    there = tmp_path / "there.toml"
    there.write_text("mine")
    assert main(["doctor", "--out", str(there)]) == 2
    assert "is there already" in capsys.readouterr().err
    other = tmp_path / "other.toml"
    assert main(["doctor", "--out", str(other)]) == 2
    printed = capsys.readouterr()
    assert printed.err == "controller: --out is for sensors with a description; virtual has none\n"
    assert (there.read_text(), other.exists()) == ("mine", False)


def test_calibration_of_the_orb_s_skin_is_refused_to_other_sensors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    board = Toucher(monkeypatch)
    mine = tmp_path / "mine.toml"
    mine.write_text(f'port = "{board.port}"\nrows = 2\ncolumns = 3\nrate_hz = 50\n')
    assert main(["calibrate", "--sensor", f"lines:wiring={mine}"]) == 2
    board.close()
    assert "needs no calibration; run: controller doctor" in capsys.readouterr().err
