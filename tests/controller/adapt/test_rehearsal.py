"""Rehearsal data are chosen from recordings: every gesture, and touches that are none."""

from pathlib import Path

import numpy as np
import pytest

from controller.adapt import rehearsal
from controller.bundles import bundle
from models.data.simulate import DataSet
from models.evaluation.replay import network_inputs
from models.training import rehearsal as rehearse

SHIPPED = bundle.default_path(10.0)
LOADED = bundle.read(SHIPPED)
PLAYED = [DataSet(seed=77, minutes=1.0).session(user, 0) for user in range(3)]


def test_all_classes_are_there_in_stretches_that_hold_windows() -> None:
    chosen = rehearse.choose(LOADED, PLAYED, frames=600)
    assert 560 <= len(chosen.images) <= 640
    assert set(chosen.label.tolist()) == {0, 1, 2, 3, 4}
    length = int(np.diff(np.flatnonzero(chosen.first))[0])
    windows, touch = chosen.windows(LOADED.window, 1, np.random.default_rng(0))
    stretches = len(chosen.images) // length
    assert len(windows) == stretches * (length - LOADED.window + 1)
    assert 0 < touch.max() < 2 * stretches
    first = windows[0].tobytes()
    inputs = np.concatenate(
        [network_inputs(one.frames, LOADED.preprocess).windows for one in PLAYED]
    )
    rounded = rehearsal.from_bytes(rehearsal.to_bytes(inputs))
    assert any(window.tobytes() == first for window in rounded)  # they are the recordings' own


def test_the_same_recordings_give_the_same_material() -> None:
    one, other = (rehearse.choose(LOADED, PLAYED, frames=300).pack() for _ in range(2))
    assert one == other


def test_a_part_comes_back_as_it_was_packed() -> None:
    chosen = rehearse.choose(LOADED, PLAYED, frames=300)
    back = rehearsal.read(chosen.pack(), (5, 5), 5)
    for name in ("images", "label", "first"):
        assert np.array_equal(getattr(back, name), getattr(chosen, name)), name
    assert back.taught == ()


def test_a_gesture_that_the_bundle_does_not_know_is_refused() -> None:
    odd = DataSet(seed=77, minutes=1.0, gestures=("swipe",)).session(0, 0)
    with pytest.raises(ValueError, match="has the gesture 'swipe'"):
        rehearse.choose(LOADED, [odd])


@pytest.mark.train
def test_a_bundle_with_material_is_otherwise_as_it_was(tmp_path: Path) -> None:
    made = rehearse.write(tmp_path / "x.orb", SHIPPED, rehearse.choose(LOADED, PLAYED, frames=300))
    assert made.gesture_onnx == LOADED.gesture_onnx
    assert made.card == LOADED.card
    assert bundle.REHEARSAL in bundle.unpack((tmp_path / "x.orb").read_bytes())
