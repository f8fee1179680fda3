"""The skin's arithmetic: fast in bulk, and the same for one step as for a whole session."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from controller.simulator.dome import green_functions
from controller.simulator.dome.lowpass import Lowpass
from controller.simulator.dome.mechanics import Mechanics, MechanicsModel
from controller.simulator.dome.membrane import RADIUS_MM, clamp_radius_mm
from controller.simulator.hand.gesture_file import shipped
from controller.simulator.hand.performance import GESTURES, SLOTS
from controller.simulator.hand.session_script import SessionScript
from controller.simulator.hand.user_style import draw_style
from controller.simulator.orb import OrbSimulator

Paths = tuple[NDArray[np.complex128], NDArray[np.float64], NDArray[np.float64]]


def play(seconds: int, step_hz: float = 50.0) -> Paths:
    """What a hand does for some seconds: points, depths, radii."""
    rng = np.random.default_rng(8)
    steps = round(seconds * step_hz)
    hand = SessionScript(steps, step_hz, (5, 5, 10.0), draw_style(rng), (0.0, 0.0), shipped(), rng)
    hand.stream(GESTURES)
    return hand.point, hand.depth_mm, hand.radius_mm


def mechanics(rows: int = 5, columns: int = 5, pitch_mm: float = 10.0) -> Mechanics:
    return Mechanics(MechanicsModel(), (rows, columns), pitch_mm, 0.02, SLOTS, 0.6)


@given(st.floats(0.0, 0.9999), st.integers(1, 3000), st.integers(0, 3000))
@settings(max_examples=30, deadline=None)
def test_a_low_pass_is_its_recurrence_however_time_is_cut(keep: float, n: int, cut: int) -> None:
    x = np.random.default_rng(n).normal(size=(n, 2))
    level, expected = np.array([3.0, -1.0]), []
    for row in x:
        level = keep * level + row
        expected.append(level)
    lowpass = Lowpass(keep, np.array([3.0, -1.0]))
    y = np.concatenate([lowpass.advance(x[:cut]), lowpass.advance(x[cut:])])
    np.testing.assert_allclose(y, expected, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("frames", [1, 7, 64])
def test_scans_of_a_session_are_the_same_in_whatever_pieces(frames: int) -> None:
    point, depth, radius = play(30)
    whole = OrbSimulator(np.random.SeedSequence(5)).advance(point, depth, radius)
    orb, size = OrbSimulator(np.random.SeedSequence(5)), 5 * frames
    pieces = [
        orb.advance(point[i : i + size], depth[i : i + size], radius[i : i + size])
        for i in range(0, len(point), size)
    ]
    np.testing.assert_array_equal(np.concatenate(pieces), whole)


def test_a_finger_in_any_slot_feels_the_same() -> None:
    point, depth, radius = play(20)
    one, _ = mechanics().advance(point, depth, radius)
    other, _ = mechanics().advance(
        np.roll(point, 2, axis=1), np.roll(depth, 2, axis=1), np.roll(radius, 2, axis=1)
    )
    np.testing.assert_allclose(other, one, atol=2e-6)


def grips(fingers: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places, (2, fingers, 200), and sizes of fingers around the middle of the dome."""
    rng = np.random.default_rng(fingers)
    turn = 2 * np.pi * (rng.random(200) + np.arange(fingers)[:, None] / fingers)
    reach = rng.uniform(0.3, 0.6, (fingers, 200))
    at = np.stack([reach * np.cos(turn), reach * np.sin(turn)])
    return at, np.full((fingers, 200), 0.1)


@pytest.mark.parametrize("fingers", [1, 2, 5, 6])
def test_elimination_solves_what_numpy_solves(fingers: int) -> None:
    at, size = grips(fingers)
    for system in (
        green_functions.press_system(at, size, 0.45),
        green_functions.drag_system(at, size, 0.5),
    ):
        target = np.random.default_rng(0).normal(size=(len(system), 2, 200))
        expected = np.linalg.solve(system.transpose(2, 0, 1), target.transpose(2, 0, 1))
        np.testing.assert_allclose(
            green_functions.solve(system, target), expected.transpose(1, 2, 0), rtol=1e-9, atol=1e-9
        )


def test_a_light_finger_in_the_pit_of_a_firm_one_does_not_pull() -> None:
    at = np.array([[[0.0], [0.12]], [[0.0], [0.0]]])
    system = green_functions.press_system(at, np.full((2, 1), 0.1), 0.45)
    target = np.array([[0.2], [0.001]])
    load = green_functions.push(
        system, target, green_functions.solve(system, target[:, None])[:, 0]
    )
    assert load[1, 0] == 0.0
    assert load[0, 0] == pytest.approx(0.2 / system[0, 0, 0])  # as if it were alone


def test_the_dome_is_the_papers_unless_the_grid_needs_a_larger_one() -> None:
    assert clamp_radius_mm(5, 5, 10.0) == pytest.approx(RADIUS_MM)
    assert clamp_radius_mm(3, 3, 10.0) == RADIUS_MM
    larger = clamp_radius_mm(20, 20, 10.0)
    corner = np.hypot(19.5, 19.5) / 2 * 10.0
    assert corner / larger == pytest.approx(np.hypot(4.5, 4.5) / 2 * 10.0 / RADIUS_MM)


@pytest.mark.parametrize(
    ("rows", "columns", "pitch_mm"), [(5, 5, 10.0), (10, 10, 5.0), (20, 20, 10.0), (7, 12, 4.0)]
)
def test_a_press_dents_its_taxel_on_any_grid(rows: int, columns: int, pitch_mm: float) -> None:
    row, column = 1, columns - 2
    skin = mechanics(rows, columns, pitch_mm)
    point, depth = np.zeros((8, SLOTS), dtype=np.complex128), np.zeros((8, SLOTS))
    point[:, 0] = complex(column - (columns - 1) / 2, (rows - 1) / 2 - row) * pitch_mm
    depth[:, 0] = 6.0
    log_c, _ = skin.advance(point, depth, np.full((8, SLOTS), 7.0))
    assert np.isfinite(log_c).all()
    assert int(log_c[-1].argmin()) == row * columns + column
