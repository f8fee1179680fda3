"""A network of capacitors, resistors and sources, solved exactly; pure.

K dv/dt = -G v + b has the solution of its eigenmodes, so a wait costs two small products however
long it is. Units: pF, MOhm, volts, microseconds; 1 pF x 1 MOhm = 1 us.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Modes:
    """The eigenmodes of one network, for any voltages and sources."""

    def __init__(self, capacitance: Array, conductance: Array) -> None:
        """Solve.

        Args:
            capacitance: (nodes, nodes), pF, symmetric, positive definite.
            conductance: (nodes, nodes), 1/MOhm, symmetric.
        """
        lower = np.linalg.cholesky(capacitance)
        inverse = np.linalg.inv(lower)
        self._rate, modes = np.linalg.eigh(inverse @ conductance @ inverse.T)
        self._rate = np.maximum(self._rate, 1e-12)  # what nothing holds stays for a million seconds
        self._out = inverse.T @ modes  # modes -> volts, and (transposed) currents -> modes
        self._in = modes.T @ lower.T  # volts -> modes

    def after(self, volts: Array, current: Array, wait_us: float) -> Array:
        """Return the voltages after a wait, (nodes,).

        Args:
            volts: Before, (nodes,).
            current: Into each node, V/MOhm, (nodes,).
            wait_us: How long.
        """
        decay = np.exp(-self._rate * wait_us)
        grown = -np.expm1(-self._rate * wait_us) / self._rate
        volts = self._out @ (decay * (self._in @ volts) + grown * (self._out.T @ current))
        return np.asarray(volts)
