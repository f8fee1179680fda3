"""Replay: by the device's pipeline, and by CNN-3D and the debouncer alone."""

from dataclasses import replace

import numpy as np
import pytest

from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.debounce import NULL
from controller.recordings.recording import RecordingError
from controller.shared.event_metric import judge
from models.data.ground_truth import GroundTruth
from models.evaluation import replay
from models.evaluation.event_counts import position_errors
from tests.support.recordings import of, origin, played

SHIPPED = bundle.read(bundle.default_path(10.0))
LABELS = SHIPPED.labels


@pytest.mark.parametrize("preset", ["nominal", "paper-snr"])
def test_a_replay_is_what_a_hand_did(preset: str) -> None:
    take = played(preset, seed=1)
    out = replay.run(SHIPPED, Recognizer(SHIPPED), take, GroundTruth.of(take, LABELS, "it"))
    assert judge(out.truth.events, out.answers).f1 > 0.95
    assert np.median(np.abs(position_errors(out)[:, 1:])) < 0.2  # grid units
    assert (out.probabilities[~out.ready, NULL] == 1.0).all()
    np.testing.assert_allclose(out.probabilities.sum(axis=1), 1.0, atol=1e-5)


def test_without_places_the_answers_are_the_same() -> None:
    recording = played("nominal", seed=1)
    known = GroundTruth.of(recording, LABELS, "it")
    whole = replay.run(SHIPPED, Recognizer(SHIPPED), recording, known)
    inputs = replay.network_inputs(recording.frames, SHIPPED.preprocess)
    answers = replay.probabilities(SHIPPED, inputs.windows)
    quick = replay.debounced_stream(known, inputs, answers, LABELS, SHIPPED.debounce)
    assert quick.answers == whole.answers
    np.testing.assert_allclose(quick.probabilities, whole.probabilities, atol=1e-5)
    assert (quick.ready == whole.ready).all()


def test_a_recording_of_another_sensor_is_refused() -> None:
    small = of(np.full((30, 4, 5), 40.0), label=[0] * 30)
    with pytest.raises(RecordingError, match="4×5 sensor"):
        replay.run(SHIPPED, Recognizer(SHIPPED), small, GroundTruth.of(small, LABELS, "it"))
    other = of(np.full((30, 5, 5), 40.0), origin(unit="counts"), label=[0] * 30)
    with pytest.raises(RecordingError, match="counts"):
        replay.refuse(other, SHIPPED)
    by_difference = replace(SHIPPED.preprocess, normalise="difference", scale=100.0)
    replay.refuse(other, replace(SHIPPED, preprocess=by_difference))
