"""Information by vocabulary size: two gestures, three, ... all of the simulated hand.

For each vocabulary simulated owners play it, alone, on some days; a classifier is trained on them
(classifier_bound.py), and the device's debouncer answers, its threshold chosen on one more day. On
further days the confusion and the duration of each gesture are a channel (channel.py).
"""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from controller.bundles.vocabulary import Entry, Vocabulary
from controller.recognition.debounce import DebounceSettings
from controller.recognition.images.frames import PreprocessSettings
from controller.simulator.hand.gesture_file import shipped
from controller.simulator.hand.performance import GESTURES
from models.data.augment import Symmetry
from models.data.ground_truth import GroundTruth
from models.data.simulate import DataSet
from models.evaluation import scores
from models.evaluation.replay import debounced_stream, network_inputs
from models.studies.information import channel, classifier_bound
from models.studies.information.windows import GAIN, cut

TAUGHT: Final = 3  # days of training, and one more for the threshold
JUDGED: Final = 3  # further days
OWNERS: Final = 2
MINUTES: Final = 6.0  # of each day
STEP: Final = 3
EPOCHS: Final = 24
ON: Final = (0.5, 0.6, 0.7, 0.8, 0.9)
PAUSE_S: Final = 0.67  # from one gesture's last touch to the next: the demo's median


def order() -> tuple[str, ...]:
    """Return all gestures, in the order in which a vocabulary grows: the paper's four first."""
    known = shipped()
    others = sorted(name for name, one in known.items() if not one.distractor)
    return (*GESTURES, *(name for name in others if name not in GESTURES))


def measure(preset: str, size: int, seed: int) -> dict[str, Any]:
    """Return `labels` of a vocabulary, and `channel.figures` of all owners on such an orb."""
    labels = order()[:size]
    data = DataSet(seed=seed, minutes=MINUTES, preset=preset, gestures=labels)
    sessions = [one for owner in range(OWNERS) for one in _played(data, owner, labels)]
    return {"labels": list(labels), **channel.figures(channel.gather(sessions, labels, PAUSE_S))}


def _played(data: DataSet, owner: int, labels: tuple[str, ...]) -> list[channel.Session]:
    """Return the sessions of the judged days, by a classifier trained on the owner's others."""
    days = [data.session(owner, day) for day in range(TAUGHT + 1 + JUDGED)]
    windows = cut(days[: TAUGHT + 1]).every(STEP)
    taught = windows.session < TAUGHT
    check = windows.flat[~taught], windows.y[~taught]
    symmetry = _symmetry(labels, windows.grid)
    classify = classifier_bound.trained(
        (windows.flat[taught], windows.y[taught]), check, 1 + len(labels), owner, EPOCHS,
        variation=classifier_bound.Variation(windows.grid, symmetry),
    )  # fmt: skip
    temperature = scores.temperature(classify(check[0]), check[1])
    settings = PreprocessSettings(rate_hz=windows.rate_hz, window=windows.x.shape[1])
    named = ("null", *labels)

    def session(day: int, on: float) -> channel.Session:
        inputs = network_inputs(days[day].frames, settings)
        x = GAIN * (inputs.windows.reshape(len(inputs.windows), -1) - 1.0)
        given = scores.softmax(classify(x.astype(np.float32)), temperature).astype(np.float32)
        truth = GroundTruth.of(days[day], named, str(day))
        stream = debounced_stream(truth, inputs, given, named, DebounceSettings(on=on))
        minutes = float(truth.t[-1] - truth.t[0]) / 60.0
        return channel.Session(truth.events, stream.answers, minutes)

    def right(on: float) -> float:
        pooled = channel.gather([session(TAUGHT, on)], labels)
        # A false alarm costs as much as a missed gesture.
        return float(np.trace(pooled.counts()) - pooled.alarms)

    on = max(ON, key=right)
    return [session(TAUGHT + 1 + day, on) for day in range(JUDGED)]


def _symmetry(labels: Sequence[str], grid: tuple[int, int]) -> Symmetry:
    """Return the symmetries that the simulated hand's gestures declare."""
    known, own = shipped(), ("self", "none", *labels)
    declared = tuple(
        Entry(name, name, known[name].rotations, mirror if mirror in own else "none")
        for name, mirror in ((name, known[name].mirror) for name in labels)
    )
    return Symmetry.of(Vocabulary("the hand's", declared), *grid)
