"""docs/hardware.md says what the default wiring, the faults and the schematic are."""

import re

import pytest

from tests.support import ROOT

pytest.importorskip("gpiozero", reason="gpiozero knows the Raspberry Pi's header")

from gpiozero.pins.mock import MockFactory

from controller.sensors.hardware.emulated.circuit import KINDS, WiringFault
from controller.sensors.hardware.wiring import Wiring

PAGE = (ROOT / "docs" / "hardware.md").read_text(encoding="utf-8")


def table(heading: str) -> list[list[str]]:
    """The rows of the first table after a heading, without its head."""
    lines = PAGE.split(f"\n{heading}\n", 1)[1].splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("|"))
    rows = []
    for line in lines[first + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def numbers(cell: str) -> list[int]:
    return [int(word) for word in re.findall(r"\d+", cell)]


def test_the_wiring_table_is_the_default_wiring() -> None:
    wiring, rows = Wiring(), table("### Wiring")
    by_name = {row[0]: row for row in rows}
    column = next(row for name, row in by_name.items() if name.startswith("column"))
    assert tuple(numbers(column[1])) == wiring.electrodes.columns
    for j, (pin, channel) in enumerate(
        zip(wiring.electrodes.rows, wiring.electrodes.channels, strict=True)
    ):
        row = next(row for name, row in by_name.items() if name.startswith(f"row {j}"))
        assert numbers(row[1]) == [pin]
        assert f"CH{channel}" in row[3]
    assert wiring.pump is not None
    assert numbers(by_name["label button"][1]) == [wiring.button]
    assert numbers(by_name["status LED"][1]) == [wiring.led]
    assert numbers(by_name["pump"][1]) == [wiring.pump.pin]
    assert f"CH{wiring.pump.channel}" in by_name["pressure sensor"][3]
    assert f"CH{wiring.converter.ground}" in by_name["ground"][3]


def test_the_tables_pins_are_where_a_raspberry_pi_has_them() -> None:
    board = MockFactory().board_info
    for name, gpio, header, _ in table("### Wiring"):
        for pin, where in zip(numbers(gpio), numbers(header), strict=False):
            found = [info.number for _, info in board.find_pin(f"GPIO{pin}")]
            assert found == [where], name
        for where in numbers(header) if name in ("ground", "3.3 V") else ():
            kind = board.headers["J8"].pins[where].name
            assert kind == {"ground": "GND", "3.3 V": "3V3"}[name]


def test_every_fault_that_can_be_tried_is_listed() -> None:
    listed = re.findall(r"^\| `([a-z_]+)(?::[RC,]+)?` \|", PAGE, re.MULTILINE)
    assert listed == list(KINDS)
    for text in re.findall(r"--fault ([a-z_:0-9,=.]+)$", PAGE, re.MULTILINE):
        WiringFault.parse(text)


def labels(wiring: Wiring) -> dict[str, str]:
    """Return the text of each element of the schematic by its id."""
    assert wiring.pump is not None
    electrodes = wiring.electrodes
    found = {f"column-{i}": f"{pin}" for i, pin in enumerate(electrodes.columns)}
    for j, (pin, channel) in enumerate(zip(electrodes.rows, electrodes.channels, strict=True)):
        found |= {f"row-{j}": f"{pin}", f"channel-{j}": f"CH{channel}"}
        found[f"bleed-{j}"] = f"{wiring.circuit.bleed_mohm:g} MΩ"
    return found | {
        "converter": wiring.converter.type.upper(),
        "ground": f"CH{wiring.converter.ground}",
        "pressure": f"CH{wiring.pump.channel}",
        "button": f"{wiring.button}",
        "led": f"{wiring.led}",
        "pump": f"{wiring.pump.pin}",
    }


def test_the_schematic_has_the_numbers_of_the_default_wiring() -> None:
    picture = (ROOT / "docs" / "pictures" / "schematic.svg").read_text(encoding="utf-8")
    written = dict(re.findall(r'<text id="([^"]+)"[^>]*>([^<]*)', picture))
    assert {name: written.get(name) for name in labels(Wiring())} == labels(Wiring())
