"""The virtual orb, held against physics, the paper, and its own symmetries."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.shared.protocol.messages import Contact
from controller.simulator.dome import membrane
from controller.simulator.dome.contact import ContactModel, Fingers, Skin
from controller.simulator.dome.electronics import ElectronicsModel
from controller.simulator.dome.readout import ReadoutModel, read, scan_times
from controller.simulator.hand.performance import DISTRACTORS, GESTURES, ONSET_SHARE, perform
from controller.simulator.hand.user_style import draw_mood, draw_style
from controller.simulator.orb import OrbModel, OrbSimulator
from controller.simulator.session import LABELS, simulate
from controller.simulator.virtual_orb import VirtualOrb
from tests.reference import paper_model

SKIN = Skin(membrane.inflate(), 5, 5, 10.0, ContactModel())


def change(
    points_mm: list[complex], depth_mm: float, drag_mm: list[complex] | None = None
) -> NDArray[np.float64]:
    """C/C0 - 1 of every taxel, (5, 5), for fingers at these points from the centre."""
    z = np.array([points_mm], dtype=np.complex128) / membrane.RADIUS_MM
    drag = np.array([drag_mm or [0j] * len(points_mm)], dtype=np.complex128)
    fingers = Fingers(z, np.full(z.shape, depth_mm), np.full(z.shape, 7.0), drag)
    [grip] = SKIN.grips(fingers)
    log_c = SKIN.log_capacitance(grip, np.zeros(1))
    return np.asarray(np.exp(log_c[0]).reshape(5, 5) - 1.0)


@pytest.mark.parametrize("apex_stretch", [1.1, 1.3, 1.5, 1.7])
def test_the_pressure_carries_the_dome_at_its_rim(apex_stretch: float) -> None:
    # Vertical balance of the whole dome, which the local equations never use:
    # p pi r^2 = 2 pi r T1 sin(phi), with the neo-Hookean tension T1 in units of mu h0.
    solved = membrane.inflate(apex_stretch)
    l1, l2 = solved.meridional[-1], solved.hoop[-1]
    tension = l1 / l2 - (l1 * l2) ** -3
    assert solved.radius[-1] == pytest.approx(1.0, abs=1e-7)
    assert solved.pressure / 2.0 == pytest.approx(tension * np.sin(solved.slope[-1]), rel=1e-4)


def test_the_apex_follows_the_paper_and_the_rim_is_clamped() -> None:
    solved = membrane.inflate(1.5)
    assert solved.area_ratio[0] ** 2 == pytest.approx(1.5**4)  # eq. (1)
    assert solved.hoop[-1] == pytest.approx(1.0, abs=1e-7)


def test_the_clamp_alone_explains_why_measurements_undershoot_equation_3() -> None:
    # Paper, section 3.3 and figure 5b: the observed C/C0 stays below eq. (3).
    solved = membrane.inflate(1.2)
    weights = solved.reference
    ratio = np.trapezoid(solved.area_ratio**2 * weights, weights) / np.trapezoid(weights, weights)
    predicted = paper_model.capacitance_of_deflection(solved.height[:1])[0]
    assert 0.80 < ratio / predicted < 0.90


def test_a_stretch_that_no_pressure_holds_is_refused() -> None:
    with pytest.raises(ValueError, match="between 1 and 4"):
        membrane.inflate(0.9)


def test_deeper_is_stronger() -> None:
    depths = [1.0, 2.0, 4.0, 8.0, 12.0]
    strengths = [float(np.abs(change([0j], depth)).mean()) for depth in depths]
    assert strengths == sorted(strengths)


def test_a_dragged_finger_compresses_the_skin_ahead_and_stretches_it_behind() -> None:
    dipole = change([0j], 3.0, [3.0 + 0j]) - change([0j], 3.0)
    assert dipole[2, 3] < -0.02
    assert dipole[2, 1] > 0.02


def test_two_fingers_on_one_spot_are_solvable() -> None:
    assert np.isfinite(change([5 + 5j, 5 + 5j], 8.0)).all()


def test_an_ideal_read_out_returns_the_capacitance_it_was_given() -> None:
    model = ReadoutModel(bits=24, noise_lsb=0.0, mains=0.0, discharge_slots=50.0)
    true = np.full((2, 5, 5), 41.2)
    frames, _ = read(
        model, true, np.zeros((2, 5)), np.zeros(true.shape), np.array(0.3), np.zeros(true.shape)
    )
    np.testing.assert_allclose(frames, true, rtol=1e-4)


def test_a_frame_is_a_rolling_exposure_column_by_column() -> None:
    model = ReadoutModel()
    times = scan_times(5, 5, model).reshape(5, 5)
    assert times[-1, -1] == 0.0
    assert (np.diff(times, axis=0) > 0).all()
    assert times[0, 1] - times[0, 0] == pytest.approx(5 * model.slot_s)
    assert 0.05 < times[-1, -1] - times[0, 0] < 0.086  # paper, section 5: the cycle is 86 ms


def test_untouched_taxels_spread_like_the_papers() -> None:
    values = np.concatenate(
        [OrbSimulator(np.random.SeedSequence([9, i])).electronics.rest_pf for i in range(40)]
    )
    assert values.mean() == pytest.approx(41.2, abs=0.3)
    assert values.std() == pytest.approx(2.9, abs=0.3)


def paths(frames: int) -> tuple[NDArray[np.complex128], NDArray[np.float64], NDArray[np.float64]]:
    """A finger that comes, slides and leaves, then another."""
    steps = frames * 5
    point = np.zeros((steps, 6), dtype=np.complex128)
    depth = np.zeros((steps, 6))
    point[20:60, 0] = np.linspace(-10, 12, 40)
    depth[20:60, 0] = 8.0
    point[80:110, 1] = 8j
    depth[80:110, 1] = 6.0
    return point, depth, np.full((steps, 6), 7.0)


def test_rubber_remembers_a_press_for_a_while() -> None:
    circuit = ReadoutModel(noise_lsb=0.0, mains=0.0)
    quiet = OrbModel(
        electronics=ElectronicsModel(readout=circuit, pressure=(0.0, 0.05), dead=0, leaky=0)
    )
    point, depth, radius = paths(200)
    depth[80:] = 0.0
    frames = OrbSimulator(np.random.SeedSequence(3), model=quiet).advance(point, depth, radius)
    after, much_later = frames[13].mean(), frames[180].mean()
    assert after < much_later


@pytest.mark.parametrize("label", [*GESTURES, *DISTRACTORS])
@pytest.mark.parametrize("pointer", [False, True])
def test_the_hand_comes_and_goes(label: str, pointer: bool) -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        style = draw_mood(draw_style(rng), rng)
        style = replace(style, pointer=pointer)
        done = perform(label, (2.0, 2.0), style, rng)
        assert done.depth_mm[0].max() == 0.0
        assert done.depth_mm[-1].max() < 0.05
        assert 0.0 < done.onset_s < done.release_s <= len(done.point) / 50.0 + 1e-9
        onset = round(done.onset_s * 50)
        shares = done.depth_mm / np.maximum(done.depth_mm.max(axis=0), 1e-9)
        assert shares[onset].max() > ONSET_SHARE >= shares[onset - 1].max()


def test_twists_turn_the_way_their_names_say() -> None:
    rng = np.random.default_rng(1)
    style = draw_style(rng)
    for label, sign in [("twist_cw", -1), ("twist_ccw", 1)]:
        done = perform(label, (2.0, 2.0), style, rng)
        middle = done.point[:, :3].mean(axis=1, keepdims=True)
        arm = done.point[:, :3] - middle
        turned = np.angle(arm[-1] / arm[0])
        assert np.sign(turned).tolist() == [sign] * 3


def test_a_hosts_finger_dents_the_taxel_under_it_and_leaves_no_trace() -> None:
    orb = VirtualOrb(4)
    rest = np.mean([orb.read((k + 1) / 10) for k in range(10)], axis=0)
    orb.touch([Contact(1, 3.0, 1.0, 9.0, 7.0)], 1.05)
    during = [orb.read((k + 11) / 10) for k in range(6)][-1]
    orb.touch([], 1.65)
    later = np.mean([orb.read((k + 17) / 10) for k in range(60)][-10:], axis=0)
    assert np.unravel_index((during / rest).argmin(), (5, 5)) == (3, 3)  # row 3 is y = 1
    assert np.abs(later / rest - 1.0).mean() < 0.02


def drag(updates_hz: float) -> NDArray[np.float64]:
    """C/C0 - 1 of each frame at 20 Hz while a host drags a finger across in 0.4 s from 1 s on."""
    orb = VirtualOrb(1, 20.0)
    for k in range(round(0.4 * updates_hz) + 1):
        orb.touch([Contact(0, 0.5 + 7.5 * k / updates_hz, 2.0, 9.0, 7.0)], 1.0 + k / updates_hz)
    frames = np.array([orb.read((k + 1) / 20) for k in range(32)], dtype=np.float64)
    return np.asarray(frames / frames[:18].mean(axis=0) - 1.0)


def test_a_drag_looks_alike_from_a_window_with_few_pictures_a_second() -> None:
    smooth, coarse = drag(60.0), drag(10.0)
    late = 2  # frames: the way between two updates is known when the second comes
    apart = np.abs(smooth[23:28] - coarse[23 + late : 28 + late]).max()
    assert apart < 0.1 * np.abs(smooth).max()  # jumps make it 0.8, and 0.25 at the best delay


def test_a_performance_without_a_label_lifts_the_hand_at_once() -> None:
    orb = VirtualOrb(4)
    orb.perform(7, "press", 1.0, 1.0, 0.5)
    frames = [orb.read(k / 10) for k in range(1, 10)]
    orb.perform(8, "", 0.0, 0.0, 0.95)
    later = [orb.read(k / 10) for k in range(10, 41)]
    touched = np.abs(frames[-1] / frames[0] - 1.0).max()
    assert np.abs(np.mean(later[-10:], axis=0) / frames[0] - 1.0).max() < 0.3 * touched
    assert orb.truths() == []
    assert orb.label(1.0) == "null"


def test_its_own_hand_reports_the_truth_when_it_has_left() -> None:
    orb = VirtualOrb(4)
    orb.perform(7, "press", 1.0, 1.0, 0.5)
    seen = []
    for k in range(1, 31):
        orb.read(k / 10)
        seen += [(k / 10, truth) for truth in orb.truths()]
    [(when, truth)] = seen
    assert (truth.number, truth.label) == (7, "press")
    assert 500 < truth.onset_ms < truth.release_ms <= when * 1000
    assert orb.label(truth.onset_ms / 1000 + 0.01) == "press"
    assert orb.label(truth.release_ms / 1000 + 0.01) == "null"


def test_the_same_seed_and_requests_give_the_same_frames() -> None:
    def play() -> NDArray[np.float32]:
        orb = VirtualOrb(11)
        orb.perform(1, "twist_cw", 2.0, 2.0, 0.3)
        return np.stack([orb.read(k / 10) for k in range(1, 20)])

    np.testing.assert_array_equal(play(), play())


def test_a_session_holds_every_gesture_with_its_truth() -> None:
    session = simulate(np.random.SeedSequence([3, 0]).spawn(5), 3.0)
    assert session.frames.shape == (1800, 5, 5)
    assert np.isfinite(session.frames).all()
    assert (session.frames > 0).all()
    assert set(session.label.tolist()) == set(range(len(LABELS)))
    assert len(session.distractors) >= 6  # "nothing" is not silence
    for number, event in enumerate(session.events):
        inside = (session.time_s >= event.onset_s) & (session.time_s < event.release_s)
        np.testing.assert_array_equal(session.event == number, inside)
        assert set(session.label[inside].tolist()) <= {LABELS.index(event.kind)}


def test_sessions_are_reproducible_and_their_seeds_matter() -> None:
    one = simulate(5, 0.5).frames
    np.testing.assert_array_equal(simulate(5, 0.5).frames, one)
    assert (simulate(6, 0.5).frames != one).any()
