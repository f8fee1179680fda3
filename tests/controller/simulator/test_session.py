"""Simulated sessions: free play and class blocks, on any grid, the truth beside every frame."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.shared.event_metric import Event
from controller.simulator.hand import session_script
from controller.simulator.hand.performance import GESTURES
from controller.simulator.hand.user_style import person
from controller.simulator.orb import NOMINAL
from controller.simulator.session import DATA, LABELS, Protocol, Session, simulate


def played(protocol: Protocol, minutes: float) -> Session:
    """A session of one of the ten users."""
    seed = np.random.SeedSequence([DATA, 0], spawn_key=(0, 0))
    return simulate(seed.spawn(5), minutes, style=person(0, 0), protocol=protocol)


BLOCKS = played("blocks", 29.0)
FREE = played("free", 3.0)


def test_class_blocks_are_as_static_as_the_papers_data() -> None:
    # Paper, section 6: p_static = 0.57.
    assert np.mean(BLOCKS.button == 0) == pytest.approx(0.57, abs=0.02)
    assert np.mean(BLOCKS.button == BLOCKS.label) == pytest.approx(0.89, abs=0.02)
    assert len(BLOCKS.frames) == 17_400  # paper, section 4.2: about 17,500


def test_nothing_overlaps() -> None:
    for session in (BLOCKS, FREE):
        everything = sorted((*session.events, *session.distractors), key=lambda e: e.onset_s)
        assert all(a.release_s < b.onset_s for a, b in pairwise(everything))


def test_each_block_holds_one_class_and_the_null_block_only_distractors() -> None:
    block_s = BLOCKS.time_s[-1] / len(LABELS)
    kinds = [
        {event.kind for event in BLOCKS.events if n * block_s <= event.onset_s < (n + 1) * block_s}
        for n in range(len(LABELS))
    ]
    assert kinds[0] == set()
    assert sorted(kind for block in kinds[1:] for kind in block) == sorted(GESTURES)
    assert {d.kind for d in BLOCKS.distractors} == {"brush", "rest"}
    assert all(d.release_s < block_s for d in BLOCKS.distractors)
    assert min(d.onset_s for d in BLOCKS.distractors) > 10.0  # the paper's 10 s of rest


def test_the_button_is_late_uncertain_and_sometimes_forgotten() -> None:
    events = [Event(2.0 * k, 2.0 * k + 1.0, "press") for k in range(1, 4001)]
    time_s = np.arange(1, 810_000) / 100.0
    held = session_script.hold_button(events, ("null", "press"), time_s, np.random.default_rng(0))
    edges = np.diff(held.astype(int))
    down, up = time_s[1:][edges > 0], time_s[1:][edges < 0]
    missed = 1.0 - len(down) / len(events)
    assert missed == pytest.approx(session_script.MISSED, abs=0.003)
    press_error = (down + 1.0) % 2.0 - 1.0
    release_error = up % 2.0 - 1.0
    assert press_error.mean() == pytest.approx(session_script.LATE_S, abs=0.02)
    assert press_error.std() == pytest.approx(session_script.PRESS_SD_S, rel=0.1)
    assert release_error.std() == pytest.approx(session_script.RELEASE_SD_S, rel=0.1)


def test_every_finger_is_known_beside_every_frame() -> None:
    contact = FREE.contact
    assert contact.shape == (len(FREE.frames), 6, 3)
    touched: NDArray[np.bool_] = np.any(np.isfinite(contact[:, :, 2]), axis=1)
    assert touched[FREE.label > 0].mean() > 0.98
    assert not touched[:20].any()
    press = FREE.label == LABELS.index("press")
    np.testing.assert_array_equal(FREE.touch[press], contact[press, 0, :2])
    assert np.isnan(FREE.touch[~press]).all()
    assert (contact[touched, 0, 2][np.isfinite(contact[touched, 0, 2])] > 0.0).all()


def test_a_session_plays_whatever_gestures_it_is_asked_for() -> None:
    session = simulate(1, 2.0, gestures=("swipe", "squeeze", "double_tap"))
    assert session.labels == ("null", "swipe", "squeeze", "double_tap")
    assert {event.kind for event in session.events} == {"swipe", "squeeze", "double_tap"}
    assert set(session.label.tolist()) == {0, 1, 2, 3}
    with pytest.raises(ValueError, match="cannot perform 'wave'"):
        simulate(1, 1.0, gestures=("wave",))


@pytest.mark.parametrize(
    ("rows", "columns", "pitch_mm", "rate_hz"),
    [(5, 5, 10.0, 200.0), (10, 10, 4.4, 30.0), (4, 7, 6.0, 25.0), (20, 20, 2.1, 10.0)],
)
def test_any_grid_and_rate(rows: int, columns: int, pitch_mm: float, rate_hz: float) -> None:
    model = replace(NOMINAL, rows=rows, columns=columns, pitch_mm=pitch_mm)
    session = simulate(2, 0.5, model=model, rate_hz=rate_hz)
    assert session.frames.shape == (round(30 * rate_hz), rows, columns)
    rest = session.frames[: round(2 * rate_hz)].mean(axis=0)
    image = session.frames / rest
    assert np.abs(image[session.label > 0] - 1.0).mean() > 0.04  # fingers are felt everywhere
    pressed = np.isfinite(session.touch[:, 0])
    depths = session.contact[pressed, 0, 2]
    firmest = np.flatnonzero(pressed)[np.argsort(depths)[-5:]]
    for frame in firmest:
        row, column = np.unravel_index(image[frame].argmin(), (rows, columns))
        x, y = session.touch[frame]
        assert abs(column - np.clip(x, 0, columns - 1)) * pitch_mm < 12.0
        assert abs(rows - 1 - row - np.clip(y, 0, rows - 1)) * pitch_mm < 12.0


def test_a_pointer_knows_where_the_dome_is_and_a_hand_does_not_quite() -> None:
    def mean_pinch(seed: int, pointer: bool) -> complex:
        session = simulate(seed, 3.0, pointer=pointer, gestures=("pinch",))
        at = session.contact[session.label == 1]
        return complex(np.nanmean(at[:, :2, 0]) - 2.0, np.nanmean(at[:, :2, 1]) - 2.0)

    hands = np.abs([mean_pinch(seed, pointer=False) for seed in range(4)])
    pointers = np.abs([mean_pinch(seed, pointer=True) for seed in range(4)])
    assert hands.mean() > pointers.mean()


def test_another_session_may_find_the_dome_fuller_or_flatter() -> None:
    same, redrawn = (simulate(4, 1.0, inflation=spread) for spread in (0.0, 0.05))
    assert same.events == redrawn.events  # the hand does not know
    touched = same.label > 0
    assert np.abs(redrawn.frames[touched] / same.frames[touched] - 1.0).max() > 0.002
    np.testing.assert_array_equal(simulate(4, 1.0, inflation=0.05).frames, redrawn.frames)
