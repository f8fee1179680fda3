"""The virtual orb's mechanics held against an independent reference (tests/reference), and
against what a physicist knows beforehand. docs/simulator.md draws and explains these figures.
"""

from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray
from reference import disc, material
from reference.dome import Dome, Finger
from reference.meridian import Meridian
from reference.mesh import disc as mesh_disc
from reference.mesh import taxels

from controller.simulator import membrane, paper
from controller.simulator.contact import ContactModel, Fingers, Grip, Skin
from controller.simulator.fields import drag_system, poisson

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

INFLATED = membrane.inflate()
VOLUME = float(-np.trapezoid(np.pi * INFLATED.radius**2, INFLATED.height))  # 1.6 R^3, 88 ml
RESERVOIR = 100 * VOLUME  # what the model's bulge of .45 stands for; a test below says so
RINGS = 16  # of the reference's mesh: 817 nodes, .02 of the peak from 32 rings
DEPTHS_MM = (1.0, 2.0, 3.0, 4.5, 6.0, 9.0, 12.0)
SKIN = Skin(INFLATED, 5, 5, 10.0, ContactModel())


def tolerance(depth_mm: float) -> float:
    """What issue 3 asks for, as a share of the strongest taxel's signal."""
    return float(np.interp(depth_mm, [6.0, 12.0], [0.15, 0.30]))


def grip(skin: Skin, places: list[complex], depth_mm: Array | float, drag_mm: Complex | complex = 0j) -> Grip:
    """Fingers of 7 mm at places on the unit disc."""
    z = np.array([places], dtype=np.complex128)
    depth, drag = (np.broadcast_to(value, z.shape) for value in (depth_mm, drag_mm))
    wide = np.full(z.shape, 7.0)
    fingers = Fingers(z, depth.astype(np.float64), wide, drag.astype(np.complex128))
    return skin.grips(fingers)[0]


def signal(
    places: list[complex],
    depth_mm: Array | float,
    drag_mm: Complex | complex = 0j,
    skin: Skin = SKIN,
) -> Array:
    """The model's ln C / C0, (25,), before the regulator and the rubber's memory act."""
    return skin.log_capacitance(grip(skin, places, depth_mm, drag_mm), np.zeros(1))[0]


@lru_cache
def dome(connected: float = RESERVOIR, rings: int = RINGS) -> Dome:
    return Dome(rings, VOLUME, connected)


@lru_cache
def apex_press(connected: float) -> tuple[Array, Array, Array]:
    """A fingertip on the apex by the meridian's equations: depths, ln C / C0, pressures."""
    return Meridian(60, VOLUME, connected).press(np.arange(0.25, 16.6, 0.25))


def at_apex(depth_mm: float, connected: float = RESERVOIR) -> Array:
    depth, log_c, _ = apex_press(connected)
    assert depth[-1] > depth_mm
    return np.array([np.interp(depth_mm, depth, taxel) for taxel in log_c.T])


# --- the reference itself -------------------------------------------------------------------


def test_the_references_inflated_dome_converges_to_the_models() -> None:
    # Two independent ways: triangles that minimise an energy, and the membrane equations.
    errors = [abs(dome(rings=rings).rest.x[0, 2] - INFLATED.height[0]) for rings in (8, 16)]
    assert errors[1] < 0.003
    assert 3.0 < errors[0] / errors[1] < 5.0  # second order in the size of the triangles
    assert dome().rest.pressure == pytest.approx(INFLATED.pressure, rel=0.005)
    assert dome().area_ratio(dome().rest.x)[:6].mean() == pytest.approx(1.5**2, rel=0.005)


def test_the_references_forces_are_the_derivatives_of_its_energies() -> None:
    solver = dome(rings=8)
    rng = np.random.default_rng(0)
    x = solver.rest.x + 0.01 * rng.normal(size=solver.rest.x.shape)
    way = rng.normal(size=x.shape)
    for energy in (solver._elastic, solver._volume):
        (ahead, pull, _), (behind, push, _) = (energy(x + h * way) for h in (1e-6, -1e-6))
        _, force, tangent = energy(x)
        assert (ahead - behind) / 2e-6 == pytest.approx(force @ way.ravel(), rel=1e-6)
        dofs = (3 * solver.mesh.triangle[:, :, None] + np.arange(3)).reshape(-1, 9)
        bent = np.zeros(x.size)
        np.add.at(bent, dofs, np.einsum("tij,tj->ti", tangent, way.ravel()[dofs]))
        np.testing.assert_allclose((pull - push) / 2e-6, bent, atol=1e-4 * np.abs(bent).max())


@pytest.mark.parametrize("depth_mm", [3.0, 6.0, 12.0])
def test_both_nonlinear_references_agree_on_the_apex(depth_mm: float) -> None:
    meridian, space = at_apex(depth_mm), apex_in_space().at(depth_mm)
    assert np.abs(meridian - space).max() < 0.1 * np.abs(meridian).max()
    away = np.arange(25) != 12  # coarse triangles are worst right under the finger
    assert np.abs(meridian - space)[away].max() < 0.04 * np.abs(meridian).max()


@lru_cache
def apex_in_space() -> object:
    return dome().press([0j], np.arange(0.5, 17.0, 0.5))
