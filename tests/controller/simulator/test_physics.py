"""Physics known beforehand of the orb: symmetries, limits, and the paper's equations."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from controller.shared.aliases import Array
from controller.simulator.dome import membrane
from controller.simulator.dome.contact import ContactModel, Fingers, Skin
from controller.simulator.dome.green_functions import drag_system, poisson
from controller.simulator.dome.mechanics import Mechanics, MechanicsModel
from controller.simulator.hand.performance import SLOTS, Performance, perform
from controller.simulator.hand.user_style import draw_style
from tests.reference import paper_model

FORGETFUL = MechanicsModel(memory=((0.0, 1.0),))


def feel(done: Performance, *, mirrored: bool = False, friction: float = 0.6) -> Array:
    """ln C / C0 of every taxel while a hand performs, (steps, 5, 5), on a dome without memory."""
    mechanics = Mechanics(FORGETFUL, (5, 5), 10.0, 0.02, SLOTS, friction)
    point = -done.point.conjugate() if mirrored else done.point
    radius = np.broadcast_to(done.radius_mm, done.depth_mm.shape)
    log_c, _ = mechanics.advance(point, done.depth_mm, radius)
    return log_c.reshape(-1, 5, 5)


def test_equation_1_is_the_fourth_power_of_the_stretch() -> None:
    assert paper_model.capacitance_of_stretch(np.array([1.0, 1.5])).tolist() == [1.0, 1.5**4]


def test_equation_2_with_its_two_pi_gives_a_hemispheres_area_and_nearly_a_flat_discs() -> None:
    flat, hemisphere = paper_model.orb_area(38.0, np.array([0.0, 38.0]))
    assert hemisphere == pytest.approx(2 * np.pi * 38.0**2)
    assert flat == pytest.approx(np.pi * 38.0**2, rel=0.007)


def test_equation_3_is_the_square_of_equation_2_over_the_flat_area() -> None:
    deflection = np.linspace(0.0, 1.2, 7)
    growth = paper_model.orb_area(1.0, deflection) / np.pi
    np.testing.assert_allclose(paper_model.capacitance_of_deflection(deflection), growth**2)


def test_more_pressure_inflates_more_up_to_the_limit_point() -> None:
    grows = [membrane.inflate(stretch).pressure for stretch in (2.1, 2.196, 2.3)]
    assert grows[0] < grows[1] > grows[2]  # from there on a neo-Hookean dome runs away


def test_rubber_at_rest_is_incompressible_and_far_stretched_a_net_of_springs() -> None:
    assert poisson(1.0) == pytest.approx(0.5)
    assert poisson(3.0 ** (1 / 6)) == pytest.approx(0.0, abs=1e-12)
    assert poisson(4.0) == pytest.approx(-1.0, abs=0.002)


@given(st.integers(0, 10_000), st.integers(1, 6))
@settings(max_examples=60, deadline=None)
def test_fingers_never_feed_on_each_others_drag(seed: int, count: int) -> None:
    # Forces do work: however fingers stand, the system is symmetric and positive definite.
    rng = np.random.default_rng(seed)
    place = 0.85 * np.sqrt(rng.random(count)) * np.exp(2j * np.pi * rng.random(count))
    at, size = np.stack([place.real, place.imag])[..., None], rng.uniform(0.1, 0.18, (count, 1))
    system = drag_system(at, np.full_like(size, size[0, 0]), poisson(1.4))[..., 0]
    np.testing.assert_allclose(system, system.T, atol=1e-12)
    assert np.linalg.eigvalsh(system).min() > 0.05


def test_a_perfect_ring_grip_carries_no_direction() -> None:
    # Pure torsion changes no area at all. The more fingers stand in the ring, the less they tell,
    # although each drags the skin by 3 mm.
    skin = Skin(membrane.inflate(), 5, 5, 10.0, ContactModel())

    def told(count: int) -> float:
        ring = 0.45 * np.exp(2j * np.pi * (np.arange(count) + 0.3) / count)
        images = []
        for turn in (3.0, -3.0):
            drag = 1j * turn * ring / np.abs(ring)
            depth, radius = np.full((2, 1, count), [[[3.0]], [[7.0]]])
            [grip] = skin.grips(Fingers(ring[None], depth, radius, drag[None]))
            images.append(skin.log_capacitance(grip, np.zeros(1))[0])
        return float(np.abs(images[0] - images[1]).max())

    three, twelve, ring = told(3), told(12), told(24)
    assert three > 0.3
    assert twelve < 0.06
    assert ring < 0.002  # what is left is the taxels' own corners


@pytest.mark.parametrize("label", ["twist_cw", "twist_ccw", "pinch", "press"])
def test_the_mirror_image_of_a_performance_is_felt_as_the_mirror_image(label: str) -> None:
    # z_cw(x, y, t) = z_ccw(-x, y, t): through the hand's path, stick-slip, contact and gas.
    for seed in range(5):
        rng = np.random.default_rng(seed)
        done = perform(label, (2.0, 2.0), draw_style(rng), rng)
        seen, mirrored = feel(done), feel(done, mirrored=True)
        np.testing.assert_allclose(mirrored, seen[:, :, ::-1], atol=2e-5)


def windows(friction: float, count: int) -> tuple[Array, NDArray[np.bool_]]:
    """Ten noisy images of each of many twists, (count, 10, 25), and which are clockwise.

    The wrist turns back by half the angle first, so both directions sweep the same arc.
    """
    images, clockwise = [], []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        style = draw_style(np.random.default_rng(seed % 10))
        style = replace(style, pre_rotation=style.twist_angle / 2, left_handed=False)
        label = str(rng.choice(["twist_cw", "twist_ccw"]))
        done = perform(label, (2.0, 2.0), style, rng)
        when = np.linspace(done.onset_s * 50, done.release_s * 50 - 8, 10).astype(int)
        image = feel(done, friction=friction)[when].reshape(10, 25)
        images.append(image + rng.normal(0.0, 0.01, image.shape))
        clockwise.append(label == "twist_cw")
    return np.array(images), np.array(clockwise)


def accuracy(images: Array, clockwise: NDArray[np.bool_], *, shuffled: bool) -> float:
    """Share of unseen twists whose direction a linear least-squares classifier tells."""
    if shuffled:
        rng = np.random.default_rng(1)
        images = np.array([event[rng.permutation(10)] for event in images])
    known = 2 * len(images) // 3
    features = np.concatenate([images.reshape(len(images), -1), np.ones((len(images), 1))], axis=1)
    taught = features[:known]
    gram = taught.T @ taught + 0.01 * np.eye(taught.shape[1])
    weight = np.linalg.solve(gram, taught.T @ (2.0 * clockwise[:known] - 1.0))
    return float(((features[known:] @ weight > 0.0) == clockwise[known:]).mean())


@pytest.mark.slow
def test_with_pure_slip_only_the_time_order_tells_the_directions_apart() -> None:
    # Without friction no finger drags the skin: a twist is its dents wandering along an arc, and
    # backwards in time it is the other twist. 150 unseen ones: chance is .5 +- .04.
    images, clockwise = windows(friction=0.0, count=450)
    assert accuracy(images, clockwise, shuffled=False) > 0.85
    assert accuracy(images, clockwise, shuffled=True) < 0.65


@pytest.mark.slow
def test_with_friction_a_single_moment_tells_the_directions_apart() -> None:
    # Each finger compresses the skin ahead of it and stretches it behind: a static, signed trace.
    images, clockwise = windows(friction=0.6, count=450)
    assert accuracy(images, clockwise, shuffled=True) > 0.85
