"""Wiring faults between an orb and its computer, to switch on and off at any time.

WiringFault.parse("open_row:2")          # the third row's lead is off
WiringFault.parse("short_taxel:1,3")     # row 1 touches column 3 through the rubber
WiringFault.parse("leaky:0,0=5")         # a taxel that conducts, here with 5 MOhm
"""

from collections.abc import Mapping
from typing import ClassVar, Final

from controller.simulator.dome.faults import Fault, Kind, read_kinds

KINDS: Final = read_kinds("controller.sensors.hardware.emulated")


class WiringFault(Fault):
    """One fault of the wiring."""

    kinds: ClassVar[Mapping[str, Kind]] = KINDS
