"""Draw docs/pictures/schematic.svg from the default wiring.

python -m tests.reference.schematic [--out docs/pictures/schematic.svg]

The pins and channels are those of `controller/sensors/hardware/default.toml`, so the picture
follows it.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from controller.sensors.hardware.wiring import Wiring
from controller.sensors.hardware.wiring_file import shipped

FILE: Final = Path(__file__).resolve().parents[2] / "docs" / "pictures" / "schematic.svg"
_INK, _DIM, _CORAL, _BLUE = "#1f2933", "#7b8794", "#d64550", "#2b6cb0"
_SPI: Final = {"CLK": 11, "DOUT": 9, "DIN": 10, "CS": 8}  # bus 0, device 0, of every Raspberry Pi
_NAMES: Final = {"CLK": "SCLK", "DOUT": "MISO", "DIN": "MOSI", "CS": "CE0"}
_STEP: Final = 80  # from one electrode to the next


class Sheet:
    """Lines and symbols, as SVG."""

    def __init__(self, width: int, height: int) -> None:
        self._size = width, height
        self._parts: list[str] = []

    def line(self, *points: tuple[float, float], colour: str = _INK) -> None:
        """Draw a wire."""
        path = " ".join(f"{x:g},{y:g}" for x, y in points)
        self._parts.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.6"/>'
        )

    def text(
        self, x: float, y: float, words: str, *, anchor: str = "start", size: int = 13,
        colour: str = _INK, bold: bool = False,
    ) -> None:  # fmt: skip
        """Write."""
        weight = ' font-weight="600"' if bold else ""
        words = words.replace("&", "&amp;").replace("<", "&lt;")
        self._parts.append(
            f'<text x="{x:g}" y="{y:g}" font-size="{size}" text-anchor="{anchor}" '
            f'fill="{colour}"{weight}>{words}</text>'
        )

    def dot(self, x: float, y: float) -> None:
        """Join crossing wires."""
        self._parts.append(f'<circle cx="{x:g}" cy="{y:g}" r="3.2" fill="{_INK}"/>')

    def box(self, x: float, y: float, width: float, height: float, fill: str = "none") -> None:
        """Draw a rectangle."""
        self._parts.append(
            f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="3" '
            f'fill="{fill}" stroke="{_INK}" stroke-width="1.6"/>'
        )

    def tag(self, x: float, y: float, words: str, colour: str = _BLUE) -> None:
        """Write a net's name in a flag that is centred on a point."""
        width = 8.2 * len(words) + 10
        self._parts.append(
            f'<rect x="{x - width / 2:g}" y="{y - 11:g}" width="{width:g}" height="22" rx="11" '
            f'fill="#fff" stroke="{colour}" stroke-width="1.4"/>'
        )
        self.text(x, y + 4.5, words, anchor="middle", size=12, colour=colour, bold=True)

    def ground(self, x: float, y: float) -> None:
        """Draw ground under a point."""
        for width, down in ((20, 0), (13, 5), (6, 10)):
            self.line((x - width / 2, y + down), (x + width / 2, y + down))

    def resistor(self, x: float, y: float, length: float, words: str) -> None:
        """Draw a resistor that hangs down from a point."""
        body = 24
        lead = (length - body) / 2
        self.line((x, y), (x, y + lead))
        self.box(x - 5, y + lead, 10, body, "#fff")
        self.line((x, y + lead + body), (x, y + length))
        self.text(x - 9, y + lead + body / 2 + 4, words, anchor="end", size=11)

    def across(self, x: float, y: float, length: float, words: str) -> None:
        """Draw a resistor that goes to the right of a point."""
        body = 28
        lead = (length - body) / 2
        self.line((x, y), (x + lead, y))
        self.box(x + lead, y - 5, body, 10, "#fff")
        self.line((x + lead + body, y), (x + length, y))
        self.text(x + length / 2, y - 10, words, anchor="middle", size=11)

    def capacitor(self, x: float, y: float, length: float, words: str = "") -> None:
        """Draw a capacitor that hangs down from a point."""
        middle = y + length / 2
        self.line((x, y), (x, middle - 3))
        self.line((x - 9, middle - 3), (x + 9, middle - 3))
        self.line((x - 9, middle + 3), (x + 9, middle + 3))
        self.line((x, middle + 3), (x, y + length))
        if words:
            self.text(x + 13, middle + 4, words, size=11)

    def svg(self) -> str:
        """Return the picture."""
        width, height = self._size
        return "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
                f'width="{width}" height="{height}" '
                'font-family="DejaVu Sans, Helvetica, Arial, sans-serif">',
                f'<rect width="{width}" height="{height}" fill="#fff"/>',
                *self._parts,
                "</svg>\n",
            ]
        )


