"""From capacitances to the picofarads that a scan reports: divider, charging, noise, bits.

The matrix is scanned column by column, one slot a taxel, so a frame is a rolling exposure.
Each reading divides the taxel against the input's stray capacitance and the finger's own. The
row's other taxels load the divider, too; the row's sum tells by how much (the driver's
`controller/sensors/hardware/inversion.py`), so the readings are those without them.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from controller.shared.aliases import Array

SCAN_SHARE: Final = 0.75  # of a frame that a scan may take
NOMINAL_PF: Final = 41.2  # mean capacitance of a taxel: paper, section 3.2


@dataclass(frozen=True, slots=True)
class ReadoutModel:
    """The circuit of the paper's section 3.2, as far as a reading depends on it."""

    stray_pf: float = 60.0  # input and wiring capacitance of a row
    finger_pf: float = 2.0  # what a firm finger adds to its row
    slot_s: float = 0.0024  # time per taxel; 25 slots of 2-3 ms fill the paper's 86 ms cycle
    charge_s: float = 0.00206  # nominal charging time constant, 50 Mohm x 41.2 pF
    discharge_slots: float = 6.0  # how many reset time constants fit in the pause before a reading
    bits: int = 12  # converter resolution
    noise_lsb: float = 1.0  # deviation of a reading; white, so a shorter slot averages less
    mains: float = 0.0015  # relative mains hum; a touching body carries it in
    mains_hz: float = 60.0  # its frequency
    ceiling: float = 1.0  # reading at which the converter clips, of full scale

    @property
    def settled(self) -> float:
        """Share of the final charge that a reading reaches within its slot, 0 ... 1."""
        return float(1.0 - np.exp(-self.slot_s / self.charge_s))

    def fitted(self, rows: int, columns: int, rate_hz: float) -> "ReadoutModel":
        """Return the circuit for a grid and a rate: slots as long as planned, if they fit.

        Where they do not, slots and charging time shrink alike (a smaller resistor), so that
        a scan takes `SCAN_SHARE` of a frame, and the noise grows as 1 / sqrt(slot).
        """
        slot_s = min(self.slot_s, SCAN_SHARE / (rate_hz * rows * columns))
        share = slot_s / self.slot_s
        return replace(
            self,
            slot_s=slot_s,
            charge_s=self.charge_s * share,
            noise_lsb=self.noise_lsb / float(np.sqrt(share)),
        )

    @property
    def usual(self) -> float:
        """What an untouched taxel usually reads, of full scale."""
        return NOMINAL_PF / (NOMINAL_PF + self.stray_pf) * self.settled


def scan_times(rows: int, columns: int, model: ReadoutModel) -> Array:
    """When each taxel is read, seconds before the scan's end (negative), (taxels,)."""
    order = np.arange(columns)[None, :] * rows + np.arange(rows)[:, None]
    return np.asarray(((order + 1 - rows * columns) * model.slot_s).ravel(), dtype=np.float64)


def read(
    model: ReadoutModel,
    capacitance: Array,
    fingers: Array,
    hum_phase: Array,
    previous: Array,
    noise: Array,
) -> tuple[Array, Array]:
    """Return frames, pF, by the divider inverted with nominal constants, and the last raw reading.

    Frames, true capacitances at their slots (pF), the mains' phase there (radians) and standard
    normal noise are (scans, rows, columns). The presence of fingers, 0 ... 1, is (scans, rows). The
    reading before all others and the last one are shares of full scale, shape ().
    """
    scans, rows, columns = capacitance.shape
    load = model.stray_pf + model.finger_pf * fingers[:, :, None]
    volts = capacitance / (capacitance + load) * model.settled
    volts *= 1.0 + model.mains * (1.0 + 3.0 * fingers[:, :, None]) * np.sin(hum_phase)
    scanned = volts.transpose(0, 2, 1).ravel()  # in the order of reading
    residue = np.exp(-model.discharge_slots)
    before = np.concatenate([previous.reshape(1), scanned[:-1]])
    last = np.asarray(scanned[-1])
    scanned = scanned + residue * before
    full = 2.0**model.bits
    volts = scanned.reshape(scans, columns, rows).transpose(0, 2, 1)
    counts = np.clip(np.rint(volts * full + model.noise_lsb * noise), 1, full * model.ceiling - 1)
    return picofarads(model, counts / full), last


def picofarads(model: ReadoutModel, reading: Array) -> Array:
    """Return picofarads for readings, of full scale, any shape, by nominal constants."""
    share = np.clip(reading / (model.settled * (1.0 + np.exp(-model.discharge_slots))), 1e-4, 0.95)
    return np.asarray(share * model.stray_pf / (1.0 - share))
