"""The doctor: a table with verdicts, from what was measured."""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.bundles import bundle
from controller.diagnostics import skin_checks, system_checks, touch_checks
from controller.diagnostics.frame_source import Finger
from controller.diagnostics.report import Row, Verdict, faulty, table
from tests.support.presses import pressed

SOUND = np.zeros((5, 5), dtype=np.bool_)


def codes(rows: list[Row]) -> list[str]:
    return [row.code for row in rows if row.verdict is not Verdict.GOOD]


def test_a_table_says_what_was_found_and_below_it_what_to_do() -> None:
    rows = [
        Row("pump", Verdict.GOOD, "2.2 kPa"),
        Row("row 1", Verdict.FAULT, "the lead is off", "Fasten it.", "open_row"),
    ]
    assert table(rows) == (
        "pump   good   2.2 kPa\nrow 1  FAULT  the lead is off\n              -> Fasten it."
    )
    assert faulty(rows)
    assert not faulty(rows[:1])


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals to die of")
def test_a_crash_of_an_engine_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\nkill -ILL $$\n")
    python.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(python))
    row = system_checks.runtime(bundle.default_path())
    assert (row.verdict, row.code) == (Verdict.FAULT, "runtime")
    assert row.found == "the self-test ended with status -4 on this device"


def test_the_engine_that_is_installed_gives_the_golden_answers() -> None:
    row = system_checks.runtime(bundle.default_path())
    assert row.verdict is Verdict.GOOD
    assert "gives orbtouch.orb's golden answers" in row.found


def test_a_disk_without_room_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert system_checks.disk(tmp_path / "not" / "there").verdict is Verdict.GOOD
    usage = type("Usage", (), {"free": 50e6})
    monkeypatch.setattr(shutil, "disk_usage", lambda place: usage)
    assert system_checks.disk(tmp_path).verdict is Verdict.DOUBTFUL
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("scatter", "seconds"), [(0.01, 0.6), (0.06, 0.9), (0.08, 1.6), (0.2, 3.0)]
)
def test_the_noisier_the_orb_the_longer_a_press_is_held(scatter: float, seconds: float) -> None:
    noise = np.random.default_rng(3).standard_normal((600, 5, 5))
    idle = (40.0 * (1.0 + scatter * noise)).astype(np.float32)
    assert skin_checks.hold_s(idle, 10.0) == pytest.approx(seconds, rel=0.1)


def felt(noise: float = 0.01) -> np.ndarray:
    """What is felt of every press that the doctor asks for, by somebody who misses a little."""
    rng = np.random.default_rng(3)
    changes = [
        pressed(5, 5, 10.0, place, off_mm=complex(*rng.normal(0.0, 1.5, 2)))
        for place in touch_checks.places(5, 5)
    ]
    return np.array(changes) + noise * rng.standard_normal((len(changes), 5, 5))


def test_presses_on_both_diagonals_touch_every_line_twice() -> None:
    for rows, columns in ((5, 5), (3, 7), (4, 4), (1, 6)):
        places = touch_checks.places(rows, columns)
        assert {row for row, _ in places} == set(range(rows))
        assert {column for _, column in places} == set(range(columns))


@pytest.mark.parametrize("pair", [(0, 1), (2, 3), (1, 4)])
def test_lines_that_are_swapped_are_named(pair: tuple[int, int]) -> None:
    order = list(range(5))
    order[pair[0]], order[pair[1]] = order[pair[1]], order[pair[0]]
    [row] = touch_checks.judge(felt()[:, order], SOUND)
    assert (row.code, row.name) == ("swapped_rows", f"row {pair[0]}")
    assert f"row {pair[1]}" in row.found
    [row] = touch_checks.judge(felt()[:, :, order], SOUND)
    assert (row.code, row.name) == ("swapped_columns", f"column {pair[0]}")


def test_plugs_the_wrong_way_round_are_told_and_a_sound_skin_is_accused_of_nothing() -> None:
    changes = felt()
    for seen, told in (
        (changes, []),
        (changes[:, ::-1], ["mirrored"]),
        (changes[:, :, ::-1], ["mirrored"]),
        (changes.transpose(0, 2, 1), ["turned"]),
    ):
        assert codes(touch_checks.judge(seen, SOUND)) == told


def test_a_taxel_that_feels_nothing_is_named_unless_leads_are_swapped() -> None:
    changes = felt()
    changes[:, 1, 3] = 0.0
    [row] = touch_checks.judge(changes, SOUND)
    assert (row.code, row.name) == ("stiff", "taxel (1,3)")
    swapped = changes[:, [1, 0, 2, 3, 4]]
    assert [row.name for row in touch_checks.judge(swapped, SOUND)] == ["row 0"]


def test_whoever_does_not_want_to_press_need_not() -> None:
    def gone(words: str) -> str:
        raise EOFError

    answers = (lambda words: "\n", lambda words: "s\n", gone)
    assert [Finger(ask).press((0, 0)) for ask in answers] == [True, False, False]


def doctor(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, dict[str, str]]:
    """Run it; return its status, and the codes of what is broken, by name."""
    status = main(["doctor", "--json", *words])
    told = json.loads(capsys.readouterr().out)
    assert told["healthy"] is (status == 0)
    return status, {row["name"]: row["code"] for row in told["rows"] if row["verdict"] == "FAULT"}


@pytest.mark.usefixtures("quick_doctor")
@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("virtual:preset=nominal", {}),
        ("virtual:preset=paper-snr", {}),
        ("virtual:fault=open_row:1", {"row 1": "open"}),
        ("virtual:fault=short_column:3", {"columns 3 and 4": "short"}),
        ("virtual:fault=dead:2,3", {"taxel (2,3)": "stiff"}),
        ("virtual:fault=air_leak=0.8", {"air": "air_leak"}),
    ],
)
def test_what_is_broken_on_a_virtual_orb_is_named(
    capsys: pytest.CaptureFixture[str], words: str, found: dict[str, str]
) -> None:
    assert doctor(capsys, "--sensor", words) == (bool(found), found)


@pytest.mark.usefixtures("quick_doctor")
def test_wrong_usage_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--sensor", "nose"]) == 2
    assert main(["doctor", "--sensor", "virtual:fault=nose"]) == 2
    assert capsys.readouterr().err.count("\n") == 2
