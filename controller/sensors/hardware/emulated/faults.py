"""Wiring faults between an orb and its computer, to switch on and off at any time.

WiringFault.parse("open_row:2")          # the third row's lead is off
WiringFault.parse("short_taxel:1,3")     # row 1 touches column 3 through the rubber
WiringFault.parse("leaky:0,0=5")         # a taxel that conducts, here with 5 MOhm
"""

from collections.abc import Mapping
from typing import ClassVar, Final

from controller.simulator.faults import Fault, Kind

KINDS: Final[dict[str, Kind]] = {
    "open_row": Kind("row", 1.0, "a row's lead is off"),
    "open_column": Kind("column", 1.0, "a column's lead is off"),
    "weak_row": Kind("row", 30.0, "a row's film is worn; size: its resistance, megohms"),
    "weak_column": Kind("column", 30.0, "a column's film is worn; size: its resistance, megohms"),
    "short_rows": Kind("rows", 1.0, "a row touches the next one"),
    "short_columns": Kind("columns", 1.0, "a column touches the next one"),
    "short_taxel": Kind("taxel", 1.0, "a row touches a column, through a hole in the dielectric"),
    "grounded_row": Kind("row", 1.0, "a row touches ground"),
    "grounded_column": Kind("column", 1.0, "a column touches ground"),
    "high_row": Kind("row", 1.0, "a row touches the supply"),
    "high_column": Kind("column", 1.0, "a column touches the supply"),
    "swapped_rows": Kind("rows", 1.0, "two rows' leads are swapped"),
    "swapped_columns": Kind("columns", 1.0, "two columns' leads are swapped"),
    "swapped_channels": Kind("rows", 1.0, "two rows' converter inputs are swapped"),
    "no_channel": Kind("row", 1.0, "a converter input hangs free"),
    "stuck_row": Kind("row", 1.0, "a row's pin is broken: it never lets go of ground"),
    "dead_row_pin": Kind("row", 1.0, "a row's pin is broken: it never grounds the row"),
    "dead": Kind("taxel", 1.0, "a taxel has no capacitance: its film is cracked"),
    "stiff": Kind("taxel", 1.0, "a taxel does not react"),
    "leaky": Kind("taxel", 20.0, "a taxel conducts; size: its resistance, megohms"),
    "noisy": Kind("row", 40.0, "a row's contact crackles; size: noise, counts of 4096"),
    "no_bleed": Kind("row", 1.0, "a row's 50 MOhm resistor is missing"),
    "small_bleed": Kind("row", 0.5, "a row's 50 MOhm resistor is too small; size: megohms"),
    "pull_up": Kind("row", 0.05, "a row's pull-up is left on; size: megohms"),
    "damp": Kind("row", 20.0, "moisture leaks from the supply to a row; size: nanoamperes"),
    "no_row_capacitor": Kind("row", 1.0, "a row's capacitor to ground is missing"),
    "long_lead": Kind("row", 300.0, "a row's lead is long; size: picofarads to ground"),
    "unplugged": Kind("", 1.0, "the membrane's plug is out: all leads are off"),
    "no_converter": Kind("", 1.0, "no converter: the bus reads ones"),
    "silent_converter": Kind("", 1.0, "no converter: the bus reads zeros"),
    "bus_errors": Kind("", 1.0, "the bus fails; size: share of transfers"),
    "other_converter": Kind("", 1.0, "the other type is fitted: MCP3008 for 3208, and reversed"),
    "low_reference": Kind("", 0.8, "the converter's reference is low; size: of the supply"),
    "noise": Kind("", 20.0, "all readings are noisy; size: counts of 4096"),
    "mains": Kind("", 0.03, "hum on all readings; size: of the reading"),
    "slow_clock": Kind("", 3.0, "the board is busy; size: factor on all pin and bus times"),
    "button_stuck": Kind("", 1.0, "the label button never comes up"),
    "pump_dead": Kind("", 1.0, "the pump does not run"),
    "pump_stuck": Kind("", 1.0, "the pump does not stop"),
    "air_leak": Kind("", 0.5, "the orb loses air; size: of its pressure, per minute"),
    "no_pressure_sensor": Kind("", 1.0, "the pressure sensor's output hangs at ground"),
}


class WiringFault(Fault):
    """One fault of the wiring."""

    kinds: ClassVar[Mapping[str, Kind]] = KINDS
