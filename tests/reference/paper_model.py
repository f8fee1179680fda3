"""The paper's own model of the inflated orb, equations (1) to (3) of section 3.3.

It takes the stretch to be the same everywhere and the orb for a hemispheroid;
`controller/simulator/dome/membrane.py` solves a clamped rubber disc; docs/simulator.md draws both.
"""

import numpy as np

from controller.shared.aliases import Array


def capacitance_of_stretch(stretch: Array) -> Array:
    """Return C / C0 = l^4 of a capacitor stretched by l both ways, eq. (1)."""
    return np.asarray(stretch**4, dtype=np.float64)


def orb_area(radius: float, deflection: Array) -> Array:
    """Return the orb's surface, eq. (2): half of Thomsen's spheroid, with eq. (3)'s factor 2 pi."""
    mean = (radius ** (16 / 5) + 2.0 * (radius * deflection) ** (8 / 5)) / 3.0
    return np.asarray(2.0 * np.pi * mean ** (5 / 8), dtype=np.float64)


def capacitance_of_deflection(deflection_over_radius: Array) -> Array:
    """Return C / C0, eq. (3): eq. (2)'s growth squared; 1.013, not 1, for a flat orb."""
    result = 4.0 * (1 / 3 + 2 / 3 * deflection_over_radius ** (8 / 5)) ** (5 / 4)
    return np.asarray(result, dtype=np.float64)
