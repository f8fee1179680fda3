"""The inflated dome: a clamped neo-Hookean disc, solved for its apex stretch.

Source: the axisymmetric membrane equations of Yang and Feng (1970), in the reference radius. The
paper's own, homogeneous model is `tests/reference/paper_model.py`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import cos, sin
from typing import Final

import numpy as np

from controller.shared.aliases import Array

State = tuple[float, float, float, float]  # l1, r, z, phi

RADIUS_MM: Final = 38.0  # clamped radius of the paper's dome; its 55 mm electrodes fit inside
APEX_STRETCH: Final = 1.5  # apex height 0.8 R at 2.2 kPa, the working inflation
_REACH_MM: Final = 22.5 * 2**0.5  # from its middle to a corner of its grid
_STEPS: Final = 400  # along the radius; the apex height moves by < 1e-6 R from 400 to 800
_STRIDE: Final = 0.004  # of the apex's radius of curvature: how finely the clamp is looked for


@dataclass(frozen=True, slots=True)
class Membrane:
    """The inflated state along a meridian, lengths in units of the clamped radius."""

    reference: Array  # reference radius of each station, 0 ... 1, (stations,)
    radius: Array  # deformed radius, (stations,)
    height: Array  # height above the clamp, (stations,)
    slope: Array  # angle of the meridian below the horizontal, radians, (stations,)
    meridional: Array  # stretch along the meridian, (stations,)
    hoop: Array  # stretch around the axis, (stations,)
    pressure: float  # inflation pressure in units of mu h0 / R

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

    Nothing is shot at: with lengths in units of mu h0 / p, every dome with this apex is a piece
    of one and the same profile, cut off where the hoop stretch has come down to 1, the clamp.

    Raises:
        ValueError: The stretch is not between 1 and 4.
    """
    if not 1.0 < apex_stretch < 4.0:
        raise ValueError(f"an apex stretch of {apex_stretch} is not between 1 and 4")
    clamp = _clamp(apex_stretch)
    stretch, radius, height, slope = np.array(_profile(apex_stretch, clamp)).T
    reference = np.linspace(0.0, 1.0, _STEPS + 1)
    radius, height = radius / clamp, (height - height[-1]) / clamp
    hoop = np.concatenate(([apex_stretch], radius[1:] / reference[1:]))
    return Membrane(reference, radius, height, slope, stretch, hoop, clamp)


def clamp_radius_mm(rows: int, columns: int, pitch_mm: float) -> float:
    """Return the radius of a dome in which a grid has as much room as the paper's, at least its."""
    reach_mm = np.hypot(rows - 0.5, columns - 0.5) / 2 * pitch_mm
    return float(RADIUS_MM * max(1.0, reach_mm / _REACH_MM))


def _clamp(apex_stretch: float) -> float:
    """Return where the profile's hoop stretch is 1: the reference radius, and so the pressure.

    In units of mu h0 / p the clamped radius is R p / (mu h0): the pressure in units of mu h0 / R.
    """
    stride = _STRIDE / _curvature(apex_stretch)
    at, state = stride, _start(apex_stretch, stride)
    while state[1] > at:
        before, state = state, _step(at, stride, state)
        at += stride
    # Between the last two points, by a step that ends where the hoop stretch does.
    at -= stride
    low, high = 0.0, stride
    for _ in range(60):
        middle = (low + high) / 2
        beyond = _step(at, middle, before)[1] < at + middle
        low, high = (low, middle) if beyond else (middle, high)
    return at + low


def _profile(apex_stretch: float, clamp: float) -> list[State]:
    """Integrate from the apex to the clamp; (stations, 4): l1, r, z, phi."""
    step = clamp / _STEPS
    states = [(apex_stretch, 0.0, 0.0, 0.0), _start(apex_stretch, step)]
    for i in range(1, _STEPS):
        states.append(_step(i * step, step, states[-1]))
    return states


def _curvature(apex_stretch: float) -> float:
    """Return how fast the meridian leans along the reference radius at the apex, p l / 2 T."""
    return apex_stretch / (2.0 * (1.0 - apex_stretch**-6))


def _start(apex_stretch: float, at: float) -> State:
    """Return the state just beside the apex, to second order in the reference radius."""
    lean = _curvature(apex_stretch) * at
    soft = 3.0 * apex_stretch**-6
    meridional = (soft - 2.0) / (8.0 * (1.0 + soft)) * lean**2
    hoop = (meridional - 0.5 * lean**2) / 3.0
    stretch, radius = apex_stretch * (1.0 + meridional), apex_stretch * (1.0 + hoop) * at
    return stretch, radius, -0.5 * apex_stretch * lean * at, lean


def _step(at: float, step: float, state: State) -> State:
    """Take one Runge-Kutta step outward from the reference radius `at`."""
    k1 = _slopes(at, state)
    k2 = _slopes(at + step / 2, _along(state, k1, step / 2))
    k3 = _slopes(at + step / 2, _along(state, k2, step / 2))
    k4 = _slopes(at + step, _along(state, k3, step))
    mean = [(a + 2.0 * (b + c) + d) / 6.0 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
    return _along(state, mean, step)


def _along(state: State, slope: Sequence[float], step: float) -> State:
    l1, r, z, phi = state
    return l1 + step * slope[0], r + step * slope[1], z + step * slope[2], phi + step * slope[3]


def _slopes(reference: float, state: State) -> State:
    """Derivatives of (l1, r, z, phi) by the reference radius; tensions in mu h0, pressure 1."""
    l1, r, _, phi = state
    l2 = r / reference
    squash = (l1 * l2) ** -3
    t1, t2 = l1 / l2 - squash, l2 / l1 - squash
    dl2 = (l1 * cos(phi) - l2) / reference
    dt1 = l1 * cos(phi) / r * (t2 - t1)
    t1_l1 = 1.0 / l2 + 3.0 * squash / l1
    t1_l2 = -l1 / l2**2 + 3.0 * squash / l2
    dphi = l1 * (1.0 - t2 * sin(phi) / r) / t1
    return (dt1 - t1_l2 * dl2) / t1_l1, l1 * cos(phi), -l1 * sin(phi), dphi
