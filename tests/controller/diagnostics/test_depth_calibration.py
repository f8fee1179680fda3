"""Calibration of depth: touches of a known depth make what is estimated right."""

from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.bundles import bundle
from controller.diagnostics import calibration
from controller.diagnostics.report import Verdict
from controller.recognition.images.baseline import StoredBaseline
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Pipeline
from controller.sensors import calibration_store
from controller.sensors.calibration_store import Calibration
from controller.shared.aliases import Frames
from controller.shared.errors import UserError
from controller.simulator.hand.gesture import min_jerk
from controller.simulator.orb import OrbSimulator
from tests.support.loop_bench import Certain

USUAL = bundle.read(bundle.default_path())


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calibration_store, "folder", lambda: tmp_path)


def pressed(depth_mm: float, touches: int = 8, hold_s: float = 0.8) -> Frames:
    """An orb that is untouched for 4 s, and then pressed in different places, at 40 Hz."""
    orb = OrbSimulator(np.random.SeedSequence(21), USUAL.rate_hz, 1)
    step_hz = USUAL.rate_hz * orb.steps_per_frame
    time_s = np.arange(round((4.0 + 1.6 * touches) * step_hz)) / step_hz - 4.0
    number, into_s = np.divmod(time_s, 1.6)
    deep = min_jerk(into_s / 0.1) - min_jerk((into_s - 0.1 - hold_s) / 0.1)
    angle = 2.4 * number  # places on a spiral
    point = 3.0 * np.sqrt(np.maximum(number, 0.0)) * np.exp(1j * angle) * 2.0
    depth = np.where(time_s < 0.0, 0.0, depth_mm * deep)[:, None]
    return orb.advance(point[:, None].astype(np.complex128), depth, np.full(depth.shape, 7.0))


@pytest.mark.parametrize("depth_mm", [4.0, 8.0])
def test_presses_of_a_known_depth_make_estimated_depths_right(depth_mm: float) -> None:
    row, factor = calibration.calibrate_depth(USUAL, pressed(depth_mm), depth_mm)
    assert row.verdict is Verdict.GOOD
    assert factor == pytest.approx(1.0, abs=0.35)
    _, double = calibration.calibrate_depth(USUAL, pressed(depth_mm), 1.5 * depth_mm)
    assert factor is not None
    assert double == pytest.approx(1.5 * factor)


@pytest.mark.parametrize(
    ("frames", "asked_mm", "words"),
    [
        (pressed(6.0, touches=3), 6.0, "3 touches of 0.5 s or more were felt, 5 are needed"),
        (pressed(6.0, hold_s=0.1), 6.0, "0 touches"),
        (pressed(12.0), 2.0, "look like"),
    ],
)
def test_presses_that_say_nothing_are_refused(frames: Frames, asked_mm: float, words: str) -> None:
    row, factor = calibration.calibrate_depth(USUAL, frames, asked_mm)
    assert factor is None
    assert words in row.found


def test_depth_needs_the_bundle_s_sensor() -> None:
    with pytest.raises(UserError, match="estimates depth on 5×5 taxels, not on 4×6"):
        calibration.calibrate_depth(USUAL, np.ones((400, 4, 6), dtype=np.float32), 5.0)


def test_a_calibrated_depth_stays_with_the_rest_image_and_reaches_the_pipeline() -> None:
    frames = pressed(6.0, touches=2)
    rest = frames[20:150].mean(axis=0)
    calibration_store.save("orb-1", Calibration(rest, 0.003, 40.0, depth=1.25))
    again = calibration_store.load("orb-1")
    assert again is not None
    assert again.known(40.0).depth == 1.25
    plain, deeper = (
        Pipeline(USUAL.settings, Certain("null"), Mapping(), StoredBaseline(rest, 0.003, one))
        for one in (1.0, 1.25)
    )
    both = []
    for number, frame in enumerate(frames, 1):
        pair = [each.step(frame, number / USUAL.rate_hz).contact for each in (plain, deeper)]
        both += [pair] if None not in pair else []
    assert len(both) > 40
    for one, other in both:
        assert one is not None
        assert other is not None
        assert other.depth_mm == pytest.approx(1.25 * one.depth_mm)
        assert other.rise_sigma == pytest.approx(1.25 * one.rise_sigma)
        assert (other.x, other.fingers) == (one.x, one.fingers)


def test_the_command_refuses_a_depth_that_nobody_pressed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["calibrate", "--sensor", "virtual:seed=5", "--depth", "6"]) == 0
    told = capsys.readouterr()
    assert "now press 6 mm deep" in told.err
    assert "0 touches of 0.5 s or more were felt" in told.out
    kept_of = calibration_store.load("virtual-5")
    assert kept_of is not None
    assert kept_of.depth == 1.0
