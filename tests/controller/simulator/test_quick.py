"""Quick hands and fast frames: taps in fast play, and noise that no frame rate averages away."""

import itertools

import numpy as np
import pytest

from controller.shared.protocol.messages import Contact
from controller.simulator.dome.lowpass import Coloured
from controller.simulator.dome.readout import ReadoutModel
from controller.simulator.hand.gesture_file import shipped
from controller.simulator.hand.performance import DISTRACTORS, GESTURES, perform
from controller.simulator.hand.pointer import click
from controller.simulator.hand.session_script import SessionScript
from controller.simulator.hand.user_style import draw_style
from controller.simulator.session import simulate
from controller.simulator.virtual_orb import VirtualOrb

RATE_HZ = 40.0


@pytest.mark.parametrize(
    ("label", "longest_s"), [("press", 0.4), ("pinch", 0.6), ("twist_cw", 0.8), ("twist_ccw", 0.8)]
)
def test_in_fast_play_a_gesture_takes_a_part_of_its_usual_time(
    label: str, longest_s: float
) -> None:
    for seed in range(20):
        style = draw_style(np.random.default_rng(seed))
        usual, quick = (
            perform(label, (2.0, 2.0), style, np.random.default_rng(seed), quick=fast)
            for fast in (False, True)
        )
        assert quick.release_s < min(longest_s, usual.release_s)


def test_a_click_of_the_simulated_pointer_is_one_of_a_hosts_finger() -> None:
    """The same depth over time as `VirtualOrb` makes of the contacts of a mouse."""
    orb = VirtualOrb(1, rate_hz=100.0)
    depths = []
    for step in range(40):
        down = 10 <= step < 20  # for 0.1 s
        orb.touch([Contact(0, 2.0, 2.0, 9.0, 7.0)] if down else [], step / 100.0)
        orb.read((step + 1) / 100.0)
        depths.append(float(orb._pointer_depth.max()))
    expected = click(0.1, 9.0, 100.0, 1)[:, 0]
    np.testing.assert_allclose(depths[9 : 9 + len(expected)], expected, atol=0.8)


def test_quick_gestures_come_in_rows_and_their_labels_are_apart() -> None:
    played = simulate(3, 4.0, rate_hz=RATE_HZ, quick=0.4)
    starts = [event.onset_s for event in played.events]
    assert min(np.diff(starts)) < 0.35
    assert all(
        first.release_s <= second.onset_s for first, second in itertools.pairwise(played.events)
    )
    runs = np.flatnonzero(np.diff(played.event))
    # Between two gestures there are at least two frames of null, 75 ms less a frame.
    changes = [(played.event[i], played.event[i + 1]) for i in runs]
    assert not any(before >= 0 and after >= 0 for before, after in changes)
    assert {event.kind for event in played.distractors} <= set(DISTRACTORS)
    pressed = np.flatnonzero(played.label == 1)
    assert np.isfinite(played.touch[pressed]).all()


@pytest.mark.parametrize("seed", range(3))
def test_calm_sessions_are_what_they_are_without_quick_gestures(seed: int) -> None:
    """A script that knows no quick gestures draws the same numbers and makes the same paths."""
    style = draw_style(np.random.default_rng(seed))
    calm, other, quick = (
        SessionScript(
            60_000, 1000.0, (5, 5, 10.0), style, (0.0, 0.0), shipped(), np.random.default_rng(seed)
        )
        for _ in range(3)
    )
    calm.stream(GESTURES, 0.0)
    quick.stream(GESTURES, 0.4)
    now: float | None = 3.0  # seconds of quiet before the first event
    while now is not None:
        kinds = GESTURES if other._rng.random() > 0.22 else DISTRACTORS
        if (now := other._do(str(other._rng.choice(kinds)), now, 60_000)) is not None:
            now += other._look()
    assert calm.events == other.events != quick.events
    assert (calm.depth_mm == other.depth_mm).all()
    assert min(np.diff([event.onset_s for event in calm.events])) > 0.5


@pytest.mark.parametrize("rate_hz", [10.0, 40.0, 200.0])
def test_coloured_noise_is_the_same_process_at_every_rate(rate_hz: float) -> None:
    """Its deviation is 1, and its correlation after 0.1 s exp(-2) for a time constant of 50 ms."""
    noise = Coloured(200, 0.05 * rate_hz, np.random.default_rng(1)).advance(round(20 * rate_hz))
    assert noise.std() == pytest.approx(1.0, abs=0.03)
    later = round(0.1 * rate_hz)
    correlation = float((noise[:-later] * noise[later:]).mean())
    assert correlation == pytest.approx(np.exp(-2.0), abs=0.03)


def test_a_shorter_slot_is_noisier_so_that_a_second_tells_as_much() -> None:
    slow, fast = (ReadoutModel().fitted(5, 5, rate_hz) for rate_hz in (10.0, RATE_HZ))
    assert fast.slot_s < slow.slot_s
    assert fast.noise_lsb**2 * fast.slot_s == pytest.approx(slow.noise_lsb**2 * slow.slot_s)
