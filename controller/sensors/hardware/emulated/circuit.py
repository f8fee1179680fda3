"""The circuit of a wired orb: pins, electrodes, taxels, R_m and the converter's input; pure.

Every electrode is one node: film, lead, pin, and of a row its capacitor, R_m and the converter.
Leads are left out: 1 kOhm and a taxel settle in a thousandth of a slot. What pins do, and faults,
change conductances; touching changes capacitances; time passes only by `advance`.
docs/hardware.md draws it.

Units: pF, MOhm, volts, microseconds; 1 pF x 1 MOhm = 1 us.
"""

from collections.abc import Mapping
from typing import ClassVar, Final

import numpy as np

from controller.sensors.hardware.wiring import CHANNELS, Wiring
from controller.shared.aliases import Array
from controller.simulator.dome.faults import Fault, Kind, read_kinds
from controller.simulator.dome.readout import NOMINAL_PF

KINDS: Final = read_kinds("controller.sensors.hardware.emulated")

# The parts, with their tolerances; each orb draws its own.
_CAPACITOR_PF: Final = (100.0, 0.02)  # from each row to ground, and its relative deviation
# Pin, converter input, lead and film of an electrode to ground, and its deviation.
_STRAY_PF: Final = (30.0, 0.17)
_PIN_MOHM: Final = 50e-6  # a pin that drives
_BLEED_MOHM: Final = (50.0, 0.02)  # R_m: paper, section 3.2; and its relative deviation
_SAMPLE_PF: Final = 20.0  # the converter's sampling capacitor: MCP3208 data sheet, figure 4-1
_SAMPLE_US: Final = 1.5  # its sampling time at 1 MHz: section 1
_FREE_SHARE: Final = 0.8  # of the last sample, that the next one of a free input finds there
_LEAK_NA: Final = 1.0  # deviation of what pin and converter leak into a row
_INJECT_PC: Final = 0.3  # charge that a pin pushes into its row as it lets go
_OFFSET_LSB: Final = 1.0  # deviation of the converter's offset, counts of 4096
_SHORT: Final = 1e4  # 1/MOhm: 100 ohms
_OPEN: Final = 1e-7  # 1/MOhm: what insulates


class WiringFault(Fault):
    """One fault of the wiring: `WiringFault.parse("open_row:2")`, or `"short_taxel:1,3"`."""

    kinds: ClassVar[Mapping[str, Kind]] = KINDS


