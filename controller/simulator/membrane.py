"""The inflated dome: a clamped neo-Hookean disc, solved once for its apex stretch.

Source: the axisymmetric membrane equations of Yang and Feng (1970), in the reference
radius; the paper's own, homogeneous model is `paper_capacitance_ratio`, eq. (3).
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RADIUS_MM: Final = 38.0  # clamped radius of the paper's dome; its 55 mm electrodes fit inside
_REACH_MM: Final = 22.5 * 2**0.5  # from its middle to a corner of its grid
APEX_STRETCH: Final = 1.5  # apex height 0.8 R, the working inflation
_STEPS: Final = 400  # along the radius; the apex height moves by < 1e-6 R from 400 to 800
_CANDIDATES: Final = 129  # pressures tried side by side in each round of the shooting


@dataclass(frozen=True, slots=True)
class Membrane:
    """The inflated state along a meridian, lengths in units of the clamped radius.

    Attributes:
        reference: Reference radius of each station, 0 ... 1, (stations,).
        radius: Deformed radius, (stations,).
        height: Height above the clamp, (stations,).
        slope: Angle of the meridian below the horizontal, radians, (stations,).
        meridional: Stretch along the meridian, (stations,).
        hoop: Stretch around the axis, (stations,).
        pressure: Inflation pressure in units of mu h0 / R.
    """

    reference: Array
    radius: Array
    height: Array
    slope: Array
    meridional: Array
    hoop: Array
    pressure: float

    @property
    def area_ratio(self) -> Array:
        """Local ratio of inflated to flat area, (stations,)."""
        return self.meridional * self.hoop

    def at(self, reference: Array, values: Array) -> Array:
        """Interpolate a profile at other reference radii (any shape, 0 ... 1)."""
        return np.interp(reference, self.reference, values)


@lru_cache(maxsize=8)
def inflate(apex_stretch: float = APEX_STRETCH) -> Membrane:
    """Solve the inflated state whose apex is stretched by `apex_stretch`, above 1.

    Shooting on the pressure so that the rim stays at the clamp, r(R) = R.

    Raises:
        ValueError: The stretch is not above 1, or no pressure holds the rim.
    """
    if not 1.0 < apex_stretch < 4.0:
        raise ValueError(f"an apex stretch of {apex_stretch} is not between 1 and 4")
    low, high = 0.0, 8.0
    for _ in range(5):
        pressures = np.linspace(low, high, _CANDIDATES)
        rims = _profiles(apex_stretch, pressures)[-1, 1]
        inside = np.flatnonzero(~(rims >= 1.0))  # NaN: burst, so the pressure is too high
        if not len(inside) or inside[0] == 0:
            raise ValueError(f"no pressure holds an apex stretch of {apex_stretch}")
        low, high = pressures[inside[0] - 1], pressures[inside[0]]
    profile = _profiles(apex_stretch, np.array([low]))[:, :, 0]
    stretch, radius, height, slope = profile.T
    reference = np.linspace(0.0, 1.0, _STEPS + 1)
    hoop = np.concatenate(([apex_stretch], radius[1:] / reference[1:]))
    return Membrane(reference, radius, height - height[-1], slope, stretch, hoop, float(low))


def clamp_radius_mm(rows: int, columns: int, pitch_mm: float) -> float:
    """Return the radius of a dome in which a grid has as much room as the paper's, at least its.

    Args:
        rows: Of taxels, each half a pitch wide.
        columns: The same.
        pitch_mm: Distance of two taxels.
    """
    reach_mm = np.hypot(rows - 0.5, columns - 0.5) / 2 * pitch_mm
    return float(RADIUS_MM * max(1.0, reach_mm / _REACH_MM))


def paper_capacitance_ratio(deflection_over_radius: Array) -> Array:
    """Return C / C0 by the paper's homogeneous hemispheroid, eq. (3).

    Args:
        deflection_over_radius: Apex deflection over the clamped radius, any shape.
    """
    result = 4.0 * (1.0 / 3.0 + 2.0 / 3.0 * deflection_over_radius**1.6) ** 1.25
    return np.asarray(result, dtype=np.float64)


def _profiles(apex_stretch: float, pressures: Array) -> Array:
    """Integrate outward for several pressures; (stations, 4, pressures): l1, r, z, phi."""
    count = len(pressures)
    grid = np.linspace(0.0, 1.0, _STEPS + 1)
    out = np.empty((_STEPS + 1, 4, count))
    out[0] = np.array([apex_stretch, 0.0, 0.0, 0.0])[:, None]
    tension = 1.0 - apex_stretch**-6
    first = grid[1]
    # At the apex both stretches are equal and the meridian is a circle of curvature p / 2T.
    curvature = apex_stretch * pressures / (2.0 * tension)
    state = np.stack(
        [
            np.full(count, apex_stretch),
            np.full(count, apex_stretch * first),
            -0.5 * apex_stretch * curvature * first**2,
            curvature * first,
        ]
    )
    out[1] = state
    step = grid[1]
    with np.errstate(all="ignore"):  # a burst candidate becomes NaN, which `inflate` expects
        for i in range(1, _STEPS):
            k1 = _slopes(grid[i], state, pressures)
            k2 = _slopes(grid[i] + step / 2, state + step / 2 * k1, pressures)
            k3 = _slopes(grid[i] + step / 2, state + step / 2 * k2, pressures)
            k4 = _slopes(grid[i + 1], state + step * k3, pressures)
            state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            out[i + 1] = state
    return out


def _slopes(reference: float, state: Array, pressure: Array) -> Array:
    """Derivatives of (l1, r, z, phi) by the reference radius, lengths in R, tensions in mu h0."""
    l1, r, _, phi = state
    l2 = r / reference
    t1 = l1 / l2 - (l1 * l2) ** -3
    t2 = l2 / l1 - (l1 * l2) ** -3
    cos, sin = np.cos(phi), np.sin(phi)
    dl2 = (l1 * cos - l2) / reference
    dt1 = l1 * cos / r * (t2 - t1)
    t1_l1 = 1.0 / l2 + 3.0 * l1**-4 * l2**-3
    t1_l2 = -l1 / l2**2 + 3.0 * l1**-3 * l2**-4
    dl1 = (dt1 - t1_l2 * dl2) / t1_l1
    dphi = l1 * (pressure - t2 * sin / r) / t1
    return np.stack([dl1, l1 * cos, -l1 * sin, dphi])
