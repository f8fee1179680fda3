"""Recordings played many windows at once: the device's pipeline says the same, frame by frame."""

from dataclasses import replace

import numpy as np
import pytest

from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.recordings.recording import RecordingError
from controller.shared.event_metric import Answer
from models.data.ground_truth import GroundTruth
from models.evaluation import replay
from tests.support.recordings import of, origin, played

SHIPPED = bundle.read(bundle.default_path(10.0))
LABELS = SHIPPED.labels
NETWORKS = replay.Batched(SHIPPED)


@pytest.mark.parametrize("preset", ["nominal", "paper-snr"])
def test_a_recording_played_at_once_is_what_the_device_makes_of_it(preset: str) -> None:
    take = played(preset, seed=1)
    out = replay.run(SHIPPED, NETWORKS, take, GroundTruth.of(take, LABELS, "it"))
    pipeline = Pipeline(SHIPPED.settings, Recognizer(SHIPPED), SHIPPED.mapping)
    steps = [pipeline.step(frame, float(t)) for frame, t in zip(take.frames, take.t, strict=True)]
    np.testing.assert_allclose(out.probabilities, [step.probabilities for step in steps], atol=1e-5)
    touches = [step.touch or (np.nan, np.nan) for step in steps]
    np.testing.assert_allclose(out.touches, touches, atol=1e-4)
    fired = [Answer(step.t_s, step.gesture) for step in steps if step.gesture]
    assert list(out.answers) == fired
    assert len(fired) > 20


def test_without_places_the_answers_are_the_same() -> None:
    recording = played("nominal", seed=1)
    known = GroundTruth.of(recording, LABELS, "it")
    whole = replay.run(SHIPPED, NETWORKS, recording, known)
    inputs = replay.network_inputs(recording.frames, SHIPPED.preprocess)
    answers = NETWORKS.probabilities(inputs.windows)
    quick = replay.debounced_stream(known, inputs, answers, LABELS, SHIPPED.debounce)
    assert quick.answers == whole.answers
    assert (quick.probabilities == whole.probabilities).all()
    assert (quick.ready == whole.ready).all()


def test_a_recording_of_another_sensor_is_refused() -> None:
    small = of(np.full((30, 4, 5), 40.0), label=[0] * 30)
    with pytest.raises(RecordingError, match="4×5 sensor"):
        replay.run(SHIPPED, NETWORKS, small, GroundTruth.of(small, LABELS, "it"))
    other = of(np.full((30, 5, 5), 40.0), origin(unit="counts"), label=[0] * 30)
    with pytest.raises(RecordingError, match="counts"):
        replay.refuse(other, SHIPPED)
    by_difference = replace(SHIPPED.preprocess, normalise="difference", scale=100.0)
    replay.refuse(other, replace(SHIPPED, preprocess=by_difference))