def draw(wiring: Wiring) -> str:
    """Return the schematic of a wiring with one converter."""
    sheet = Sheet(1120, 820)
    sheet.text(30, 34, "OrbTouch: membrane, converter, Raspberry Pi", size=17, bold=True)
    sheet.text(
        30, 56, "Blue flags are GPIO numbers (BCM). All parts run at 3.3 V but the pump.",
        size=12, colour=_DIM,
    )  # fmt: skip
    _matrix(sheet, wiring)
    _converter(sheet, wiring)
    _around(sheet, wiring)
    return sheet.svg()


def _matrix(sheet: Sheet, wiring: Wiring) -> None:
    """Draw taxels, their electrodes, and what hangs on the rows."""
    left, top = 110, 150
    bottom = top + _STEP * (wiring.rows - 1)
    right = left + _STEP * (wiring.columns - 1)
    sheet.box(left - 40, top - 45, right - left + 92, bottom - top + 75)
    sheet.text(left - 40, bottom + 48, "membrane: 5 × 5 taxels of 41.2 pF", size=12, colour=_DIM)
    sheet.text(
        left - 40, bottom + 72, "R_m bleeds a row, and no signal goes through it. In line with the",
        size=11, colour=_DIM,
    )  # fmt: skip
    sheet.text(
        left - 40, bottom + 87, "converter it would need a follower: without one, 74 % of the last",
        size=11, colour=_DIM,
    )  # fmt: skip
    sheet.text(
        left - 40, bottom + 102, "reading stays in the next (ngspice: docs/hardware.md).",
        size=11, colour=_DIM,
    )  # fmt: skip
    for i, pin in enumerate(wiring.electrodes.columns):
        x = left + _STEP * i
        sheet.tag(x, top - 66, f"{pin}")
        sheet.line((x, top - 55), (x, bottom + 20), colour=_CORAL)
        sheet.text(x + 5, top - 31, f"C{i}", size=11, colour=_CORAL)
    for j, (pin, channel) in enumerate(
        zip(wiring.electrodes.rows, wiring.electrodes.channels, strict=True)
    ):
        y = top + _STEP * j
        sheet.line((left - 25, y), (800, y))
        sheet.text(left - 34, y - 5, f"R{j}", size=11, anchor="start")
        for i in range(wiring.columns):
            x = left + _STEP * i
            sheet.line((x, y - 26), (x + 22, y - 26), colour=_CORAL)
            sheet.capacitor(x + 22, y - 26, 26)
            sheet.dot(x + 22, y)
        sheet.dot(555, y)
        sheet.resistor(555, y, 46, f"{wiring.circuit.bleed_mohm:g} MΩ")
        sheet.ground(555, y + 46)
        sheet.dot(610, y)
        sheet.capacitor(610, y, 46, "100 pF")
        sheet.ground(610, y + 46)
        sheet.dot(715, y)
        sheet.line((715, y), (715, y - 18))
        sheet.tag(715, y - 28, f"{pin}")
        sheet.text(794, y - 6, f"CH{channel}", size=11, anchor="end")


def _converter(sheet: Sheet, wiring: Wiring) -> None:
    """Draw the converter."""
    top = 110
    sheet.box(800, top, 130, 452, "#f7f9fb")
    sheet.text(865, top - 22, wiring.converter.type.upper(), anchor="middle", size=15, bold=True)
    sheet.text(865, top - 7, "12 bits, 8 inputs", anchor="middle", size=11, colour=_DIM)
    ground = wiring.converter.ground
    y = 150 + _STEP * (wiring.rows - 1) + 36
    if ground is not None:
        sheet.line((800, y), (760, y), (760, y + 10))
        sheet.ground(760, y + 10)
        sheet.text(794, y - 6, f"CH{ground}", size=11, anchor="end")
    if wiring.pump is not None:
        sheet.line((800, y + 34), (690, y + 34))
        sheet.tag(650, y + 34, "pressure", _CORAL)
        sheet.text(794, y + 28, f"CH{wiring.pump.channel}", size=11, anchor="end")
    right = {"VDD": "3V3", "VREF": "3V3"} | {name: str(pin) for name, pin in _SPI.items()}
    right |= {"AGND": "", "DGND": ""}
    for k, (name, net) in enumerate(right.items()):
        here = top + 40 + 50 * k
        sheet.text(922, here + 4, name, anchor="end", size=11)
        sheet.line((930, here), (996 if net else 985, here))
        if net == "3V3":
            sheet.tag(1012, here, "3V3", _CORAL)
        elif net:
            sheet.tag(1012, here, net)
            sheet.text(1040, here + 4, _NAMES[name], size=11, colour=_DIM)
        else:
            sheet.line((985, here), (985, here + 8))
            sheet.ground(985, here + 8)
    sheet.dot(960, top + 40)
    sheet.line((960, top + 40), (960, top - 10), (1060, top - 10))
    sheet.capacitor(1060, top - 10, 30, "1 µF")
    sheet.ground(1060, top + 20)


