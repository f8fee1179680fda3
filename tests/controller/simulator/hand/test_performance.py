"""The simulated hand: its gestures, its users, and where it is on any grid."""

from dataclasses import replace

import numpy as np
import pytest

from controller.simulator.hand.gesture_file import shipped
from controller.simulator.hand.performance import RIM, SLOTS, perform
from controller.simulator.hand.user_style import LEFT_HANDED, draw_mood, draw_style, person
from controller.simulator.virtual_orb import VirtualOrb

RNG = np.random.default_rng

# What the hand did when the shipped networks were trained, from seed 7: steps, onset and release
# in s, sums of all depths and of all fingers' distances from the middle in mm.
TRAINED = {
    "press": (40, 0.08, 0.78, 258.790, 518.33),
    "pinch": (44, 0.08, 0.84, 692.731, 1991.25),
    "twist_cw": (54, 0.08, 1.06, 577.108, 3274.64),
    "twist_ccw": (54, 0.08, 1.06, 577.108, 3474.68),
    "brush": (31, 0.08, 0.60, 31.430, 497.06),
    "rest": (93, 0.10, 1.82, 210.423, 4739.35),
    "double_tap": (36, 0.06, 0.70, 108.840, 373.34),  # and what it does today with three more
    "swipe": (29, 0.06, 0.56, 100.571, 530.40),
    "squeeze": (72, 0.18, 1.38, 1181.076, 7712.10),
}


@pytest.mark.parametrize("label", TRAINED)
def test_the_hand_is_the_one_that_the_shipped_networks_know(label: str) -> None:
    rng = RNG(7)
    done = perform(label, (1.0, 3.0), draw_mood(draw_style(rng), rng), rng)
    steps, onset_s, release_s, depth, distance = TRAINED[label]
    assert len(done.point) == steps
    assert (done.onset_s, done.release_s) == pytest.approx((onset_s, release_s))
    assert done.depth_mm.sum() == pytest.approx(depth, rel=1e-4)
    # A third finger of a pinch stands half a degree differently.
    assert np.abs(done.point[done.depth_mm > 0]).sum() == pytest.approx(distance, rel=1e-4)


def test_no_finger_touches_beyond_the_rim() -> None:
    for label in shipped():
        for seed in range(20):
            done = perform(label, (4.0, 4.0), draw_style(RNG(seed)), RNG(seed))
            tremor_mm = 0.5
            assert np.abs(done.point[done.depth_mm > 0.0]).max(initial=0.0) < RIM * 38.0 + tremor_mm


def test_places_are_grid_units_of_whatever_grid() -> None:
    style = replace(draw_style(RNG(0)), aim=0.0, tremor=0.0)
    coarse = perform("press", (4.0, 0.0), style, RNG(1))
    fine = perform("press", (18.0, 0.0), style, RNG(1), grid=(19, 19, 20.0 / 9.0))
    np.testing.assert_allclose(fine.point, coarse.point, atol=1e-9)
    assert coarse.point[0, 0] == pytest.approx(20.0 - 20.0j)


def test_the_same_event_can_be_sampled_at_any_rate() -> None:
    slow, fast = (
        perform("twist_cw", (2.0, 2.0), draw_style(RNG(0)), RNG(1), step_hz=hz) for hz in (50, 200)
    )
    assert slow.point.shape[1] == fast.point.shape[1] == SLOTS
    np.testing.assert_allclose(fast.point[::4][: len(slow.point)], slow.point, atol=1e-9)
    assert fast.onset_s == pytest.approx(slow.onset_s, abs=0.02)


def test_left_handers_mirror_where_their_fingers_are() -> None:
    style = replace(draw_style(RNG(0)), pinch_yaw=np.radians(30.0), aim=0.0, tremor=0.0)

    def yaw(left: bool) -> float:
        turned = []
        for seed in range(200):
            done = perform("pinch", (2.0, 2.0), replace(style, left_handed=left), RNG(seed))
            turned.append(np.angle(done.point[0, 0]))
        return float(np.degrees(np.angle(np.exp(1j * np.array(turned)).mean())))

    assert yaw(left=False) == pytest.approx(30.0, abs=3.0)
    assert yaw(left=True) == pytest.approx(150.0, abs=3.0)


def test_ten_users_are_always_the_same_and_two_are_left_handed() -> None:
    users = [person(0, number) for number in range(10)]
    assert users == [person(0, number) for number in range(10)]
    assert [n for n, user in enumerate(users) if user.left_handed] == list(LEFT_HANDED)
    assert len({user.press_depth for user in users}) == 10
    assert person(1, 0) != person(0, 0)


def test_a_mood_changes_how_but_not_who() -> None:
    user = person(0, 3)
    moods = [draw_mood(user, RNG(seed)) for seed in range(200)]
    depths = np.array([mood.press_depth for mood in moods]) / user.press_depth
    assert depths.std() == pytest.approx(0.08, rel=0.2)
    assert {mood.twist_fingers for mood in moods} == {user.twist_fingers}


@pytest.mark.parametrize("label", shipped())
def test_a_virtual_orb_performs_every_gesture_by_its_label(label: str) -> None:
    orb = VirtualOrb(3)
    orb.perform(1, label, 2.0, 2.0, 0.2)
    truths = []
    for k in range(1, 80):
        assert np.isfinite(orb.read(k / 10)).all()
        truths += orb.truths()
    assert [truth.label for truth in truths] == [label]
