"""The doctor on the emulated bench: what is wrong with the wiring is named, and where."""

import json

import pytest

pytest.importorskip("gpiozero", reason="the emulated hardware uses gpiozero's mock pins")

from controller.__main__ import main
from controller.diagnostics import measurements, wiring_checks
from controller.sensors.hardware.emulated.board import EmulatedBoard
from controller.sensors.hardware.emulated.circuit import WiringFault
from tests.benchmarks.doctor import CALLED


def found(*faults: str, seed: int = 3) -> list[tuple[str, str]]:
    """What the measurements of a board say is wrong: (code, where)."""
    bench = EmulatedBoard(seed=seed, faults=[WiringFault.parse(fault) for fault in faults])
    rows = wiring_checks.judge(measurements.measure(bench.board))
    bench.board.close()
    return [(row.code, row.name) for row in rows]


def test_a_sound_board_is_accused_of_nothing() -> None:
    assert found() == found(seed=4) == []


NAMED = """
    open_row:2 row 2; open_column:4 column 4;
    short_rows:3 row 3; short_columns:0 column 0; short_taxel:1,3 taxel (1,3);
    grounded_row:4 row 4; grounded_column:2 column 2; no_channel:3 row 3; dead:0,4 taxel (0,4);
    no_bleed:0 row 0; no_row_capacitor:2 row 2; unplugged membrane; no_converter converter;
    bus_errors=0.2 bus; other_converter converter; low_reference=0.8 converter;
    low_reference=1.5 converter; noise=150 readings
"""


@pytest.mark.parametrize("case", [case.strip() for case in NAMED.split(";")])
def test_what_is_wrong_is_named_first(case: str) -> None:
    fault, _, where = case.partition(" ")
    kind = fault.replace("=", ":").partition(":")[0]
    assert found(fault)[0] == (CALLED.get(kind, kind), where)


def test_inputs_that_are_swapped_are_named_both() -> None:
    assert found("swapped_channels:1") == [
        ("swapped_channels", "row 1"), ("swapped_channels", "row 2"),
    ]  # fmt: skip


def test_two_faults_are_told_apart() -> None:
    assert set(found("open_column:1", "dead:3,4")) == {
        ("open", "column 1"), ("dead", "taxel (3,4)"),
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.usefixtures("quick_doctor")
def test_swapped_leads_are_found_by_presses(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["doctor", "--sensor", "emulated:fault=swapped_columns:2", "--json"]
    assert main(words) == 1
    rows = json.loads(capsys.readouterr().out)["rows"]
    faults = [(row["code"], row["name"]) for row in rows if row["verdict"] == "FAULT"]
    assert faults == [("swapped_columns", "column 2")]
