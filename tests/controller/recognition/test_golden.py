"""The whole of recognition against its own earlier answers: nothing changes unnoticed.

The frames are those of `assets/demo.npz`, then the same frames from a sensor that ages: it warms
up, one taxel freezes, another loses its lead, and a jolt moves all of them. When a change is meant
to change answers, `python -m tests.controller.recognition.test_golden` writes them anew; look at
the difference before you commit it.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.recordings import reader
from tests.support.golden import compare

ROOT = Path(__file__).parent.parent.parent.parent
GOLDEN = Path(__file__).with_name("golden.npz")
EVERY = 20  # frames between two that are kept


def sensor() -> tuple[NDArray[np.float32], float]:
    """The frames, (frames, rows, columns), and their rate."""
    recording = reader.load(ROOT / "assets" / "demo.npz")
    new = recording.frames
    warm = np.linspace(1.0, 1.08, len(new))[:, None, None]
    old = new * warm
    old[:, 1, 3] = old[0, 1, 3]  # frozen
    old[len(old) // 2 :, 4, 0] *= 0.1  # its lead breaks
    old[-len(old) // 4 :] *= 0.96  # a jolt
    return np.concatenate([new, old]).astype(np.float32), recording.origin.rate_hz


def answers() -> dict[str, NDArray[Any]]:
    """What recognition says of them, and what it has learned at the end."""
    frames, rate_hz = sensor()
    shipped = bundle.read(bundle.default_path(rate_hz))
    pipeline = Pipeline(shipped.settings, Recognizer(shipped), shipped.mapping)
    kept: dict[str, list[object]] = {"image": [], "probabilities": [], "touch": [], "sigma": []}
    said: dict[str, list[str]] = {"commands": [], "faults": []}
    for number, frame in enumerate(frames, 1):
        step = pipeline.step(frame, number / rate_hz)
        faults = "; ".join(pipeline.check_health())
        if not said["faults"] or not said["faults"][-1].endswith(f": {faults}"):
            said["faults"].append(f"{number}: {faults}")
        if step.command:
            said["commands"].append(f"{number}: {step.command.command}")
        if number % EVERY == 0:
            kept["image"].append(step.image)
            kept["probabilities"].append(step.probabilities)
            kept["touch"].append(step.touch or (np.nan, np.nan))
            kept["sigma"].append(np.nan if step.sigma is None else step.sigma)
    floats = {name: np.array(values, dtype=np.float32) for name, values in kept.items()}
    learned = {key: array.astype(np.float32) for key, array in pipeline.state().items()}
    return {**floats, **{key: np.array(words) for key, words in said.items()}, **learned}


@pytest.fixture(scope="module")
def now() -> dict[str, NDArray[Any]]:
    return answers()


def test_recognition_says_what_it_said(now: dict[str, NDArray[Any]]) -> None:
    compare(GOLDEN, now)


if __name__ == "__main__":
    np.savez_compressed(GOLDEN, allow_pickle=False, **answers())
