"""Teaching on a sensor that rests at zero: its touches are felt as the orb's are."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.recognition.images.frames import Frame, PreprocessSettings
from controller.recognition.images.preprocess import Preprocessor
from controller.recognition.images.scale import SKIN, Signal
from controller.recordings import reader
from controller.recordings.recording import RecordingError, refuse_misfit
from controller.sensors.virtual import Virtual
from models.evaluation.replay import refuse
from tests.support import ROOT
from tests.support.loop_bench import SHIPPED
from tests.support.recordings import of, origin

SCALE, RESTS_AT = 1000.0, 41.0  # counts of the whole capacitance, pF


@pytest.mark.parametrize("sign", [-1, 1])
def test_touched_frames_are_felt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sign: int
) -> None:
    """Of the frames in which the orb feels the gesture, 99 % are felt without its picofarads."""
    first: list[Frame] = []  # of the session: what an autocalibrating board subtracts
    skin = Virtual.read

    def autocalibrated(self: Virtual, t_s: float) -> Frame:
        frame = skin(self, t_s)
        first.append(frame)
        return np.round(-sign * SCALE * (frame - first[0]) / RESTS_AT).astype(np.float32)

    monkeypatch.setattr(Virtual, "read", autocalibrated)
    monkeypatch.setattr(Virtual, "signal", Signal("counts", sign))
    shutil.copytree(ROOT / "examples" / "knock", tmp_path / "mine")
    words = ("--out", str(tmp_path / "mine"), "--session", "1", "--repetitions", "3")
    assert main(["teach", "--sensor", "virtual", *words]) == 0
    taught = reader.load(next((tmp_path / "mine").glob("*.npz")))
    assert (taught.origin.unit, taught.origin.sign) == ("counts", sign)
    assert np.median(np.abs(taught.frames[0])) == 0.0

    def felt(frames: np.ndarray, signal: Signal) -> np.ndarray:
        settings = PreprocessSettings(rate_hz=taught.origin.rate_hz)
        stage = Preprocessor(settings, 5, 5, signal=signal)
        steps = [stage.step(frame) for frame in frames.astype(np.float32)]
        return np.array([step.ready and not step.quiet for step in steps])

    before = felt(np.array(first[: len(taught.frames)]), SKIN)
    touched = before & (taught.label > 0)
    assert touched.sum() > 400
    assert felt(taught.frames, taught.origin.signal)[touched].mean() >= 0.99


def test_a_replay_scales_as_live_but_an_evaluation_refuses() -> None:
    counts = of(np.zeros((30, 5, 5)), origin(unit="counts"))
    refuse_misfit(counts, SHIPPED.settings)
    with pytest.raises(RecordingError, match="in counts, lowered by touch, the bundle wants pF"):
        refuse(counts, SHIPPED)