def _around(sheet: Sheet, wiring: Wiring) -> None:
    """Draw the button, the LED, the pump and the pressure sensor."""
    top = 640
    sheet.line((30, 585), (1090, 585), colour="#cbd2d9")
    if wiring.button is not None:
        sheet.text(60, top - 25, "label button", size=12, colour=_DIM)
        sheet.tag(75, top, f"{wiring.button}")
        sheet.line((92, top), (130, top), (130, top + 30))
        sheet.line((130, top + 30), (148, top + 62))
        sheet.line((130, top + 66), (130, top + 90))
        sheet.dot(130, top + 30)
        sheet.dot(130, top + 66)
        sheet.ground(130, top + 90)
    if wiring.led is not None:
        sheet.text(215, top - 25, "status LED", size=12, colour=_DIM)
        sheet.tag(230, top, f"{wiring.led}")
        sheet.across(247, top, 70, "1 kΩ")
        _diode(sheet, 317, top, 90)
        sheet.ground(317, top + 90)
    if wiring.pump is not None:
        sheet.text(420, top - 25, "pump, with its own supply", size=12, colour=_DIM)
        sheet.tag(435, top + 80, f"{wiring.pump.pin}")
        sheet.across(452, top + 80, 60, "100 Ω")
        sheet.dot(512, top + 80)
        sheet.resistor(512, top + 80, 50, "10 kΩ")
        sheet.ground(512, top + 130)
        sheet.line((512, top + 80), (560, top + 80))
        sheet.line((560, top + 66), (560, top + 94))
        sheet.line((567, top + 62), (567, top + 98))
        sheet.line((567, top + 92), (600, top + 92), (600, top + 130))
        sheet.ground(600, top + 130)
        sheet.text(612, top + 100, "N-MOSFET,", size=11)
        sheet.text(612, top + 114, "logic level", size=11)
        sheet.line((567, top + 68), (600, top + 68), (600, top + 46))
        sheet.box(575, top + 8, 50, 38, "#f7f9fb")
        sheet.text(600, top + 32, "pump", anchor="middle", size=12)
        sheet.line((600, top + 8), (600, top - 4))
        sheet.tag(600, top - 12, "5 V", _CORAL)
        sheet.dot(600, top + 2)
        sheet.dot(600, top + 56)
        sheet.line((600, top + 2), (660, top + 2), (660, top + 8))
        sheet.line((600, top + 56), (660, top + 56), (660, top + 50))
        _diode(sheet, 660, top + 8, 42, up=True)
        sheet.text(674, top + 34, "1N5819", size=11)
        sheet.text(790, top - 25, "pressure sensor, 0 … 10 kPa", size=12, colour=_DIM)
        sheet.box(830, top, 110, 80, "#f7f9fb")
        sheet.text(885, top + 38, "ratiometric,", anchor="middle", size=11)
        sheet.text(885, top + 54, "3.3 V", anchor="middle", size=11)
        sheet.line((885, top), (885, top - 4))
        sheet.tag(885, top - 10, "3V3", _CORAL)
        sheet.line((885, top + 80), (885, top + 100))
        sheet.ground(885, top + 100)
        sheet.line((940, top + 40), (990, top + 40))
        sheet.tag(1030, top + 40, "pressure", _CORAL)
    sheet.text(
        30, 805,
        "A hose joins pump, pressure sensor, dome and a relief valve that opens at the limit.",
        size=12, colour=_DIM,
    )  # fmt: skip


def _diode(sheet: Sheet, x: float, y: float, length: float, up: bool = False) -> None:
    """Draw a diode that hangs down from a point; current flows down, or up."""
    middle = y + length / 2
    sheet.line((x, y), (x, middle - 9))
    sheet.line((x, middle + 9), (x, y + length))
    base, tip = (middle + 9, middle - 9) if up else (middle - 9, middle + 9)
    sheet.line((x - 9, base), (x + 9, base), (x, tip), (x - 9, base))
    sheet.line((x - 9, tip), (x + 9, tip))


def main(argv: Sequence[str] | None = None) -> int:
    """Draw."""
    grammar = argparse.ArgumentParser(description=__doc__)
    grammar.add_argument("--out", type=Path, default=FILE)
    options = grammar.parse_args(argv)
    options.out.write_text(draw(shipped()), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
