"""Estimates of the contact in each frame: place, depth, number of fingers, and angle."""

from dataclasses import replace

import numpy as np
import pytest

from controller.bundles import bundle, container
from controller.bundles.container import BundleError
from controller.recognition.contact import TURNS, ContactEstimate, ContactTracker
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Pipeline
from controller.shared import npz
from controller.shared.aliases import Array, Complex
from controller.simulator.orb import OrbSimulator
from tests.support.loop_bench import Certain

USUAL = bundle.read(bundle.default_path())
REST_S, DOWN_S, UP_S = 3.0, 1.0, 1.0


def felt(point: Complex, depth_mm: Array) -> list[ContactEstimate | None]:
    """What the shipped bundle says of fingers: places, mm, and depths, (n,) or (steps, n)."""
    orb = OrbSimulator(np.random.SeedSequence(8), USUAL.rate_hz, len(depth_mm.T))
    each = orb.steps_per_frame
    rest, down, up = (round(s * USUAL.rate_hz) * each for s in (REST_S, DOWN_S, UP_S))
    steps = rest + down + up
    there = np.zeros((steps, len(depth_mm.T)))
    there[rest : rest + down] = depth_mm
    places = np.broadcast_to(point, there.shape).astype(np.complex128)
    if len(point) == down:
        places = np.concatenate(
            [np.repeat(point[:1], rest, 0), point, np.repeat(point[-1:], up, 0)]
        )
    frames = orb.advance(places.astype(np.complex128), there, np.full(there.shape, 7.0))
    pipeline = Pipeline(USUAL.settings, Certain("null"), Mapping())
    return [pipeline.step(frame, n / USUAL.rate_hz).contact for n, frame in enumerate(frames, 1)]


def test_a_finger_is_placed_and_measured_and_what_is_untouched_is_not() -> None:
    found = felt(np.array([10.0 - 10.0j]), np.array([7.0]))
    down = round((REST_S + 0.7) * USUAL.rate_hz)
    one = found[down]
    assert one is not None
    assert (one.x, one.y) == pytest.approx((3.0, 1.0), abs=0.3)
    assert one.depth_mm == pytest.approx(7.0, abs=2.0)
    assert 0.0 < one.place_sigma < 0.3
    assert (one.fingers, one.angle_deg) == (1, 0.0)
    assert found[round(REST_S * USUAL.rate_hz) - 2] is None
    assert found[-1] is None


def test_pressing_deeper_is_seen() -> None:
    steps = (
        round(DOWN_S * USUAL.rate_hz)
        * OrbSimulator(np.random.SeedSequence(0), 40.0).steps_per_frame
    )
    deeper = np.where(np.arange(steps) < steps // 2, 4.0, 8.0)[:, None]
    found = felt(np.array([0j]), deeper)
    early, late = (found[round((REST_S + at_s) * USUAL.rate_hz)] for at_s in (0.4, 0.9))
    assert early is not None
    assert late is not None
    assert late.depth_mm > early.depth_mm + 2.0


def test_two_fingers_are_no_single_one() -> None:
    one = felt(np.array([-15.0, 15.0]), np.array([7.0, 7.0]))[round((REST_S + 0.6) * USUAL.rate_hz)]
    assert one is not None
    assert one.fingers > 1  # two or three: rarely sure on taxels 10 mm apart
    assert one.fingers_sure > 0.5


def test_inputs_show_a_turn_while_it_lasts_and_shortly_after() -> None:
    row, column = np.indices((5, 5)) - 2.0
    tracker, turned = ContactTracker(5, 5, 40.0), []
    for angle in [0.0] * 10 + [0.5] * 40:
        along = column * np.cos(angle) + row * np.sin(angle)
        across = row * np.cos(angle) - column * np.sin(angle)
        image = 1.0 - 0.3 * np.exp(-(along**2 / 6.0 + across**2 / 2.0))
        inputs = tracker.inputs(image.astype(np.float32), 0.003)
        turned.append(float(np.abs(inputs[-TURNS:]).max()))
    assert max(turned[:10]) < 0.01  # it lies still
    assert min(turned[10:16]) > 0.1  # it has turned
    assert turned[-1] < 0.02  # and lies still


def test_a_tracker_continues_exactly_where_its_state_was_taken() -> None:
    assert USUAL.contacts is not None
    rng = np.random.default_rng(1)
    images = [(1.0 - 0.1 * rng.random((5, 5))).astype(np.float32) for _ in range(12)]
    whole, other = (ContactTracker(5, 5, 40.0, USUAL.contacts.units) for _ in range(2))
    for image in images[:6]:
        whole.step(image, 0.003, USUAL.contacts)
    other.restore(whole.state())
    for image in images[6:]:
        one, same = (each.step(image, 0.003, USUAL.contacts) for each in (whole, other))
        assert one is not None
        assert one == same


def test_a_bundle_without_the_network_says_nothing_and_one_with_another_s_answers_is_refused() -> (
    None
):
    alone = replace(USUAL, contacts=None)
    pipeline = Pipeline(alone.settings, Certain("null"), Mapping())
    assert pipeline.step(np.full((5, 5), 40.0, dtype=np.float32), 0.0).contact is None
    parts = container.unpack(bundle.default_path().read_bytes())
    arrays = npz.unpack(parts[container.STATE], container.MAX_BYTES)
    arrays["golden_outputs"] = arrays["golden_outputs"] + 1.0
    own = {**container.content(parts), container.STATE: npz.pack(arrays)}
    with pytest.raises(BundleError, match="does not give its golden outputs"):
        bundle.assembled(parts[container.MANIFEST], own)