class Circuit:
    """One orb's circuit, event by event.

    Attributes:
        now_s: The circuit's clock.
    """

    def __init__(self, wiring: Wiring, rng: np.random.Generator) -> None:
        """Solder it; the parts' tolerances are drawn."""
        self.now_s, self.supply_v = 0.0, wiring.supply_v
        rows, columns = self._rows, self._columns = wiring.rows, wiring.columns
        pins = (*wiring.electrodes.columns, *wiring.electrodes.rows)
        self._node = {pin: node for node, pin in enumerate(pins)}
        nodes = len(pins)
        self._stray = _STRAY_PF[0] * (1 + _STRAY_PF[1] * rng.uniform(-1, 1, nodes))
        self._capacitor = _CAPACITOR_PF[0] * (1 + _CAPACITOR_PF[1] * rng.uniform(-1, 1, rows))
        self._bleed = _BLEED_MOHM[0] * (1 + _BLEED_MOHM[1] * rng.uniform(-1, 1, rows))
        self._source = np.append(np.zeros(columns), rng.normal(0.0, _LEAK_NA, rows) * 1e-3)
        offset_v = self.supply_v / 4096 * _OFFSET_LSB
        self._offset_v = rng.normal(0.0, offset_v, 1 + (rows - 1) // CHANNELS)
        self._taxels = np.full((rows, columns), NOMINAL_PF)
        self._fingers = np.zeros(rows)
        self._faults: tuple[WiringFault, ...] = ()
        self._high: dict[int, bool] = {}  # nodes whose pins drive, and whether to the supply
        self._volts = np.zeros(nodes)
        self._held = np.zeros(len(self._offset_v))  # on each converter's sampling capacitor
        self._due_us = 0.0  # time that has passed since the voltages were computed
        self._modes: dict[tuple[frozenset[int], int], Modes] = {}
        self._build()

    # --- what happens to it ---------------------------------------------------------------------

    def skin(self, picofarads: Array, finger_pf: Array) -> None:
        """Set the taxels, pF, (rows, columns), and what fingers add to each row, pF, (rows,)."""
        self._pass()
        self._taxels, self._fingers = picofarads, finger_pf
        self._build()

    def break_(self, faults: tuple[WiringFault, ...]) -> None:
        """Have exactly these faults."""
        self._pass()
        self._faults = faults
        self._build()

    def drive(self, pin: int, high: bool) -> None:
        """Let a pin drive its electrode."""
        node = self._node[pin]
        if self._high.get(node) is not high:
            self._pass()
            self._high[node] = high

    def release(self, pin: int) -> None:
        """Let a pin float."""
        node = self._node[pin]
        if node not in self._high:
            return
        self._pass()  # what is due has passed while it still drove
        del self._high[node]
        if node >= self._columns:
            self._volts[node] += _INJECT_PC / self._capacitance[node, node]

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        self.now_s += seconds
        self._due_us += seconds * 1e6

    # --- what is seen of it ---------------------------------------------------------------------

    def volts(self, pin: int) -> float:
        """Return the voltage of a pin's electrode."""
        self._pass()
        return float(self._volts[self._node[pin]])

    def sample(self, row: int, converter: int = 0) -> float:
        """Return what a converter's input sees of a row, as it takes its sample from it."""
        self._pass()
        node, pf = self._columns + row, _SAMPLE_PF
        full = self._capacitance[node, node] + pf
        self._volts[node] = (self._volts[node] * (full - pf) + self._held[converter] * pf) / full
        self._volts = self._solved(node).after(self._volts, self._current(), _SAMPLE_US)
        self.now_s += _SAMPLE_US * 1e-6
        return self.hold(float(self._volts[node]), converter)

    def hold(self, volts: float | None, converter: int = 0) -> float:
        """Return what a converter samples of an input at a voltage; None: it hangs free."""
        self._held[converter] = self._held[converter] * _FREE_SHARE if volts is None else volts
        return float(self._held[converter] + self._offset_v[converter])

    # --- inside ---------------------------------------------------------------------------------

    def _pass(self) -> None:
        """Compute the voltages of now."""
        if self._due_us > 0.0:
            self._volts = self._solved(-1).after(self._volts, self._current(), self._due_us)
            self._due_us = 0.0

    def _solved(self, sampling: int) -> "Modes":
        """Return the modes of the present state; `sampling`: the node that is sampled, or -1."""
        key = (frozenset(self._high), sampling)
        if key not in self._modes:
            conductance, capacitance = self._conductance.copy(), self._capacitance.copy()
            for node in self._high:
                conductance[node, node] += 1.0 / _PIN_MOHM
            if sampling >= 0:
                capacitance[sampling, sampling] += _SAMPLE_PF
            self._modes[key] = Modes(capacitance, conductance)
        return self._modes[key]

    def _current(self) -> Array:
        """Return the current into each node, (nodes,), V/MOhm."""
        current = self._source.copy()
        for node, high in self._high.items():
            current[node] += self.supply_v / _PIN_MOHM if high else 0.0
        return current

    def _build(self) -> None:
        """Set up the matrices; all that was solved is void."""
        self._modes.clear()
        first, taxels, capacitor = self._columns, self._taxels.copy(), self._capacitor.copy()
        rows, columns = np.arange(self._rows), np.arange(self._columns)
        self._conductance = np.diag(np.append(np.zeros(first), 1.0 / self._bleed))
        for fault in self._faults:
            kind, row, column = fault.kind, fault.row, fault.column
            node = column if row < 0 else first + row
            if kind in ("dead", "open_row", "open_column", "unplugged"):
                where = (slice(None) if at < 0 else at for at in (row, column))
                taxels[tuple(where)] = 0.0
            elif kind == "swapped_rows":
                rows[[row, row + 1]] = row + 1, row
            elif kind == "swapped_columns":
                columns[[column, column + 1]] = column + 1, column
            elif kind in ("short_rows", "short_columns", "short_taxel"):
                other = column if kind == "short_taxel" else node + 1
                self._conductance[[node, other], [node, other]] += _SHORT
                self._conductance[[node, other], [other, node]] -= _SHORT
            elif kind in ("grounded_row", "grounded_column"):
                self._conductance[node, node] += _SHORT
            elif kind == "no_bleed":
                self._conductance[node, node] = _OPEN
            elif kind == "no_row_capacitor":
                capacitor[row] = 0.0
        taxels = taxels[rows][:, columns]
        to_ground = self._stray + np.append(np.zeros(first), capacitor + self._fingers[rows])
        between = np.zeros((len(to_ground), len(to_ground)))
        between[first:, :first], between[:first, first:] = taxels, taxels.T
        self._capacitance = np.diag(to_ground + between.sum(axis=0)) - between


class Modes:
    """A network of capacitors and resistors, solved exactly for any voltages and sources.

    K dv/dt = -G v + b has the solution of its eigenmodes, so a wait costs two small products
    however long it is.
    """

    def __init__(self, capacitance: Array, conductance: Array) -> None:
        """Solve for capacitances, pF, and conductances, 1/MOhm, both (nodes, nodes)."""
        lower = np.linalg.cholesky(capacitance)
        inverse = np.linalg.inv(lower)
        self._rate, modes = np.linalg.eigh(inverse @ conductance @ inverse.T)
        self._rate = np.maximum(self._rate, 1e-12)  # what nothing holds stays for a million seconds
        self._out = inverse.T @ modes  # modes -> volts, and (transposed) currents -> modes
        self._in = modes.T @ lower.T  # volts -> modes

    def after(self, volts: Array, current: Array, wait_us: float) -> Array:
        """Return the voltages after a wait with a current into each node, V/MOhm, (nodes,) each."""
        decay = np.exp(-self._rate * wait_us)
        grown = -np.expm1(-self._rate * wait_us) / self._rate
        volts = self._out @ (decay * (self._in @ volts) + grown * (self._out.T @ current))
        return np.asarray(volts)
