"""Frozen touches of the independent solver, tests/reference/touches.npz, and their benchmark."""

import hashlib
from collections import Counter

import numpy as np

from controller.bundles import bundle as bundles
from tests.benchmarks import reference
from tests.reference import touches
from tests.reference.touches import COUNTS, FILE, LAWS

SHA_256 = "c0dc4447eb2fb99275b5956bdcb8cb973078d61a5d7980ebbc8913b18b443777"


def test_the_frozen_touches_never_change() -> None:
    # The bundles' figures on another physics rest on them, and no training may fit them.
    assert hashlib.sha256(FILE.read_bytes()).hexdigest() == SHA_256


def test_there_are_as_many_of_each_gesture_under_both_friction_laws() -> None:
    frozen = touches.read()
    kinds = Counter((one.event.label, one.event.law) for one in frozen)
    assert len(frozen) >= 300
    assert kinds == {(label, law): COUNTS[label] // 2 for label in COUNTS for law in LAWS}
    for one in frozen:
        assert len(one.log_c) >= one.event.end_s * touches.RATE_HZ
        assert not one.log_c[0].any()  # it begins at rest
        assert not one.log_c[-1].any()  # and ends there
        assert one.log_c.min() < -0.05  # the fingers squeeze what is under them


def test_solving_a_touch_again_gives_the_stored_one() -> None:
    frozen, number = touches.read(), 0
    again = touches.solve(number, touches.reference_dome())
    assert again.redrawn == frozen[number].redrawn
    np.testing.assert_allclose(again.event.keys, frozen[number].event.keys, atol=1e-4)
    np.testing.assert_allclose(again.log_c, frozen[number].log_c, atol=2e-3)


def test_the_benchmark_counts_answers_and_places_of_touches_that_are_not_in_the_set() -> None:
    loaded = bundles.read(bundles.default_path())
    solver = touches.reference_dome()
    press, pinch = (touches.solve(number, solver, seed=1) for number in (0, 120))
    for physics in reference.PHYSICS:
        done = reference.measure(loaded, [press, pinch], physics, "nominal", (1,))
        (_, pressed), (_, pinched) = done
        assert (pressed.right, pressed.wrong, pressed.twice, pressed.false) == (1, 0, 0, 0)
        assert 0.05 < pressed.latencies_s[0] < 0.5
        assert pressed.errors[0] < 0.5
        assert (pinched.events, pinched.errors) == (1, [])
