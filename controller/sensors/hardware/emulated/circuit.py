"""The circuit of a wired orb: pins, leads, films, taxels, R_m and the converter's input; pure.

Every electrode has two nodes: its film on the membrane, and its end on the board, where pin, row
capacitor, R_m and converter are. What pins do, and faults, change conductances; touching changes
capacitances; time passes only by `advance`. docs/hardware.md draws it.

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
_STRAY_PF: Final = (25.0, 0.2)  # pin, converter input and lead of an electrode, and its deviation
_FILM_PF: Final = 5.0  # of an electrode's film to ground
_LEAD_MOHM: Final = (0.001, 0.3)  # film and lead, end to end: paper, section 3.1; and its deviation
_PIN_MOHM: Final = 50e-6  # a pin that drives
_BLEED_MOHM: Final = (50.0, 0.02)  # R_m: paper, section 3.2; and its relative deviation
_SAMPLE_PF: Final = 20.0  # the converter's sampling capacitor: MCP3208 data sheet, figure 4-1
_SAMPLE_US: Final = 1.5  # its sampling time at 1 MHz: section 1
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
        self._ends = columns + rows  # index of the first board end
        pins = (*wiring.electrodes.columns, *wiring.electrodes.rows)
        self._node = {pin: self._ends + i for i, pin in enumerate(pins)}
        nodes = 2 * self._ends
        self._row_node = [self._node[pin] for pin in wiring.electrodes.rows]
        self._stray = _STRAY_PF[0] * (1 + _STRAY_PF[1] * rng.uniform(-1, 1, self._ends))
        self._capacitor = _CAPACITOR_PF[0] * (1 + _CAPACITOR_PF[1] * rng.uniform(-1, 1, rows))
        self._lead = _LEAD_MOHM[0] * np.exp(rng.normal(0.0, _LEAD_MOHM[1], self._ends))
        self._bleed = _BLEED_MOHM[0] * (1 + _BLEED_MOHM[1] * rng.uniform(-1, 1, rows))
        self._leak_ua = rng.normal(0.0, _LEAK_NA, rows) * 1e-3
        offset_v = self.supply_v / 4096 * _OFFSET_LSB
        self._offset_v = rng.normal(0.0, offset_v, 1 + (rows - 1) // CHANNELS)
        self._taxels = np.full((rows, columns), NOMINAL_PF)
        self._fingers = np.zeros(rows)
        self._faults: tuple[WiringFault, ...] = ()
        self._high: dict[int, bool] = {}  # pins that drive, and where to
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
        if self._high.get(pin) is not high:
            self._pass()
            self._high[pin] = high

    def release(self, pin: int) -> None:
        """Let a pin float."""
        if pin not in self._high:
            return
        self._pass()  # what is due has passed while it still drove
        del self._high[pin]
        node = self._node[pin]
        if node in self._row_node:
            self._volts[node] += _INJECT_PC / self._capacitance[node, node]

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        self.now_s += seconds
        self._due_us += seconds * 1e6

    # --- what is seen of it ---------------------------------------------------------------------

    def volts(self, pin: int) -> float:
        """Return the voltage at a pin's end of its electrode."""
        self._pass()
        return float(self._volts[self._node[pin]])

    def sample(self, row: int, converter: int = 0) -> float:
        """Return what a converter's input sees of a row, as it takes its sample from it."""
        self._pass()
        node, pf = self._row_node[row], _SAMPLE_PF
        full = self._capacitance[node, node] + pf
        share = (self._volts[node] * (full - pf) + self._held[converter] * pf) / full
        self._volts[node] = share
        self._volts = self._solved(node).after(self._volts, self._current(), _SAMPLE_US)
        self.now_s += _SAMPLE_US * 1e-6
        self._held[converter] = self._volts[node]
        return float(self._held[converter] + self._offset_v[converter])

    def held(self, converter: int = 0) -> float:
        """Return what a converter samples of an input that hangs free."""
        self._held[converter] *= 0.8
        return float(self._held[converter] + self._offset_v[converter])

    def hold(self, volts: float, converter: int = 0) -> float:
        """Return what a converter samples of an input that something else drives."""
        self._held[converter] = volts
        return float(volts + self._offset_v[converter])

    # --- inside ---------------------------------------------------------------------------------

    def _pass(self) -> None:
        """Compute the voltages of now."""
        if self._due_us > 0.0:
            self._volts = self._solved(-1).after(self._volts, self._current(), self._due_us)
            self._due_us = 0.0

    def _solved(self, sampling: int) -> "Modes":
        """Return the modes of the present state; `sampling`: the node that is sampled, or -1."""
        driven = self._driven()
        key = (frozenset(driven), sampling)
        if key not in self._modes:
            conductance, capacitance = self._conductance.copy(), self._capacitance
            for node in driven:
                conductance[node, node] += 1.0 / _PIN_MOHM
            if sampling >= 0:
                capacitance = capacitance.copy()
                capacitance[sampling, sampling] += _SAMPLE_PF
            self._modes[key] = Modes(capacitance, conductance)
        return self._modes[key]

    def _driven(self) -> dict[int, bool]:
        """Return the nodes whose pins drive, and whether to the supply."""
        return {self._node[pin]: high for pin, high in self._high.items()}

    def _current(self) -> Array:
        """Return the current into each node, (nodes,), V/MOhm."""
        current = self._source.copy()
        for node, high in self._driven().items():
            current[node] += self.supply_v / _PIN_MOHM if high else 0.0
        return current

    def _build(self) -> None:
        """Set up the matrices; all that was solved is void."""
        self._modes.clear()
        ends, columns = self._ends, self._columns
        nodes = 2 * ends
        self._capacitance, self._conductance = np.zeros((nodes, nodes)), np.zeros((nodes, nodes))
        self._source = np.zeros(nodes)
        taxels = self._taxels.copy()
        lead = 1.0 / self._lead
        bleed, capacitor = 1.0 / self._bleed, self._capacitor.copy()
        joins = list(range(ends))
        for fault in self._faults:
            r, c = columns + fault.row, fault.column
            one = r if c < 0 else c
            if fault.kind == "dead":
                taxels[fault.row, c] = 0.0
            elif fault.kind in ("open_row", "open_column"):
                lead[one] = _OPEN
            elif fault.kind == "unplugged":
                lead[:] = _OPEN
            elif fault.kind in ("swapped_rows", "swapped_columns"):
                joins[one], joins[one + 1] = joins[one + 1], joins[one]
            elif fault.kind in ("short_rows", "short_columns"):
                self._join(self._conductance, one, one + 1, _SHORT)
            elif fault.kind == "short_taxel":
                self._join(self._conductance, r, c, _SHORT)
            elif fault.kind in ("grounded_row", "grounded_column"):
                self._conductance[one, one] += _SHORT
            elif fault.kind == "no_bleed":
                bleed[fault.row] = _OPEN
            elif fault.kind == "no_row_capacitor":
                capacitor[fault.row] = 0.0
        for row in range(self._rows):
            for column in range(columns):
                self._join(self._capacitance, columns + row, column, float(taxels[row, column]))
        for i in range(ends):
            self._join(self._conductance, i, ends + joins[i], float(lead[i]))
            self._capacitance[i, i] += _FILM_PF
            self._capacitance[ends + i, ends + i] += self._stray[i]
        for row, node in enumerate(self._row_node):
            self._capacitance[node, node] += capacitor[row]
            self._capacitance[columns + row, columns + row] += self._fingers[row]
            self._conductance[node, node] += bleed[row]
            self._source[node] = self._leak_ua[row]

    @staticmethod
    def _join(matrix: Array, one: int, other: int, value: float) -> None:
        """Put a part of this value between two nodes of a matrix, (nodes, nodes)."""
        matrix[one, one] += value
        matrix[other, other] += value
        matrix[one, other] -= value
        matrix[other, one] -= value


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
