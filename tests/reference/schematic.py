"""Write the numbers of the default wiring into docs/pictures/schematic.svg.

python -m tests.reference.schematic [--out docs/pictures/schematic.svg]

The drawing is edited as SVG. Pins and channels are those of
`controller/sensors/hardware/default.toml`; they stand in the text elements that have an id.
"""

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from controller.sensors.hardware.wiring import Wiring

FILE: Final = Path(__file__).resolve().parents[2] / "docs" / "pictures" / "schematic.svg"


def texts(wiring: Wiring) -> dict[str, str]:
    """Return the text of each element by its id; the drawing has one converter and a pump."""
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


def draw(wiring: Wiring) -> str:
    """Return the schematic with the numbers of a wiring."""
    picture = FILE.read_text(encoding="utf-8")
    for name, text in texts(wiring).items():
        picture, count = re.subn(rf'(<text id="{name}"[^>]*>)[^<]*', rf"\g<1>{text}", picture)
        assert count == 1, f"{FILE.name} has {count} texts with the id {name}"
    return picture


def main(argv: Sequence[str] | None = None) -> int:
    grammar = argparse.ArgumentParser(description=__doc__)
    grammar.add_argument("--out", type=Path, default=FILE)
    options = grammar.parse_args(argv)
    options.out.write_text(draw(Wiring()), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
